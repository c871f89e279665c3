"""Integrands that a grid resolves badly, by the pilot rule and by 8 sets of scrambled Sobol' points.

Peaks, balls, a layer along an axis, waves of many periods and in step with the grid, ends with a power. The table in
docs/measured/integrals.md has the mean squared error of the Sobol' points over that of the pilot rule, the part of the
95 % intervals that hold the integral, and the part of the calls that warn, and of what.
Writes benchmarks/results/pilot_stress.csv; lines of dimensions that are not measured stay.

    nice -n 19 python benchmarks/pilot_stress.py [--replicates 50] [--dimensions 1,2,3]   # two minutes
"""

from __future__ import annotations

import argparse
import math
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import csv_rows
import numpy as np
from scipy.special import erf
from scipy.stats import qmc

import voroquad as vq
from voroquad._support.checks import whole_numbers
from voroquad.integrals.pilot import grid_side

RESULTS = Path(__file__).parent / "results" / "pilot_stress.csv"
COLUMNS = ["d", "n_points", "integrand", "replicates", "mse_sobol", "mse", "gain", "coverage", "warned", "kind"]
POINTS, SETS = 16_384, 8
Func = Callable[[np.ndarray], np.ndarray]


def integrands(d: int) -> Iterator[tuple[str, Func, float]]:
    """Names, functions of points (d, n), and integrals over the unit box."""
    centre = np.linspace(0.421, 0.613, d)[:, None]
    k = grid_side(POINTS, d)
    direction = np.array([0.36, 0.48, 0.8])[:d, None]
    direction /= np.linalg.norm(direction)
    for width in (0.02, 0.01, 0.005):
        sides = [erf((1 - c) / width / math.sqrt(2)) + erf(c / width / math.sqrt(2)) for c in centre[:, 0]]
        exact = math.prod(width * math.sqrt(math.pi / 2) * side for side in sides)
        yield f"Gaussian of width {width}", _gaussian(centre, width, exact), 1.0
    for radius in (0.05, 0.01):
        volume = {1: 2 * radius, 2: math.pi * radius**2, 3: 4 / 3 * math.pi * radius**3}[d]
        yield f"ball of radius {radius}", _ball(centre, radius, volume), 1.0
    yield "layer of width 0.003", lambda x: (np.abs(x[0] - 0.4321) < 0.0015) / 0.003, 1.0
    for rate in (100.0, 1000.0, 1e5):
        exact = math.cos(rate * direction.sum() / 2 + 0.3) * float(np.prod(np.sinc(rate * direction / 2 / math.pi)))
        yield f"cos({rate:g} x·n + 0.3)", _wave(direction, rate), exact
    yield "wave in step with the grid", lambda x: np.cos(2 * np.pi * k * x[0]), 0.0
    yield "product of waves in step", lambda x: np.prod(np.cos(2 * np.pi * k * x), axis=0), 0.0
    yield "wave in step, on a slope", lambda x: np.exp(x[0]) + 1e-3 * np.cos(2 * np.pi * k * x[0]), math.e - 1
    yield "product of x^−0.45", lambda x: np.prod(0.55 * np.maximum(x, 1e-300) ** -0.45, axis=0), 1.0
    yield "√x", lambda x: 1.5 * np.sqrt(x[0]), 1.0
    if d > 1:
        a = 1 / 0.003
        exact = (math.sqrt(math.pi) * a * math.erf(a) + math.exp(-a * a) - 1) / a**2
        yield "ridge of width 0.003", lambda x: np.exp(-np.square(a * (x[0] - x[1]))) / exact, 1.0
    if d == 2:
        yield "1/r", lambda x: 1 / np.hypot(*np.maximum(x, 1e-300)) / (2 * math.log(1 + math.sqrt(2))), 1.0


def _gaussian(centre: np.ndarray, width: float, exact: float) -> Func:
    return lambda x: np.exp(-np.square((x - centre) / width).sum(axis=0) / 2) / exact


def _ball(centre: np.ndarray, radius: float, volume: float) -> Func:
    return lambda x: (np.square(x - centre).sum(axis=0) < radius**2) / volume


def _wave(direction: np.ndarray, rate: float) -> Func:
    return lambda x: np.cos(rate * (direction * x).sum(axis=0) + 0.3)


def sobol(f: Func, d: int, seed: int) -> float:
    """The mean over sets of scrambled points, as many in all."""
    rng = np.random.default_rng([seed, 1])
    return float(np.mean([f(qmc.Sobol(d, rng=rng).random(POINTS // SETS).T).mean() for _ in range(SETS)]))


def row(d: int, name: str, f: Func, exact: float, replicates: int) -> list[object]:
    """What the rules make of an integrand."""
    ours, held, kinds = [], 0, Counter[str]()
    for seed in range(replicates):
        r = vq.quad(f, [0] * d, [1] * d, n_points=POINTS, method="pilot", rng=seed, threads=1)
        low, high = r.confidence_interval()
        ours.append(r.integral - exact)
        held += low <= exact <= high
        kinds[r.warnings[0].kind if r.warnings else ""] += 1
    theirs = np.square([sobol(f, d, seed) - exact for seed in range(replicates)]).mean()
    mse = max(np.square(ours).mean(), 1e-34)
    warned = replicates - kinds.pop("", 0)
    kind = kinds.most_common(1)[0][0] if kinds else ""
    return [
        d, POINTS, name, replicates, f"{theirs:.3g}", f"{mse:.3g}", f"{theirs / mse:.3g}",
        f"{held / replicates:.3f}", f"{warned / replicates:.3f}", kind,
    ]  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--replicates", type=int, default=50)
    parser.add_argument("--dimensions", default="1,2,3")
    options = parser.parse_args()
    warnings.simplefilter("ignore", vq.IntegrationWarning)
    dimensions = whole_numbers("dimensions", options.dimensions)
    for d in dimensions:
        rows = [row(d, *case, options.replicates) for case in integrands(d)]
        print(*(" ".join(map(str, line)) for line in rows), sep="\n", flush=True)
        csv_rows.put(RESULTS, COLUMNS, rows, key=lambda line: (int(line[0]), str(line[2])))


if __name__ == "__main__":
    main()
