"""What ``method="polynomials"`` costs by itself, in nanoseconds of processor time per evaluation, on one thread.

Points and random numbers are part of it, func is not. On a member of each of Genz's eight families, since the rule fits
as long as that promises to pay: the least and the most over the families, of each the least of several calls. Writes
benchmarks/results/replicate_cost.csv.

    VOROQUAD_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/replicate_cost.py
"""

from __future__ import annotations

import argparse
import time
import warnings
from pathlib import Path

import csv_rows
import numpy as np
from replicate_time import Timed

import voroquad as vq
from voroquad._support.checks import whole_numbers
from voroquad.study.genz import instances
from voroquad.study.integrand import KnownIntegrand

RESULTS = Path(__file__).parent / "results" / "replicate_cost.csv"
COLUMNS = ["d", "n_points", "least", "median", "most"]
REPEATS = 3


def cost(func: KnownIntegrand, n: int) -> float:
    """Nanoseconds per evaluation."""
    found = []
    for seed in range(REPEATS):
        timed = Timed(func)
        begin = time.process_time()
        r = vq.quad(timed, [0] * func.d, [1] * func.d, n_points=n, method="polynomials", rng=seed, threads=1)
        found.append((time.process_time() - begin - timed.seconds) / r.n_evaluations * 1e9)
    return min(found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dimensions", default="4,5,6,8")
    parser.add_argument("--sizes", default="16384,131072,1000000")
    options = parser.parse_args()
    warnings.simplefilter("ignore", vq.IntegrationWarning)
    for n in whole_numbers("sizes", options.sizes):
        for d in whole_numbers("dimensions", options.dimensions):
            costs = [cost(func, n) for func in instances(d, 1, rng=[d, 7])]
            row = [d, n, *(f"{x:.0f}" for x in (min(costs), np.median(costs), max(costs)))]
            print(*row, flush=True)
            csv_rows.put(RESULTS, COLUMNS, [row], key=lambda r: (int(r[1]), int(r[0])))


if __name__ == "__main__":
    main()
