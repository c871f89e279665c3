"""Calibrate the error bar of one multi-jittered set: what (Σ (|S_i| r_i)²)^½ must be multiplied by.

For every default order of :func:`voroquad.quad` and grids of several sizes, draw many sets, integrate
random members of the eight families, and find the least factor with which ±1.96 standard errors cover
the truth in 96 % of the cases on average over the families and in 91 % of each family but the jump
along the axes: where the box that it bounds is smaller than a stratum, most sets miss it whole, and no
factor helps. The factor of an order is the largest over its grids. Writes
benchmarks/results/error_scale.csv; ``voroquad.leave_one_out.ERROR_SCALE`` is its last column.

    python benchmarks/calibrate_errors.py
"""

import csv
import math
from pathlib import Path

import numpy as np

from voroquad.leave_one_out import default_order, fit_strata
from voroquad.samplers import sample
from voroquad.study.genz import FAMILIES, instances

GRIDS = {
    1: [8, 12, 16, 32, 48, 64, 96, 128, 512],
    2: [16, 36, 49, 64, 100, 256, 380, 506, 1024, 2025],
    3: [27, 36, 64, 100, 125, 216, 343, 512, 1000, 2028],
    4: [81, 108, 256, 500, 1200, 2016],
}
SETS, INSTANCES = 100, 10
RESULTS = Path(__file__).parent / "results" / "error_scale.csv"


def errors_in_bars(d: int, n: int) -> tuple[int, tuple[int, ...], np.ndarray]:
    """|Î − I| over the uncalibrated error bar (families, instances · sets)."""
    samples = sample("multi-jittered", n, d, sets=SETS, rng=n)
    assert samples.strata is not None
    functions = list(instances(d, INSTANCES, rng=[d, n]))
    values = np.stack([f(samples.points.reshape(-1, d).T).reshape(SETS, n) for f in functions], axis=1)
    order = default_order(samples.strata)
    w, residuals = fit_strata(samples, order, threads=2, values=values)
    truth = np.array([f.integral for f in functions])
    scale = np.abs(values).mean(axis=-1)
    errors = np.abs(np.einsum("sn,sfn->sf", w, values) - truth)
    bars = np.hypot(np.sqrt(np.square(residuals).sum(axis=-1)) / n, 4e-16 * scale)
    ratio = np.divide(errors, bars, out=np.full_like(errors, np.inf), where=bars > 0)
    return order, samples.strata, ratio.T.reshape(len(FAMILIES), -1)


def least_factor(q: np.ndarray) -> float:
    for factor in np.arange(0.4, 4.0, 0.01):
        covered = (q <= 1.96 * factor).mean(axis=1)
        seen = np.delete(covered, list(FAMILIES).index("jump"))
        if covered.mean() >= 0.96 and seen.min() >= 0.91:
            return round(float(factor), 2)
    return math.inf


def main() -> None:
    rows = []
    for d, sizes in GRIDS.items():
        for n in sizes:
            order, strata, q = errors_in_bars(d, n)
            covered = (q <= 1.96).mean(axis=1)
            mean = covered.mean().round(3)
            rows.append([d, "x".join(map(str, strata)), order, *covered.round(3), mean, least_factor(q)])
            print(*rows[-1], flush=True)
    largest = {key: max(r[-1] for r in rows if (r[0], r[2]) == key) for key in {(r[0], r[2]) for r in rows}}
    RESULTS.parent.mkdir(exist_ok=True)
    with RESULTS.open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(
            ["d", "strata", "order", *FAMILIES, "mean coverage at factor 1", "factor", "factor of the order"]
        )
        table.writerows([*row, largest[row[0], row[2]]] for row in rows)
    print({key: largest[key] for key in sorted(largest, key=str)})


if __name__ == "__main__":
    main()
