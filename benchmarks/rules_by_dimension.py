"""What weights of independent samples gain over equal ones, from one dimension to eight.

Mean squared error of the plain mean over that of Voronoi cells (counted with probes above three dimensions), of
leave-one-out at orders 0 and 1, and of scrambled Sobol' points with equal weights: geometric means over random members
of a smooth family (oscillatory) and of one with a jump (half-plane), with the standard error of their logarithm.
Writes benchmarks/results/rules_by_dimension.csv, line by line.

    VOROQUAD_NUM_THREADS=1 nice -n 19 python benchmarks/rules_by_dimension.py
"""

import argparse
import csv
from pathlib import Path

import numpy as np

import voroquad as vq
from voroquad.study.genz import FAMILIES

RESULTS = Path(__file__).parent / "results" / "rules_by_dimension.csv"
RULES = {
    "Voronoi cells": ("uniform", 0, "none"),
    "leave-one-out, order 0": ("uniform", 0, "leave-one-out"),
    "leave-one-out, order 1": ("uniform", 1, "leave-one-out"),
    "Sobol', equal weights": ("sobol", None, ""),
}


def gains(d: int, n: int, sets: int, members: int) -> list[list[object]]:
    """The lines of a dimension."""
    rng = np.random.default_rng([d, n])
    lines = []
    for family in ("oscillatory", "half-plane"):
        functions = [FAMILIES[family](d, rng) for _ in range(members)]
        truth = np.array([f.integral for f in functions])[:, None]
        probe = rng.random((d, 100_000))
        plain = np.array([f(probe).var() for f in functions]) / n
        for rule, (design, order, debias) in RULES.items():
            points = vq.sample(design, n, d, sets=sets, rng=rng).points
            w = (
                np.full((sets, n), 1 / n)
                if order is None
                else vq.weights(points, design=design, order=order, debias=debias)
            )
            values = np.stack([f(points.reshape(-1, d).T).reshape(sets, n) for f in functions])
            squares = np.square(np.einsum("sn,fsn->fs", w, values) - truth)
            logs = np.log(plain / squares.mean(axis=1))
            lines.append(
                [d, n, family, rule, f"{np.exp(logs.mean()):.3g}", f"{logs.std(ddof=1) / np.sqrt(members):.2f}"]
            )
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("--sets", type=int, default=20)
    parser.add_argument("--members", type=int, default=10, help="of each family")
    options = parser.parse_args()
    with RESULTS.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["d", "n", "family", "rule", "gain", "log_error"])
        for d in range(1, 9):
            for line in gains(d, options.samples, options.sets, options.members):
                table.writerow(line)
                file.flush()
                print(*line, flush=True)


if __name__ == "__main__":
    main()
