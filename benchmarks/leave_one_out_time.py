"""Time per evaluation of the leave-one-out rule on one core, beyond the integrand's own.

Writes benchmarks/results/leave_one_out_time.csv.

    python benchmarks/leave_one_out_time.py
"""

import csv
import time
from pathlib import Path

from voroquad.leave_one_out import HIGHEST_ORDER, fit_strata, stencil
from voroquad.samplers import sample

RESULTS = Path(__file__).parent / "results" / "leave_one_out_time.csv"


def microseconds(d: int, n: int, order: int) -> float:
    """The least of five, per sample."""
    samples, times = sample("stratified", n, d, rng=1), []
    for _ in range(5):
        start = time.perf_counter()
        fit_strata(samples, order, threads=1)
        times.append(time.perf_counter() - start)
    return 1e6 * min(times) / n


def main() -> None:
    rows = [["d", "n", "order", "width", "microseconds_per_evaluation"]]
    for d, n in ((1, 1024), (2, 1024), (3, 1000), (4, 1296)):
        for order in range(1, min(HIGHEST_ORDER[d], 8 if d < 3 else 6) + 1):
            shape = sample("stratified", n, d).strata
            assert shape is not None
            rows.append([d, n, order, stencil(order, shape).width[0], f"{microseconds(d, n, order):.2f}"])
            print(*rows[-1], flush=True)
    with RESULTS.open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


if __name__ == "__main__":
    main()
