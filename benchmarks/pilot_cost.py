"""What the pilot rule costs by itself, in nanoseconds of processor time per evaluation.

The time of func alone, at as many points, is subtracted from that of `quad`; points and random numbers are part of it.
func is cos(50 (x_1 + … + x_d)). The least of several times is taken. Writes benchmarks/results/pilot_cost.csv.

    VOROQUAD_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/pilot_cost.py

With `threads` it measures how much less time by the clock the rule takes on two threads than on one. func then returns
values that a first call has kept, so that its own time, on the calling thread, is none of either. The runs alternate.
two_processes is what the machine itself allows: how many times as much two processes compute side by side, each on one
thread, as one alone. Two processors that share caches and memory do less than twice as much. Writes
benchmarks/results/pilot_threads.csv; it needs two idle processors.

    OPENBLAS_NUM_THREADS=1 python benchmarks/pilot_cost.py threads
"""

from __future__ import annotations

import multiprocessing
import sys
import time
from collections.abc import Callable
from multiprocessing.queues import SimpleQueue
from multiprocessing.synchronize import Barrier
from pathlib import Path

import csv_rows
import numpy as np

import voroquad as vq

RESULTS, THREADS = (Path(__file__).parent / "results" / f"pilot_{name}.csv" for name in ("cost", "threads"))
COLUMNS = ["d", "n_points", "nanoseconds_per_evaluation"]
THREADS_COLUMNS = ["d", "n_points", "seconds_on_1", "seconds_on_2", "ratio", "two_processes", "processor_seconds_on_2"]
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


def with_kept_values(d: int, n: int) -> Callable[[int], tuple[float, float]]:
    """What integrates values that are known, on so many threads: time by the clock, and processor time."""
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
    return again


def on_two_threads(d: int, n: int) -> list[str]:
    """The least time by the clock on one and on two threads, ratios, and the processor time on two."""
    again = with_kept_values(d, n)
    pairs = [(again(1), again(2)) for _ in range(REPEATS)]
    one, two = (min(pair[i][0] for pair in pairs) for i in (0, 1))
    beside = 2 * of_processes(1, d, n) / of_processes(2, d, n)
    processor = min(pair[1][1] for pair in pairs)
    return [f"{one:.3f}", f"{two:.3f}", f"{one / two:.2f}", f"{beside:.2f}", f"{processor:.3f}"]


def of_processes(count: int, d: int, n: int) -> float:
    """The least time in which so many processes side by side have integrated once each, on one thread."""
    barrier = multiprocessing.Barrier(count)
    queue: SimpleQueue[float] = multiprocessing.SimpleQueue()
    processes = [multiprocessing.Process(target=one_process, args=(barrier, queue, d, n)) for _ in range(count)]
    for process in processes:
        process.start()
    times = [max(queue.get() for _ in range(count)) for _ in range(REPEATS)]
    for process in processes:
        process.join()
    return min(times)


def one_process(barrier: Barrier, queue: SimpleQueue[float], d: int, n: int) -> None:
    """Puts the time of each repetition, which all processes begin together."""
    again = with_kept_values(d, n)
    for _ in range(REPEATS):
        barrier.wait()
        queue.put(again(1)[0])


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
