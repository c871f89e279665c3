"""Calibrate the error bar of one estimate: what (Σ (|S_i| r_i)²)^½ must be multiplied by.

Above four dimensions, where an estimate is four replicates: what the standard error of their mean must be multiplied
by before Student's t of three degrees of freedom takes it. For the fixed rules of :func:`voroquad.quad` and several
sizes, draw many sets, integrate random members of the eight families, and find the least factor with which ±1.96
standard errors cover the truth in 96 % of the cases on average over the families and in 91 % of each family but the
jump along the axes: where the box that it bounds is smaller than a stratum, most sets miss it whole, and no factor
helps. Writes benchmarks/results/error_scale.csv; lines of dimensions that are not measured stay.

    VOROQUAD_NUM_THREADS=1 python benchmarks/calibrate_errors.py [--dimensions 1,2]
"""

import argparse
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from csv_rows import put
from scipy import stats

from voroquad._support.checks import whole_numbers
from voroquad.designs.sampling import SampleSet, sample
from voroquad.integrals.estimates import REPLICATES
from voroquad.rules.cross_fit import replicate_shares
from voroquad.rules.defaults import default_of_strata
from voroquad.rules.fit import weighted_sums
from voroquad.rules.method import KRIGING, Method
from voroquad.rules.strata_fits import fit_strata
from voroquad.study.genz import FAMILIES, instances

GRIDS = {
    1: [4, 6, 8, 12, 16, 32, 48, 64, 96, 128, 512, 2048],
    2: [9, 16, 25, 36, 64, 132, 256, 506, 1024, 2025, 4096],
    3: [8, 27, 64, 125, 252, 512, 1000, 2028, 4096],
    4: [16, 81, 128, 256, 512, 1024, 2016],
    6: [128, 512, 2048],
}
RESULTS = Path(__file__).parent / "results" / "error_scale.csv"
HEAD = ["d", "strata", "order", *FAMILIES, "mean coverage at factor 1", "factor"]


@dataclass(frozen=True)
class Errors:
    """Of all sets and functions, by family: (families, members · sets)."""

    actual: np.ndarray
    corrections: np.ndarray  # (Σ (|S_i| r_i)²)^½, or what stands for it
    rounding: np.ndarray

    def covered(self, factor: float) -> np.ndarray:
        """The share of each family within ±1.96 standard errors."""
        return (self.actual <= 1.96 * np.hypot(factor * self.corrections, self.rounding)).mean(axis=1)


def measure(samples: SampleSet, method: Method, members: int) -> Errors:
    sets, n, d = samples.points.shape
    functions = list(instances(d, members, rng=[d, n]))
    values = np.stack([f(samples.points.reshape(-1, d).T).reshape(sets, n) for f in functions], axis=1)
    fit = fit_strata(samples, method, threads=1, values=values)
    w, residuals = fit.weights, fit.residuals
    truth = np.array([f.integral for f in functions])
    estimates, rounding = weighted_sums(w[:, None], values)
    by_set = (np.abs(estimates - truth), np.sqrt(np.square(residuals).sum(axis=-1)) / n, rounding)
    return Errors(*(x.T.reshape(len(FAMILIES), -1) for x in by_set))


def measure_replicates(n: int, d: int, sets: int, members: int) -> Errors:
    """Of scrambled Sobol' points, n in all; Student's t over 1.96 makes up for the few replicates."""
    functions = list(instances(d, members, rng=[d, n]))
    truth = np.array([f.integral for f in functions])
    quantile = stats.t.ppf(0.975, REPLICATES - 1) / stats.norm.ppf(0.975)
    by_set: list[tuple[np.ndarray, ...]] = []
    for seed in range(sets):
        points = sample("sobol", n // REPLICATES, d, sets=REPLICATES, rng=[n, seed]).points
        values = np.stack([f(points.reshape(-1, d).T).reshape(points.shape[:2]) for f in functions], axis=1)
        means = np.einsum("rsn,sfn->rf", replicate_shares(points, KRIGING, threads=1), values)
        error = means.std(axis=0, ddof=1) / math.sqrt(REPLICATES)
        by_set.append((np.abs(means.mean(axis=0) - truth), quantile * error, np.zeros_like(error)))
    return Errors(*(np.array(x).T.reshape(len(FAMILIES), -1) for x in zip(*by_set, strict=True)))


def least_factor(errors: Errors) -> float:
    for factor in np.arange(0.3, 4.0, 0.01):
        covered = errors.covered(factor)
        seen = np.delete(covered, list(FAMILIES).index("jump"))
        if covered.mean() >= 0.96 and seen.min() >= 0.91:
            return round(float(factor), 2)
    return math.inf


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dimensions", default=",".join(map(str, GRIDS)))
    parser.add_argument("--members", type=int, default=12, help="of each family")
    parser.add_argument("--sets", type=int, default=60, help="of each grid")
    options = parser.parse_args()
    for d in whole_numbers("dimensions", options.dimensions):
        lines = []
        for n in GRIDS[d]:
            if d > 4:
                strata, order = f"{REPLICATES} sets of {n // REPLICATES}", "kriging"
                errors = measure_replicates(n, d, options.sets, options.members)
            else:
                samples = sample("multi-jittered", n, d, sets=options.sets, rng=n)
                assert samples.strata is not None
                strata, method = "x".join(map(str, samples.strata)), default_of_strata(samples.strata)
                order = method.order
                errors = measure(samples, method, options.members)
            covered = errors.covered(1.0)
            lines.append([d, strata, order, *covered.round(3), covered.mean().round(3), least_factor(errors)])
            print(*lines[-1], flush=True)
        put(RESULTS, HEAD, lines, lambda row: int(row[0]))


if __name__ == "__main__":
    main()
