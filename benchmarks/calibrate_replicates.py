"""Calibrate the error bar of ``method="polynomials"``: the factor of the spread of its replicates.

Without a grid the replicates are not independent, since each is corrected by polynomials that are fitted to others.
Beside a grid they are, but for the choice of a degree. There are three factors
(:func:`voroquad.integrals.replicates.error_scale`): that of a grid, for which the line of d = 4 and 16384 evaluations
decides; that of few points per corner, for which those of d = 8 with 1024 and 4096 and d = 6 with 1024 decide; and
that of all other lines. The program integrates random members of the eight families with many seeds. It finds the
least factor with which the 95 % interval, by Student's t distribution of the replicates, contains the integral in 96
% of the cases on average over the families and in 91 % of each; calls that warn count as covered. Writes
benchmarks/results/replicate_scale.csv, where lines of dimensions that are not measured stay.

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
HEAD = ["d", "evaluations", *FAMILIES, "mean coverage at factor 1", "factor"]
SIZES = (1024, 4096, 16_384)


def ratios(d: int, n: int, members: int, sets: int) -> np.ndarray:
    """Errors over half the interval at factor 1, (families, members · sets)."""
    found = []
    for f in instances(d, members, rng=[d, n]):
        for seed in range(sets):
            r = vq.quad(f, np.zeros(d), np.ones(d), method="polynomials", n_points=n, rng=seed, threads=1)
            if not r.success:  # rests on too few samples, and says so
                found.append(0.0)
                continue
            low, high = r.confidence_interval(0.95)
            scale = error_scale(Sizes.of(n, d), d)
            found.append(abs(r.integral - f.integral) / ((high - low) / 2 / scale))
    return np.array(found).reshape(len(FAMILIES), -1)


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
    parser.add_argument("--dimensions", default="4,6,8")
    parser.add_argument("--members", type=int, default=6, help="of each family")
    parser.add_argument("--sets", type=int, default=50, help="of each member")
    options = parser.parse_args()
    warnings.simplefilter("ignore", vq.IntegrationWarning)
    for d in whole_numbers("dimensions", options.dimensions):
        lines = []
        for n in SIZES:
            errors = ratios(d, n, options.members, options.sets)
            covered = (errors <= 1).mean(axis=1)
            lines.append([d, n, *covered.round(3), covered.mean().round(3), least_factor(errors)])
            print(*lines[-1], flush=True)
        put(RESULTS, HEAD, lines, lambda row: int(row[0]))


if __name__ == "__main__":
    main()
