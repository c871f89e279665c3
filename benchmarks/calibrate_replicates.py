"""Calibrate the error bar of ``method="polynomials"``: the factor of the spread of its replicates.

Without a grid the replicates are not independent, since each is corrected by polynomials that are fitted to others.
Beside a grid they are, but for the choice of a degree. The program integrates random members of the eight families with
many seeds. It finds the least factor with which the 95 % interval, by Student's t distribution of the replicates,
contains the integral in 96 % of the cases on average over the families and in 91 % of each. Then it measures how often
the interval holds with the factor in use (:func:`voroquad.integrals.replicates.error_scale`), on other members and with
other seeds. Components that are warned of count as covered. Writes benchmarks/results/replicate_scale.csv, for
docs/measured/error-bars.md, where lines that are not measured stay.

    VOROQUAD_NUM_THREADS=1 python benchmarks/calibrate_replicates.py [--dimensions 4,6]
"""

import argparse
import math
import warnings
from pathlib import Path

import numpy as np
from csv_rows import put

import voroquad as vq
from voroquad._support.checks import whole_numbers
from voroquad.integrals.replicates import Sizes, error_scale
from voroquad.study.genz import FAMILIES, instances

RESULTS = Path(__file__).parent / "results" / "replicate_scale.csv"
HEAD = ["d", "evaluations", "least", "factor", *FAMILIES, "mean"]
#: Evaluations by dimension. There is a grid in four dimensions from 6000 on and in five for 40,000; in eight dimensions
#: 1024 and 4096 are few points for each corner, and so are all in twelve.
EVALUATIONS = {
    4: (1024, 4096, 6000, 16_384, 100_000),
    5: (16_384, 40_000),
    6: (1024, 4096, 16_384),
    8: (1024, 4096, 16_384),
    12: (4096, 16_384),
}


def ratios(d: int, n: int, members: int, sets: int, seed: int) -> np.ndarray:
    """Errors over half the interval at factor 1, (families, members · sets); 0 for components that are warned of."""
    functions = list(instances(d, members, rng=[seed, d, n]))
    truth = np.array([f.integral for f in functions])
    found = np.empty((len(functions), sets))
    for k in range(sets):
        result = vq.quad(
            lambda x: np.stack([f(x) for f in functions]),
            np.zeros(d),
            np.ones(d),
            method="polynomials",
            n_points=n,
            rng=np.random.default_rng([seed, d, n, k]),
            threads=1,
        )
        low, high = result.confidence_interval(0.95)
        with np.errstate(divide="ignore"):
            found[:, k] = np.abs(result.integral - truth) / ((high - low) / 2 / error_scale(Sizes.of(n, d), d))
        for warning in result.warnings:
            found[warning.details["components"], k] = 0.0
    return found.reshape(len(FAMILIES), -1)


def least_factor(errors: np.ndarray) -> float:
    """The least factor that covers enough."""
    for factor in np.arange(0.3, 4.0, 0.01):
        covered = (errors <= factor).mean(axis=1)
        if covered.mean() >= 0.96 and covered.min() >= 0.91:
            return round(float(factor), 2)
    return math.inf


def main() -> None:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dimensions", default=",".join(map(str, EVALUATIONS)))
    parser.add_argument("--members", type=int, default=12, help="of each family")
    parser.add_argument("--sets", type=int, default=50, help="for each number of evaluations")
    parser.add_argument("--seed", type=int, default=17)
    options = parser.parse_args()
    warnings.simplefilter("ignore", vq.IntegrationWarning)
    for d in whole_numbers("dimensions", options.dimensions):
        for n in EVALUATIONS[d]:
            calibrating, others = (ratios(d, n, options.members, options.sets, options.seed + i) for i in range(2))
            factor = error_scale(Sizes.of(n, d), d)
            covered = (others <= factor).mean(axis=1)
            shares = [f"{share:.3f}" for share in (*covered, covered.mean())]
            line = [d, n, least_factor(calibrating), factor, *shares]
            print(*line, flush=True)
            put(RESULTS, HEAD, [line], lambda row: (int(row[0]), int(row[1])))


if __name__ == "__main__":
    main()
