"""Many samples in many dimensions: Sobol' replicates, each corrected by polynomials fitted to the others."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._support.arrays import Array, Indices
from ..rules.fit import ROUNDING
from ..rules.nested_fits import NormalEquations, fits, predicted, terms_of
from .estimates import Estimate, unresolved
from .integrand import Integrand
from .spread import across
from .units import deviation

REPLICATES = 8

#: Highest dimension. Above it there are too few terms for a choice of their number.
HIGHEST_DIMENSION = 20

#: Fewest evaluations: eight for each replicate.
FEWEST = 64

#: Largest number of terms of a family, divided by the cube root of the evaluations. With it, fits cost about as much as
#: evaluating the terms.
TERMS, MOST_TERMS = 14, 715

#: Samples per term of a fit: at most this many are used, and a candidate needs at least half as many.
MOST_PER_TERM, FEWEST_PER_TERM = 20, 10

#: Factor of the standard error of the mean of replicates, since they are not independent: each is corrected by
#: polynomials that are fitted to the others. benchmarks/calibrate_replicates.py measures the least that suffices.
ERROR_SCALE = 1.3

#: Number of parts of a net by which a candidate is judged, of a smaller net its points; and the part of the plain
#: mean's squared error that it may leave to be chosen.
PARTS, WORTH = 32, 0.1

#: Points of a call of the integrand.
POINTS_AT_ONCE = 1 << 15


@dataclass(frozen=True)
class ReplicateEstimator:
    r"""Scrambled Sobol' replicates with cross-fitted polynomials.

    With P_r fitted to the other replicates the estimate of replicate r is ∫ P_r + mean(f − P_r). P_r is the candidate
    with the least squared residuals on replicate r + 1, among fits without both replicates. So P_r does not depend on
    replicate r, whose points are uniform, and each estimate is unbiased.
    """

    integrand: Integrand
    sets: int
    rng: np.random.Generator

    def __call__(self, n: int) -> Estimate:
        """An estimate from at most n evaluations for each of the sets."""
        found: list[Estimate] = []
        for _ in range(self.sets):
            replicates = _Replicates(self.integrand, 1 << int(math.log2(max(n // REPLICATES, 1))))
            self.integrand.watch.follow((lambda: across(found)) if found else replicates.known)
            found.append(replicates.estimate(self.rng))
        return across(found)


class _Replicates:
    """Replicates of m points each; values are in units of 2^power, so that no square over- or underflows."""

    def __init__(self, integrand: Integrand, m: int):
        self.integrand, self.m = integrand, m
        d, n = integrand.d, REPLICATES * m
        self.terms = terms_of(
            d, max(1, min(int(TERMS * n ** (1 / 3)), MOST_TERMS, (REPLICATES - 2) * m // FEWEST_PER_TERM))
        )
        wanted = MOST_PER_TERM * len(self.terms) / (REPLICATES - 2)
        #: Points of a replicate that take part in fits, a power of two
        self.fitted = min(m, 1 << max(6, math.ceil(math.log2(wanted))))
        self._plain: list[Array] = []  # means (fields,) of the points of a replicate that take part in fits
        self._corrected: list[Array] = []  # estimates (fields,) of the replicates that are done

    def estimate(self, rng: np.random.Generator) -> Estimate:
        """Draws, fits, and corrects."""
        from scipy.stats import qmc

        d = self.integrand.d
        engines = [qmc.Sobol(d, scramble=True, bits=53, rng=r) for r in rng.spawn(REPLICATES)]
        points = [engine.random(self.fitted) for engine in engines]
        values = []
        for x in points:
            values.append(self._values(x))
            self._plain.append(values[-1].mean(axis=1))
        _, power = np.frexp(np.max([_largest(y) for y in values], axis=0))
        values = [np.ldexp(y, -power[:, None]) for y in values]
        moments = [NormalEquations.of(self.terms, x, y) for x, y in zip(points, values, strict=True)]
        sums = []
        for r, engine in enumerate(engines):
            c = self._coefficients(moments, points, values, r)
            of_replicate = self._sums(c, points[r], values[r])
            for done in range(self.fitted, self.m, POINTS_AT_ONCE):
                x = engine.random(min(POINTS_AT_ONCE, self.m - done))
                of_replicate += self._sums(c, x, np.ldexp(self._values(x), -power[:, None]))
            sums.append(np.stack([c[0], *(of_replicate / self.m)]))
            self._corrected.append(np.ldexp(c[0] + of_replicate[0] / self.m, power))
        return self._estimate(np.stack(sums), power)

    def known(self) -> Estimate | None:
        """The mean of the replicates that are done, or of the points that take part in fits; None of fewer than two."""
        means, each = (self._corrected, self.m) if len(self._corrected) > 1 else (self._plain, self.fitted)
        if len(means) < 2:
            return None
        error = ERROR_SCALE * deviation(np.stack(means), axis=0) / math.sqrt(len(means))
        return Estimate(np.mean(means, axis=0), error, np.zeros_like(error), each * len(means), len(means) - 1)

    def _values(self, x: Array) -> Array:
        return self.integrand(np.asfortranarray(x))

    def _coefficients(self, moments: list[NormalEquations], points: list[Array], values: list[Array], r: int) -> Array:
        """Coefficients (terms, fields) of the polynomials that replicate r corrects: for each component the candidate
        that is best on the next replicate."""
        q = (r + 1) % REPLICATES
        whole = sum(moments[1:], moments[0])
        judged = predicted(self.terms, fits(whole - moments[r] - moments[q], self.terms), points[q])
        best = _best(judged - values[q])
        return fits(whole - moments[r], self.terms)[best, :, np.arange(len(best))].T

    def _sums(self, coefficients: Array, x: Array, y: Array) -> Array:
        """Σ (f − P), Σ |f|, Σ f² and Σ |P| of each component, (4, fields), over points (n, d)."""
        p = predicted(self.terms, coefficients, x)
        return np.stack([part.sum(axis=-1) for part in (y - p, np.abs(y), np.square(y), np.abs(p))])

    def _estimate(self, sums: Array, power: NDArray[np.intc]) -> Estimate:
        """From ∫ P and the means of f − P, |f|, f² and |P| in each replicate, (replicates, 5, fields)."""
        n = REPLICATES * self.m
        means = sums[:, 0] + sums[:, 1]
        mean, (_, _, absolute, square, predicted_size) = means.mean(axis=0), sums.mean(axis=0)
        rounding = ROUNDING * self.integrand.epsilon * (absolute + predicted_size)
        spread = ERROR_SCALE * means.std(axis=0, ddof=1) / math.sqrt(REPLICATES)
        empty = self.integrand.empty
        warnings = [] if empty else unresolved(n * absolute, n * square, square == 0, n)
        mean, error, rounding = (np.ldexp(v, power) for v in (mean, np.hypot(spread, rounding), rounding))
        deviations = (means - means.mean(axis=0)).T
        return Estimate(mean, error, rounding, n, REPLICATES - 1, tuple(warnings), deviations)


def _best(residuals: Array) -> Indices:
    """The candidate (fields,) whose residuals (candidates, fields, n) on a net have the smallest sums over its parts.

    Consecutive points are nets, too. The criterion is not the size of the residuals but their error in the mean over a
    net. There the plain mean, the first candidate, is hard to beat, and another candidate is chosen only if its squared
    error is a tenth of that or less.
    """
    parts = residuals.reshape(*residuals.shape[:-1], min(PARTS, residuals.shape[-1]), -1).mean(axis=-1)
    scores = parts.var(axis=-1)
    best = np.argmin(scores, axis=0)
    least = np.take_along_axis(scores, best[None], axis=0)[0]
    return np.where(least < WORTH * scores[0], best, 0)


def _largest(values: Array) -> Array:
    return np.abs(values).max(axis=1, initial=0, where=np.isfinite(values))
