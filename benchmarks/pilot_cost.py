"""What the pilot rule costs by itself, in nanoseconds of processor time per evaluation.

The time of func alone, at as many points, is subtracted from that of `quad`; points and random numbers are part of it.
func is cos(50 (x_1 + … + x_d)). The least of several times is taken. Writes benchmarks/results/pilot_cost.csv.

    VOROQUAD_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/pilot_cost.py
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import csv_rows
import numpy as np

import voroquad as vq

RESULTS = Path(__file__).parent / "results" / "pilot_cost.csv"
COLUMNS = ["d", "n_points", "nanoseconds_per_evaluation"]
REPEATS = 5


def func(x: np.ndarray) -> np.ndarray:
    return np.cos(50 * x.sum(axis=0))


def seconds(call: Callable[[], object]) -> float:
    """The least processor time of a call."""
    times = []
    for _ in range(REPEATS):
        begin = time.process_time()
        call()
        times.append(time.process_time() - begin)
    return min(times)


def cost(d: int, n: int) -> float:
    """Of the rule alone, per evaluation."""
    points = np.random.default_rng(1).random((d, n))
    whole = seconds(lambda: vq.quad(func, [0] * d, [1] * d, n_points=n, method="pilot", rng=1, threads=1))
    return (whole - seconds(lambda: func(points))) / n * 1e9


def main() -> None:
    rows = [[d, n, f"{cost(d, n):.0f}"] for n in (2**14, 10**6) for d in (1, 2, 3)]
    csv_rows.put(RESULTS, COLUMNS, rows, key=lambda row: (int(row[1]), int(row[0])))
    print(*(" ".join(map(str, row)) for row in rows), sep="\n")


if __name__ == "__main__":
    main()
