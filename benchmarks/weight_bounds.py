"""Sums and largest weights of the default rules of vq.quad, over many sets.

For d = 1 to 4 and each default rule (an order; kriging with a drift of some degree), on the smallest grid of at least
100 strata that has it, where weights vary most, and on one of about 1000: Σ|w| on average and of the worst set, and the
largest N |w| of any weight. What is asked of multi-jittered sets is Σ|w| ≤ 1.1, and of every weight N |w| ≤ 20. Grids
of up to 256 strata get `sets` sets, larger ones fewer, sets · (256 / N)³. vq.quad has no other grids; vq.weights takes
ones up to twice as long as wide as well, and stratified sets: both are measured on the smallest grids of each kind,
with a fifth of the sets. Writes benchmarks/results/weight_bounds.csv; lines of grids that are not measured stay.

    VOROQUAD_NUM_THREADS=1 python benchmarks/weight_bounds.py [--dimensions 1,2] [--only 10×12] [--sets 100000]
"""

import argparse
import contextlib
import math
from pathlib import Path

import numpy as np
from csv_rows import put

from voroquad._support.checks import whole_numbers
from voroquad.designs.grids import grid_shape, largest_grid
from voroquad.designs.sampling import sample
from voroquad.rules.defaults import default_of_strata
from voroquad.rules.kriging import model
from voroquad.rules.method import KRIGING
from voroquad.rules.strata_fits import fit_strata

RESULTS = Path(__file__).parent / "results" / "weight_bounds.csv"
FEWEST, ALL_SETS, MANY = 100, 256, 1156
POINTS = 2**16  # in memory at a time
LONG = 1.75  # the longest axis over the shortest
HEAD = ["d", "design", "strata", "order", "drift", "sets", "sum_mean", "sum_standard_error", "sum_largest",
        "sets_beyond_1.1", "weight_largest", "sets_beyond_20"]  # fmt: skip


def drift(strata: tuple[int, ...]) -> int | str:
    """Its degree, where the default rule is kriging."""
    return model(math.prod(strata), len(strata)).degree if default_of_strata(strata) == KRIGING else ""


def grids(d: int) -> list[tuple[int, ...]]:
    """The smallest grid of each default rule, and the one of about a thousand strata."""
    shapes = dict.fromkeys(largest_grid(n, d) for n in range(FEWEST, MANY + 1))
    first: dict[object, tuple[int, ...]] = {}
    for shape in shapes:
        if math.prod(shape) >= FEWEST:
            first.setdefault((default_of_strata(shape), drift(shape)), shape)
    return list(dict.fromkeys([*first.values(), largest_grid(MANY, d)]))


def others(d: int) -> list[tuple[str, tuple[int, ...]]]:
    """Designs and grids that vq.weights takes beside: of each default rule the smallest square and long one."""
    first: dict[object, tuple[str, tuple[int, ...]]] = {}
    for n in range(FEWEST, ALL_SETS + 1):
        with contextlib.suppress(ValueError):  # no near-cubic grid
            shape = grid_shape(n, d)
            is_long = shape[-1] >= LONG * shape[0]
            for design in ("stratified", "multi-jittered"):
                if (design == "stratified" or is_long) and (is_long or shape[-1] <= shape[0] + 2):
                    first.setdefault((design, is_long, default_of_strata(shape), drift(shape)), (design, shape))
    return list(first.values())


def named(grid: tuple[int, ...]) -> str:
    return "×".join(map(str, grid))


def bounds(design: str, strata: tuple[int, ...], sets: int, seed: int) -> list[object]:
    """The line of a grid."""
    n, d = math.prod(strata), len(strata)
    batch = max(1, POINTS // n)
    sums, largest = [], []
    for first in range(0, sets, batch):
        rng = np.random.default_rng([seed, *strata, first])
        samples = sample(design, n, d, sets=min(batch, sets - first), rng=rng)
        weights = fit_strata(samples, default_of_strata(strata), threads=1).weights
        sums.append(np.abs(weights).sum(axis=1))
        largest.append(n * np.abs(weights).max(axis=1))
    s, w = np.concatenate(sums), np.concatenate(largest)
    return [
        d, design, named(strata), default_of_strata(strata).order, drift(strata), sets,
        f"{s.mean():.4f}", f"{s.std() / math.sqrt(sets):.1g}", f"{s.max():.3f}", int((s > 1.1).sum()),
        f"{w.max():.1f}", int((w > 20).sum()),
    ]  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dimensions", default="1,2,3,4")
    parser.add_argument("--sets", type=int, default=100_000)
    parser.add_argument("--only", default="", help="a grid, as 10×12")
    parser.add_argument("--other", action="store_true", help="only what vq.weights takes beside vq.quad's own")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    for d in whole_numbers("dimensions", options.dimensions):
        main_grids = [("multi-jittered", strata, options.sets) for strata in grids(d)]
        other_grids = [(design, strata, options.sets // 5) for design, strata in others(d)] if d in (2, 3) else []
        for design, strata, sets in other_grids if options.other else main_grids + other_grids:
            if options.only in ("", named(strata)):
                n = math.prod(strata)
                number = sets if n <= ALL_SETS else round(sets * (ALL_SETS / n) ** 3)
                line = bounds(design, strata, number, options.seed)
                print(*line, flush=True)
                put(RESULTS, HEAD, [line], lambda row: (int(row[0]), row[1], *map(int, row[2].split("×"))))


if __name__ == "__main__":
    main()
