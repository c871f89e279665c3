"""Every rule on single sets, a smooth integrand and one with jumps: benchmarks/results/rules.csv.

    python benchmarks/rules.py

Methods of one design see the same sets. `gain` is the mean squared error of independent samples with equal weights
over the rule's; `abs_sum` the mean of Σ|w|, by how much a rule can multiply what it does not understand.
docs/rules.md has its tables from here (scripts/publish_tables.py).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from voroquad.designs.sampling import sample
from voroquad.study.convergence import Measurement, Scheme, measure
from voroquad.study.drawing import write_rows
from voroquad.study.functions import INTEGRANDS

RESULT = Path(__file__).parent / "results" / "rules.csv"
SIZES = (64, 1024)
REPLICATES = 1000
INTEGRANDS_OF = {1: ("smooth", "jump"), 2: ("smooth-2d", "jump-2d")}

METHODS = {
    1: (
        Scheme("equal weights", "uniform"),
        Scheme("Voronoi cells", "uniform", "none"),
        Scheme("Voronoi cells / G", "uniform", "bias-function"),
        Scheme("exchange", "uniform", "exchange"),
        Scheme("equal weights", "stratified"),
        Scheme("Voronoi cells", "stratified", "none"),
        Scheme("exchange", "stratified", "exchange"),
        Scheme("leave-one-out, order 2", "stratified", "leave-one-out", 2),
        Scheme("leave-one-out, order 6", "stratified", "leave-one-out", 6),
        Scheme("equal weights", "sobol"),
        Scheme("Voronoi cells", "sobol", "none"),
    ),
    2: (
        Scheme("equal weights", "uniform"),
        Scheme("Voronoi cells", "uniform", "none"),
        Scheme("Voronoi cells / G", "uniform", "bias-function"),
        Scheme("leave-one-out, order 0", "uniform", "leave-one-out"),
        Scheme("equal weights", "stratified"),
        Scheme("Voronoi cells", "stratified", "none"),
        Scheme("leave-one-out, order 0", "stratified", "leave-one-out"),
        Scheme("leave-one-out, order 1", "stratified", "leave-one-out", 1),
        Scheme("leave-one-out, order 3", "stratified", "leave-one-out", 3),
        Scheme("equal weights", "multi-jittered"),
        Scheme("leave-one-out, order 3", "multi-jittered", "leave-one-out", 3),
        Scheme("equal weights", "sobol"),
        Scheme("Voronoi cells", "sobol", "none"),
    ),
}


def main() -> None:
    """Measure, and write the table."""
    rows = []
    for d, methods in METHODS.items():
        integrands = [INTEGRANDS[name] for name in INTEGRANDS_OF[d]]
        measured = measure(methods, integrands, SIZES, replicates=REPLICATES, seed=1, advance=report)
        spread = {(m, n): absolute_sum(m, n, d) for m in methods for n in SIZES}
        plain = {(m.integrand, m.n): m.mse for m in measured if m.method == methods[0]}
        rows += [row(d, m, plain[m.integrand, m.n] / m.mse, spread[m.method, m.n]) for m in measured]
    write_rows(RESULT, rows)


def absolute_sum(method: Scheme, n: int, d: int) -> float:
    """Mean of Σ|w| over 100 sets."""
    return float(np.abs(method.weights(sample(method.design, n, d, sets=100, rng=2))).sum(axis=-1).mean())


def row(d: int, m: Measurement, gain: float, spread: float) -> dict[str, object]:
    """A line of the table."""
    return {
        "d": d,
        "integrand": m.integrand,
        "design": m.method.design,
        "weights": m.method.name,
        "n": m.n,
        "sets": m.replicates,
        "mse": f"{m.mse:.4g}",
        "mse_standard_error": f"{m.mse_error:.2g}",
        "gain": f"{gain:.4g}",
        "bias_z": f"{m.bias / m.bias_error:.2f}",
        "abs_sum": f"{spread:.3f}",
    }


def report(done: str, _steps: int) -> None:
    """Say what was done."""
    print(done, flush=True)


if __name__ == "__main__":
    main()
