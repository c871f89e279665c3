"""The plain mean of Sobol' replicates, with an error that knows of values which no net balances."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .._support.arrays import Array
from ..designs.sampling import sample
from ..rules.fit import ROUNDING
from ..rules.steps import of_steps
from .estimates import Estimate, Values, of_values
from .gradients import WeightedCalls
from .integrand import Integrand

#: Fewest replicates; there are up to twice as many.
FEWEST_NETS = 4

#: A value further from the mean than this many standard deviations is one of few, which nets spread no better than
#: independent samples.
FAR = 3.0


@dataclass(frozen=True)
class NetEstimator:
    """Replicates of Sobol' points of the largest size of which at least four fit.

    Notes
    -----
    The squared error is that of the spread of the replicates' means, plus Σ (f − mean)²/n² over the values that are far
    from the mean: rare large values make errors that few replicates seldom show.
    """

    integrand: Integrand
    sets: int
    rng: np.random.Generator

    def __call__(self, n: int) -> Estimate:
        """An estimate from at most n evaluations for each set."""
        whole, fewest = n * self.sets, max(self.sets, FEWEST_NETS)
        size = 1 << max(0, (whole // fewest).bit_length() - 1)
        sets = whole // size
        drawn = sample("sobol", size, self.integrand.d, sets=sets, rng=self.rng)
        begin = len(self.integrand.function.tape)
        values = Values.of(self.integrand, drawn.points)
        means = values.scaled.mean(axis=2)
        mean = means.mean(axis=0)
        spread = means.std(axis=0, ddof=1) / math.sqrt(sets)
        spread = np.maximum(spread, np.sqrt(of_steps(drawn.points, values.scaled)))
        rounding = ROUNDING * self.integrand.epsilon * np.abs(values.scaled).mean(axis=(0, 2))
        error = np.sqrt(spread**2 + _of_far_values(values.scaled, mean) + rounding**2)
        warnings = () if self.integrand.empty else tuple(of_values(values.scaled))
        told = ("plain mean",) * len(mean)
        mean, error, rounding = (np.ldexp(x, values.power) for x in (mean, error, rounding))
        deviations = (means - means.mean(axis=0)).T
        terms = self._terms(begin, drawn.points.reshape(-1, self.integrand.d))
        return Estimate(mean, error, rounding, values.n, sets - 1, warnings, deviations, told, terms=terms)

    def _terms(self, begin: int, u: Array) -> tuple[WeightedCalls, ...]:
        """Equal weights of the values of points (n, d), in the order of their evaluation."""
        order = self.integrand.order(u)
        return self.integrand.weighted_calls(begin, u if order is None else u[order], np.full((1, len(u)), 1 / len(u)))


def _of_far_values(values: Array, mean: Array) -> Array:
    """Σ (f − mean)² / n² over values (sets, fields, m) that are far from the mean (fields,)."""
    away = np.square(values - mean[:, None])
    far = away > FAR**2 * away.mean(axis=(0, 2))[:, None]
    found: Array = np.where(far, away, 0).sum(axis=(0, 2)) / (values.shape[0] * values.shape[2]) ** 2
    return found
