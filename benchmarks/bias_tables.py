"""Tables of the bias function on one core: processor time to make one, and its error.

    VOROQUAD_NUM_THREADS=1 python benchmarks/bias_tables.py

writes benchmarks/results/bias_tables.csv. Errors are against the quadrature at the finest setting, at
200 random points (40 in space) of which half are drawn towards the border.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

os.environ.setdefault("VOROQUAD_NUM_THREADS", "1")

import numpy as np

from voroquad.rules.bias_tables import BiasTable, directly, table_plan
from voroquad.study.drawing import write_rows

RESULTS = Path(__file__).parent / "results" / "bias_tables.csv"
CASES: list[tuple[int, int, tuple[int, ...] | None]] = [
    (64, 2, None), (256, 2, None), (4096, 2, None),
    (36, 2, (6, 6)), (1024, 2, (32, 32)), (272, 2, (16, 17)),
    (27, 3, None), (256, 3, None), (4096, 3, None),
    (27, 3, (3, 3, 3)), (1000, 3, (10, 10, 10)),
]  # fmt: skip
REPEATS = 5  # of the tables that take less than a second; the fastest counts


def main() -> None:
    rng = np.random.default_rng(1)
    rows = []
    for n, d, strata in CASES:
        plan = table_plan(n, d, strata)
        seconds, coefficients = timed(plan.coefficients)
        if seconds < 1:
            seconds = min(seconds, *(timed(plan.coefficients)[0] for _ in range(REPEATS)))
        table = BiasTable(plan.axes, coefficients)
        x = rng.random((200 if d == 2 else 40, d))
        x[::2] **= 3
        error = np.abs(table(x) - directly(x, n, strata))
        rows.append(
            {
                "d": d,
                "n": n,
                "design": "uniform" if strata is None else "stratified " + " × ".join(map(str, strata)),
                "points": len(plan.points()[0]),
                "milliseconds": f"{1000 * seconds:.0f}",
                "mean_error": f"{error.mean():.1e}",
                "largest_error": f"{error.max():.1e}",
                "integral_minus_one_unscaled": f"{table.raw_integral - 1:.1e}",
            }
        )
        print(*rows[-1].values(), sep="  ", flush=True)
    write_rows(RESULTS, rows)


def timed(make):  # type: ignore[no-untyped-def]
    begin = time.process_time()
    result = make()
    return time.process_time() - begin, result


if __name__ == "__main__":
    main()
