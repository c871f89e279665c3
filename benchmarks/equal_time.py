"""Squared error against processor time, where func costs about 40 ns per point: vq.quad and its peers.

Each rule runs with numbers of points that double, until a call takes longer than --longest seconds of processor time,
on one thread. The integrands are members of eight families (voroquad.study.genz), each with a loop that makes it cost
40 ns. "quad" has the method that docs/quadrature.md recommends for cheap integrands: "pilot" in up to three dimensions,
"polynomials" above; "quad, default" has none. Times are medians, errors means over replicates of the squared error
relative to the integral.

Writes benchmarks/results/equal_time.csv, in the place of the lines of the same dimensions and rules, and with --figure
draws docs/figures/equal-time.svg from it. The tables of docs/measured/integrals.md are made from it.

    VOROQUAD_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/equal_time.py --figure
    ... --dimensions 4 --longest 1 --replicates 3    # ten minutes for a dimension
    ... --longest 10 --replicates 5    # six hours
"""

from __future__ import annotations

import argparse
import dataclasses
import time
import warnings
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import csv_rows
import numpy as np
from peer_rules import cubic_rule
from qmcpy import AbstractIntegrand, CubQMCLatticeG, CubQMCNetG, DigitalNetB2, Lattice, Uniform  # type: ignore
from scipy.stats import qmc

import voroquad as vq
from voroquad._support.checks import whole_numbers
from voroquad.integrals.methods import MANY_POINTS, OWN_POINTS
from voroquad.study import peers
from voroquad.study.genz import instances
from voroquad.study.integrand import KnownIntegrand

RESULTS = Path(__file__).parent / "results" / "equal_time.csv"
COLUMNS = ["d", "family", "rule", "n", "milliseconds", "squared_error", "replicates"]
NANOSECONDS = 40.0
FEWEST, MOST = 32, 10**9
Rule = Callable[[KnownIntegrand, int, np.random.Generator], float]


def by_quad(f: KnownIntegrand, n: int, rng: np.random.Generator, recommended: bool) -> float:
    method = ("pilot" if f.d <= OWN_POINTS["pilot"][0] else "polynomials") if recommended else "auto"
    if n < OWN_POINTS.get(method, (0, 0))[1]:
        raise ValueError("too few points")
    return float(vq.quad(f, [0] * f.d, [1] * f.d, n_points=n, method=method, rng=rng, threads=1).integral)


def by_peer(f: KnownIntegrand, n: int, rng: np.random.Generator, rule: Callable[..., tuple[float, int]]) -> float:
    return rule(f, n, rng)[0]


def by_cubic(f: KnownIntegrand, n: int, rng: np.random.Generator) -> float:
    return float(cubic_rule(4).estimate([f], n, rng)[0][0])


class _Integrand(AbstractIntegrand):  # type: ignore
    """Of QMCPy."""

    def __init__(self, f: KnownIntegrand, points: object):
        self.sampler, self.true_measure, self.func = points, Uniform(points), f
        super().__init__(dimension_indv=(), dimension_comb=(), parallel=False)

    def g(self, t: np.ndarray, *_: object, **__: object) -> np.ndarray:
        return self.func.values(t)


def by_qmcpy(f: KnownIntegrand, n: int, rng: np.random.Generator, points: type, rule: type) -> float:
    """Its stopping criterion with a tolerance that is never met, so that it ends at n points."""
    size = 1 << (n.bit_length() - 1)
    drawn = points(f.d, seed=int(rng.integers(2**31)))
    found, _ = rule(_Integrand(f, drawn), abs_tol=0, rel_tol=0, n_init=min(size, 2**8), n_limit=size).integrate()
    return float(np.ravel(found)[0])


RULES: dict[str, Rule] = {
    "quad": partial(by_quad, recommended=True),
    "quad, default": partial(by_quad, recommended=False),
    "qmc_quad": partial(by_peer, rule=partial(peers.qmc_quad, engine=qmc.Sobol)),
    "cubature": partial(by_peer, rule=peers.cubature),
    "vegas": partial(by_peer, rule=peers.vegas),
    "CubQMCNetG": partial(by_qmcpy, points=DigitalNetB2, rule=CubQMCNetG),
    "CubQMCLatticeG": partial(by_qmcpy, points=Lattice, rule=CubQMCLatticeG),
    "cubic stratification": by_cubic,
}


def costly(f: KnownIntegrand) -> KnownIntegrand:
    """The same function, at about 40 ns per point in large batches."""
    x = np.random.default_rng(1).random((2**16, f.d))
    own = seconds(lambda: f.values(x))[0] / len(x) * 1e9
    each = seconds(lambda: np.cos(x[:, 0]))[0] / len(x) * 1e9
    extra = max(0, round((NANOSECONDS - own) / each))

    def values(at: np.ndarray) -> np.ndarray:
        for _ in range(extra):
            np.cos(at[..., 0])
        return f.values(at)

    return dataclasses.replace(f, values=values)


def seconds(call: Callable[[], object]) -> tuple[float, object]:
    """The least processor time of three calls, and the value."""
    times = []
    for _ in range(3):
        begin = time.process_time()
        value = call()
        times.append(time.process_time() - begin)
    return min(times), value


def ladder(rule: Rule, f: KnownIntegrand, longest: float, replicates: int) -> list[list[object]]:
    """Numbers of points with times in milliseconds and squared relative errors."""
    found: list[list[object]] = []
    n, scale = FEWEST, abs(f.integral) or 1.0
    while n <= MOST:
        times, errors = [], []
        try:
            if n == FEWEST:
                rule(f, n, np.random.default_rng(0))  # imports, tables
            for seed in range(replicates):
                begin = time.process_time()
                value = rule(f, n, np.random.default_rng([n, seed]))
                times.append(time.process_time() - begin)
                errors.append(((value - f.integral) / scale) ** 2)
                if times[0] > longest:
                    break
        except (ValueError, ZeroDivisionError, IndexError):  # too few points for this rule
            if n >= 2**12:
                break
            n *= 2
            continue
        if np.median(times) > longest:
            if rule is not RULES["quad, default"] or n >= MANY_POINTS.get(f.d, 0):
                break
            n = MANY_POINTS[f.d]  # from where on the default is a cheaper rule
            continue
        if np.isfinite(errors).all():
            found.append([n, f"{1e3 * np.median(times):.4g}", f"{np.mean(errors):.3g}"])
        n *= 2
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--longest", type=float, default=0.25, help="seconds of processor time of a call")
    parser.add_argument("--replicates", type=int, default=2)
    parser.add_argument("--dimensions", default="1,2,3,4,6,8")
    parser.add_argument("--rules", default="|".join(RULES), help="separated by |")
    parser.add_argument("--figure", action="store_true", help="draw docs/figures/equal-time.svg, too")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    for d in whole_numbers("dimensions", options.dimensions):
        families = [costly(f) for f in instances(d, 1, rng=[9, d])]
        measure(d, families, options.rules.split("|"), options.longest, options.replicates)
    if options.figure:
        from equal_time_figure import draw

        draw()


def measure(d: int, families: Sequence[KnownIntegrand], rules: Sequence[str], longest: float, replicates: int) -> None:
    for name in rules:
        rows: list[list[object]] = []
        for f in families:
            rows += [[d, f.name, name, *line, replicates] for line in ladder(RULES[name], f, longest, replicates)]
        print(d, name, len(rows), flush=True)
        csv_rows.put(RESULTS, COLUMNS, rows, key=lambda row: (int(row[0]), row[1], row[2], int(row[3])))


if __name__ == "__main__":
    main()
