"""``method="polynomials"`` beside SciPy's `qmc_quad` at equal processor time, for integrands of 40 ns per point.

Errors and times are measured at powers of two of the evaluations, on one thread. The time is that of a call without
func, plus 40 ns for each point that it gets; the median of several. Between the sizes logarithms are interpolated. The
ratios of mean squared errors, ours over that of `qmc_quad`, at times that double, are geometric means over members of
each of the eight families. Writes benchmarks/results/replicate_time.csv, for docs/measured/integrals.md; rows of
dimensions that are not measured stay.

    VOROQUAD_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 nice python benchmarks/replicate_time.py --dimensions 4,6,8
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import csv_rows
import numpy as np
from scipy.integrate import qmc_quad
from scipy.stats import qmc

import voroquad as vq
from voroquad._support.checks import whole_numbers
from voroquad.study.genz import FAMILIES, instances
from voroquad.study.integrand import KnownIntegrand

RESULTS = Path(__file__).parent / "results" / "replicate_time.csv"
HEAD = ["d", "milliseconds", *FAMILIES]
COST = 40e-9
SETS = 8
#: Powers of two of the evaluations: the first, and of ours the step
FIRST, STEP = 6, 2


class Timed:
    """An integrand that adds up its points and the processor time of its calls."""

    def __init__(self, func: KnownIntegrand):
        self.func, self.points, self.seconds = func, 0, 0.0

    def __call__(self, x: np.ndarray) -> np.ndarray:
        begin = time.process_time()
        values = self.func(x)
        self.seconds += time.process_time() - begin
        self.points += values.size
        return values


def ours(func: Callable[[np.ndarray], np.ndarray], d: int, n: int, seed: int, method: str) -> float:
    r = vq.quad(func, np.zeros(d), np.ones(d), n_points=n, method=method, rng=seed, threads=1)
    return float(r.integral)


def theirs(func: Callable[[np.ndarray], np.ndarray], d: int, n: int, seed: int, _: str) -> float:
    engine = qmc.Sobol(d, rng=seed)
    found = qmc_quad(func, np.zeros(d), np.ones(d), n_points=n // SETS, n_estimates=SETS, qrng=engine)
    return float(found.integral)


def curve(rule: Callable[..., float], func: KnownIntegrand, sizes: list[int], seeds: int, method: str) -> np.ndarray:
    """Logarithms (2, sizes) of the time of a call, and of the mean squared error."""
    rows = []
    for n in sizes:
        own, squares = [], []
        for seed in range(seeds):
            timed = Timed(func)
            begin = time.process_time()
            estimate = rule(timed, func.d, n, seed, method)
            own.append(time.process_time() - begin - timed.seconds + COST * timed.points)
            squares.append((estimate - func.integral) ** 2)
        rows.append([np.log(np.median(own)), np.log(max(np.mean(squares), 1e-34))])
    return np.array(rows).T


def main() -> None:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dimensions", default="4,6,8")
    parser.add_argument("--largest", type=int, default=20, help="power of two of the evaluations")
    parser.add_argument("--members", type=int, default=3, help="of each family")
    parser.add_argument("--repetitions", type=int, default=12)
    parser.add_argument("--method", default="polynomials")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    sizes = [1 << k for k in range(FIRST, options.largest + 1, STEP)]
    for d in whole_numbers("dimensions", options.dimensions):
        ratios: list[np.ndarray] = []
        budgets = 1e-3 * 2.0 ** np.arange(15)
        for func in instances(d, options.members, rng=[d, 6]):
            (time_of_ours, error_of_ours), (time_of_theirs, error_of_theirs) = (
                curve(rule, func, sizes, options.repetitions, options.method) for rule in (ours, theirs)
            )
            at = np.log(budgets)
            ratio = np.interp(at, time_of_ours, error_of_ours) - np.interp(at, time_of_theirs, error_of_theirs)
            within = (at <= min(time_of_ours[-1], time_of_theirs[-1])) & (at >= time_of_ours[0])
            ratios.append(np.where(within, ratio, np.nan))
        means = np.exp(np.array(ratios).reshape(len(FAMILIES), options.members, -1).mean(axis=1))
        lines = [
            [d, f"{1e3 * budget:g}", *(f"{x:.2g}" for x in means[:, i])]
            for i, budget in enumerate(budgets)
            if np.isfinite(means[:, i]).all()
        ]
        print(*(" ".join(map(str, line)) for line in lines), sep="\n", flush=True)
        csv_rows.put(RESULTS, HEAD, lines, key=lambda row: (int(row[0]), float(row[1])))


if __name__ == "__main__":
    main()
