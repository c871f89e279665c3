"""CPU time per evaluation of the leave-one-out rules, beyond the integrand's own.

Orders on grids of about a thousand strata, kriging and the choice of a model (the default of vq.quad) on grids of
several sizes, with the sets that vq.quad draws.
Writes benchmarks/results/leave_one_out_time.csv.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/leave_one_out_time.py
"""

import csv
import math
import time
from pathlib import Path

import numpy as np

from voroquad.designs.grids import largest_grid
from voroquad.designs.sampling import sample
from voroquad.rules.chosen_fits import fit_by_choice
from voroquad.rules.method import CHOICE, KRIGING, Method, highest_order, local
from voroquad.rules.strata_fits import fit_strata, stencil

RESULTS = Path(__file__).parent / "results" / "leave_one_out_time.csv"


def microseconds(d: int, n: int, method: Method) -> float:
    """The least of five, per sample."""
    samples, times = sample("multi-jittered", n, d, rng=1), []
    for _ in range(5):
        start = time.process_time()
        if method is CHOICE:
            fit_by_choice(samples, method, 1, np.exp(samples.batch.sum(axis=-1))[:, None])
        else:
            fit_strata(samples, method, threads=1)
        times.append(time.process_time() - start)
    return 1e6 * min(times) / n


def main() -> None:
    rows: list[list[object]] = [["d", "strata", "order", "width", "microseconds_per_evaluation"]]
    for d in (1, 2, 3, 4):
        shape = largest_grid(1296, d)
        for order in range(1, min(highest_order(d), 8 if d < 3 else 6) + 1):
            rows.append(line(shape, local(order), stencil(order, shape).width[0]))
    for d in (2, 3, 4):
        for n in (128, 512, 1024, 2048):
            rows += [line(largest_grid(n, d), method, "") for method in (KRIGING, CHOICE)]
    with RESULTS.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def line(shape: tuple[int, ...], method: Method, width: int | str) -> list[object]:
    time_taken = microseconds(len(shape), math.prod(shape), method)
    row: list[object] = [len(shape), "×".join(map(str, shape)), method.order, width, f"{time_taken:.2f}"]
    print(*row, flush=True)
    return row


if __name__ == "__main__":
    main()
