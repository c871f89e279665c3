"""Sums and largest weights of the default rules of vq.quad, over many sets.

For d = 1 to 4 and each default rule, on the smallest grid of at least 100 strata that has it, where weights vary most,
and on one of about 1000: Σ|w| on average and of the worst set, and the largest N |w| of any weight, beside what is
asked of them: Σ|w| ≤ 1.1 on average (theory.md speaks of the mean: a single set may exceed it) and N |w| ≤ 20 for every
weight. As many sets as hold 100 · `sets` samples. Writes benchmarks/results/weight_bounds.csv, line by line.

    VOROQUAD_NUM_THREADS=1 nice -n 19 python benchmarks/weight_bounds.py [--dimensions 1,2] [--sets 100000]
"""

import argparse
import csv
import math
from pathlib import Path

import numpy as np

from voroquad._checks import whole_numbers
from voroquad.leave_one_out import default_order, fit_strata
from voroquad.quadrature import largest_grid
from voroquad.samplers import sample

RESULTS = Path(__file__).parent / "results" / "weight_bounds.csv"
FEWEST, MANY = 100, 1156
POINTS = 2**16  # in memory at a time
HEAD = ["d", "strata", "order", "sets", "sum_mean", "sum_standard_error", "sum_largest", "weight_largest", "beyond_20"]


def grids(d: int) -> list[tuple[int, ...]]:
    """The smallest grid of each default order, and the one of about a thousand strata."""
    shapes = dict.fromkeys(largest_grid(n, d) for n in range(FEWEST, MANY + 1))
    first: dict[int | str, tuple[int, ...]] = {}
    for shape in shapes:
        if math.prod(shape) >= FEWEST:
            first.setdefault(default_order(shape), shape)
    return list(dict.fromkeys([*first.values(), largest_grid(MANY, d)]))


def bounds(strata: tuple[int, ...], sets: int, seed: int) -> list[object]:
    """The line of a grid."""
    n, d = math.prod(strata), len(strata)
    batch = max(1, POINTS // n)
    sums, largest = [], []
    for first in range(0, sets, batch):
        rng = np.random.default_rng([seed, *strata, first])
        samples = sample("multi-jittered", n, d, sets=min(batch, sets - first), rng=rng)
        weights, _ = fit_strata(samples, default_order(strata), threads=1)
        sums.append(np.abs(weights).sum(axis=1))
        largest.append(n * np.abs(weights).max(axis=1))
    s, w = np.concatenate(sums), np.concatenate(largest)
    return [
        d, "×".join(map(str, strata)), default_order(strata), sets,
        f"{s.mean():.4f}", f"{s.std() / math.sqrt(sets):.1g}", f"{s.max():.3f}", f"{w.max():.1f}", int((w > 20).sum()),
    ]  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dimensions", default="1,2,3,4")
    parser.add_argument("--sets", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with RESULTS.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(HEAD)
        for d in whole_numbers("dimensions", options.dimensions):
            for strata in grids(d):
                sets = FEWEST * options.sets // math.prod(strata)
                table.writerow(line := bounds(strata, sets, options.seed))
                file.flush()
                print(*line, flush=True)


if __name__ == "__main__":
    main()
