"""How often the 95 % interval of vq.quad from one set, all defaults, holds the integral.

Random members of the eight families, many sets each, for several dimensions and numbers of evaluations: the share of
intervals that hold the integral, by family and on average. Members and sets are others than those that
calibrate_errors.py fitted the error bar to. Writes benchmarks/results/coverage.csv; lines that
are not measured stay.

    python benchmarks/coverage.py [--dimensions 1,2] [--sets 200]
"""

import argparse
import warnings
from pathlib import Path

import numpy as np
from csv_rows import put

import voroquad as vq
from voroquad._support.checks import whole_numbers
from voroquad.study.genz import FAMILIES, instances

RESULTS = Path(__file__).parent / "results" / "coverage.csv"
HEAD = ["d", "n", "evaluations", *FAMILIES, "mean", "least"]
EVALUATIONS = {
    1: (8, 16, 32, 64, 128, 512, 2048),
    2: (16, 32, 64, 128, 256, 512, 1024, 2048),
    3: (32, 64, 128, 256, 512, 1024, 2048),
    4: (128, 256, 512, 1024, 2048),
    6: (128, 512, 2048),
}


def coverage(d: int, n: int, members: int, sets: int, seed: int) -> tuple[int, np.ndarray]:
    """Evaluations used, and shares (families,) of intervals that hold the integral."""
    functions = list(instances(d, members, rng=[seed, d, n]))
    truth = np.array([f.integral for f in functions])
    held = np.zeros(len(functions))
    for k in range(sets):
        result = vq.quad(
            lambda x: np.stack([f(x) for f in functions]),
            np.zeros(d),
            np.ones(d),
            n_points=n,
            rng=np.random.default_rng([seed, d, n, k]),
        )
        low, high = result.confidence_interval(0.95)
        held += (low <= truth) & (truth <= high)
    return result.n_evaluations, (held / sets).reshape(len(FAMILIES), members).mean(axis=1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dimensions", default=",".join(map(str, EVALUATIONS)))
    parser.add_argument("--members", type=int, default=20, help="of each family")
    parser.add_argument("--sets", type=int, default=100, help="for each number of evaluations")
    parser.add_argument("--seed", type=int, default=2026)
    options = parser.parse_args()
    warnings.filterwarnings("ignore", category=vq.IntegrationWarning)

    for d in whole_numbers("dimensions", options.dimensions):
        for n in EVALUATIONS[d]:
            used, shares = coverage(d, n, options.members, options.sets, options.seed)
            line = [d, n, used, *(f"{s:.3f}" for s in (*shares, shares.mean(), shares.min()))]
            print(*line, flush=True)
            put(RESULTS, HEAD, [line], lambda row: (int(row[0]), int(row[1])))


if __name__ == "__main__":
    main()
