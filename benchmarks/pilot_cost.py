"""What the pilot rule costs by itself, in nanoseconds of processor time per evaluation.

The time of func alone, at as many points, is subtracted from that of `quad`; points and random numbers are part of it.
func is cos(50 (x_1 + … + x_d)). The least of several times is taken. Writes benchmarks/results/pilot_cost.csv.

    VOROQUAD_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/pilot_cost.py

With `threads` it measures how much less time by the clock the rule takes on two threads than on one. func then returns
values that a first call has kept, so that its own time, on the calling thread, is none of either. The runs alternate.
Writes benchmarks/results/pilot_threads.csv; it needs two idle processors.

    OPENBLAS_NUM_THREADS=1 python benchmarks/pilot_cost.py threads
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import csv_rows
import numpy as np

import voroquad as vq

RESULTS, THREADS = (Path(__file__).parent / "results" / f"pilot_{name}.csv" for name in ("cost", "threads"))
COLUMNS = ["d", "n_points", "nanoseconds_per_evaluation"]
THREADS_COLUMNS = ["d", "n_points", "seconds_on_1", "seconds_on_2", "ratio", "processor_seconds_on_2"]
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


def on_two_threads(d: int, n: int) -> list[str]:
    """The least time by the clock on one and on two threads, their ratio, and the processor time on two."""
    kept: list[np.ndarray] = []

    def kept_func(x: np.ndarray) -> np.ndarray:
        kept.append(func(x))
        return kept[-1]

    def spent(func: Callable[[np.ndarray], np.ndarray], threads: int) -> tuple[float, float]:
        clock, processor = time.perf_counter(), time.process_time()
        vq.quad(func, [0] * d, [1] * d, n_points=n, method="pilot", rng=1, threads=threads)
        return time.perf_counter() - clock, time.process_time() - processor

    def again(threads: int) -> tuple[float, float]:
        values = iter(kept)
        return spent(lambda _: next(values), threads)

    spent(kept_func, 1)
    pairs = [(again(1), again(2)) for _ in range(REPEATS)]
    one, two = (min(pair[i][0] for pair in pairs) for i in (0, 1))
    return [f"{one:.3f}", f"{two:.3f}", f"{one / two:.2f}", f"{min(pair[1][1] for pair in pairs):.3f}"]


def main() -> None:
    if sys.argv[1:] == ["threads"]:
        path, columns = THREADS, THREADS_COLUMNS
        rows = [[str(d), str(n), *on_two_threads(d, n)] for n in (10**6, 10**7) for d in (1, 2, 3)]
    elif not sys.argv[1:]:
        path, columns = RESULTS, COLUMNS
        rows = [[str(d), str(n), f"{cost(d, n):.0f}"] for n in (2**14, 10**6) for d in (1, 2, 3)]
    else:
        raise SystemExit(__doc__)
    csv_rows.put(path, columns, rows, key=lambda row: (int(row[1]), int(row[0])))
    print(*(" ".join(row) for row in rows), sep="\n")


if __name__ == "__main__":
    main()
