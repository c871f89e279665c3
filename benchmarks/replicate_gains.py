"""``method="polynomials"`` against the plain mean of eight sets of SciPy's Sobol' points, at equal evaluations.

Ratios of mean squared errors, sets over rule, on members of Genz's eight families: of each family the geometric mean
over its members. Writes benchmarks/results/replicate_gains.csv; rows of cases that are not measured stay.

    VOROQUAD_NUM_THREADS=1 nice -n 19 python benchmarks/replicate_gains.py --dimensions 4,6,8
"""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path

import csv_rows
import numpy as np
from scipy.stats import qmc

import voroquad as vq
from voroquad._support.checks import whole_numbers
from voroquad.study.genz import FAMILIES, instances

RESULTS = Path(__file__).parent / "results" / "replicate_gains.csv"
HEAD = ["d", "n", "members", "repetitions", "geometric mean", *FAMILIES]
SETS = 8


def gains(d: int, n: int, members: int, repetitions: int) -> np.ndarray:
    """Ratios of mean squared errors (families,)."""
    funcs = list(instances(d, members, rng=[d, 17]))
    exact = np.array([f.integral for f in funcs])

    def ours(seed: int) -> list[float]:
        how = {"method": "polynomials", "n_points": n, "rng": seed, "threads": 1}
        return [vq.quad(f, np.zeros(d), np.ones(d), **how).integral for f in funcs]

    def sets(seed: int) -> np.ndarray:
        engines = [qmc.Sobol(d, bits=53, rng=rng) for rng in np.random.default_rng([seed, 1]).spawn(SETS)]
        points = np.concatenate([engine.random(n // SETS) for engine in engines]).T
        return np.array([f(points).mean() for f in funcs])

    squares = [
        np.mean([np.square(estimate(seed) - exact) for seed in range(repetitions)], axis=0) for estimate in (sets, ours)
    ]
    return np.exp(np.log(squares[0] / squares[1]).reshape(len(FAMILIES), members).mean(axis=1))


def main() -> None:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dimensions", default="4,6,8")
    parser.add_argument("--sizes", default="16384")
    parser.add_argument("--members", type=int, default=5, help="of each family")
    parser.add_argument("--repetitions", type=int, default=30)
    options = parser.parse_args()
    warnings.simplefilter("ignore", vq.IntegrationWarning)
    for n in whole_numbers("sizes", options.sizes):
        for d in whole_numbers("dimensions", options.dimensions):
            of_family = gains(d, n, options.members, options.repetitions)
            mean = np.exp(np.log(of_family).mean())
            row = [d, n, options.members, options.repetitions, *(f"{x:.3g}" for x in (mean, *of_family))]
            print(*row, flush=True)
            csv_rows.put(RESULTS, HEAD, [row], key=lambda r: (int(r[1]), int(r[0])))


if __name__ == "__main__":
    main()
