"""Peak memory of `quad` and of `cells` with many points.

Each case runs in a process of its own. Its peak resident memory is read before, when all is imported and a small
integral is done or a few cells are cut, and after; the difference is what the integral took, or the measures of cells
with the array of their points. func is cos(x_1 + … + x_d). Writes benchmarks/results/memory.csv.

    VOROQUAD_NUM_THREADS=1 nice -n 19 python benchmarks/memory.py                (`--only cells` runs these alone)
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
from pathlib import Path

import csv_rows
import numpy as np

import voroquad as vq

RESULTS = Path(__file__).parent / "results" / "memory.csv"
COLUMNS = ["method", "d", "n_points", "evaluations", "megabytes_before", "megabytes_more"]
CASES = [("pilot", d, n) for d in (1, 2, 3) for n in (10**6, 10**7, 10**8)]
CASES += [("polynomials", d, n) for d in (4, 8) for n in (10**6, 10**7)]
CASES += [("cells", 2, n) for n in (10**6, 10**7, 10**8)] + [("cells", 3, n) for n in (10**6, 10**7)]


def peak() -> float:
    """Megabytes (10^6 bytes) that the process has had in memory at most."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6


def measure(method: str, d: int, n: int) -> tuple[int, float, float]:
    """Evaluations or cells, megabytes before and more, in this process."""

    def integrate(points: int) -> int:
        return vq.quad(
            lambda x: np.cos(x.sum(axis=0)), [0] * d, [1] * d, n_points=points, method=method, rng=1
        ).n_evaluations

    def cut(points: int) -> int:
        return len(vq.cells(np.random.default_rng(1).random((points, d))).measures)

    take = cut if method == "cells" else integrate
    take(1 << 14)
    before = peak()
    done = take(n)
    return done, before, peak() - before


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--case", nargs=3, help=argparse.SUPPRESS)
    parser.add_argument("--largest", type=int, default=10**8)
    parser.add_argument("--only", choices=sorted({method for method, _, _ in CASES}))
    options = parser.parse_args()
    if options.case:
        method, d, n = options.case
        print(*measure(method, int(d), int(n)))
        return
    for case in CASES:
        if case[2] > options.largest or options.only not in (None, case[0]):
            continue
        command = [sys.executable, __file__, "--case", *map(str, case)]
        out = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
        line = [*case, out[0], f"{float(out[1]):.0f}", f"{float(out[2]):.0f}"]
        print(*line, flush=True)
        csv_rows.put(RESULTS, COLUMNS, [line], key=lambda row: (row[0], int(row[1]), int(row[2])))


if __name__ == "__main__":
    main()
