"""Errors of the methods of `quad` by dimension and number of points: where its default should change to another.

Squared errors on one member of each of Genz's eight families, the mean over repetitions, then the geometric mean over
the families. The methods but "pilot" and "polynomials" take all families in one call: their weights are the same.
Writes benchmarks/results/methods.csv, where lines that are not measured stay.

    VOROQUAD_NUM_THREADS=1 nice -n 19 python benchmarks/methods.py --repetitions 4
"""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path

import csv_rows
import numpy as np

import voroquad as vq
from voroquad.study.genz import instances

RESULTS = Path(__file__).parent / "results" / "methods.csv"
#: Dimension: the methods to compare, the rule for few points first.
METHODS = {
    1: ("local", "pilot"),
    2: ("kriging", "local", "pilot"),
    3: ("kriging", "pilot"),
    4: ("kriging", "polynomials", "plain"),
    6: ("kriging", "polynomials", "plain"),
}
SIZES = (1024, 2048, 4096, 8192, 16_384)


def squared_errors(d: int, n: int, method: str, repetitions: int) -> np.ndarray:
    """Mean squared errors (families,)."""
    members = list(instances(d, 1, rng=11))
    exact = np.array([m.integral for m in members])

    def estimate(seed: int) -> np.ndarray:
        how = {"n_points": n, "method": method, "rng": seed}
        low, high = np.zeros(d), np.ones(d)
        if method in ("pilot", "polynomials"):
            return np.array([vq.quad(m, low, high, **how).integral for m in members])
        return np.asarray(vq.quad(lambda x: np.stack([m(x) for m in members]), low, high, **how).integral)

    return np.mean([np.square(estimate(seed) - exact) for seed in range(repetitions)], axis=0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repetitions", type=int, default=4)
    parser.add_argument("--dimensions", default="1,2,3,4,6")
    parser.add_argument("--largest", type=int, default=SIZES[-1])
    options = parser.parse_args()
    warnings.simplefilter("ignore", vq.IntegrationWarning)
    names = [m.name for m in instances(2, 1, rng=11)]
    rows = []
    for d in map(int, options.dimensions.split(",")):
        for n in (size for size in SIZES if size <= options.largest):
            for method in METHODS[d]:
                errors = np.maximum(squared_errors(d, n, method, options.repetitions), 1e-34)
                mean = float(np.exp(np.log(errors).mean()))
                rows.append([d, n, method, options.repetitions, f"{mean:.2e}", *(f"{e:.2e}" for e in errors)])
                print(*rows[-1], flush=True)
    columns = ["d", "n", "method", "repetitions", "geometric_mean", *names]
    csv_rows.put(RESULTS, columns, rows, key=lambda row: (int(row[0]), int(row[1]), row[2]))


if __name__ == "__main__":
    main()
