"""Estimates from the leaves of a partition: each has a multi-jittered grid of its own, and the rule of strata in it."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .._support.arrays import Array, Indices
from ..designs.grids import even_sizes
from ..designs.sampling import SampleSet, sample
from ..rules.error_bars import of_corrections
from ..rules.fit import ROUNDING
from ..rules.method import HIGHEST_DIMENSION, local
from ..rules.strata_fits import fit_strata
from .diagnostics import IntegrationWarning
from .estimates import UNRESOLVED, Estimate, surprising_stratum, unresolved
from .integrand import Integrand
from .partition import Partition
from .units import powers

#: Fewest samples of a leaf: of one there is no residual.
FEWEST_IN_LEAF = 2

#: Part of the final samples that leaves get by their volume alone, whatever the pilot saw in them.
EVEN = 0.25


@dataclass(frozen=True)
class LeafSets:
    """Sets of one size, (sets, n, d) within the unit box, and the leaf of each."""

    leaves: Indices
    samples: SampleSet

    def places(self, partition: Partition) -> Array:
        """The points (sets n, d) within their leaves."""
        low, high = partition.low[self.leaves, None], partition.high[self.leaves, None]
        return (low + (high - low) * self.samples.batch).reshape(-1, self.samples.d)


def draw(partition: Partition, n: int, even: float, rng: np.random.Generator) -> list[LeafSets]:
    """Fresh sets of at most n samples in all, leaves of equally many together."""
    d = partition.low.shape[1]
    sizes = counts(partition.shares(even), n, d)
    found = []
    for size in np.unique(sizes):
        (leaves,) = np.nonzero(sizes == size)
        found.append(LeafSets(leaves, sample("multi-jittered", int(size), d, sets=len(leaves), rng=rng)))
    return found


def counts(shares: Array, n: int, d: int) -> Indices:
    """Samples of each leaf, sizes of near-cubic grids in proportion to the shares; their sum is at most n.

    Sizes are rounded down from a multiple of the shares, the largest whose sum fits.
    """
    sizes = _sizes(n, d)
    low, high = 0.0, 4.0 * n

    def rounded(factor: float) -> Indices:
        return sizes[np.searchsorted(sizes, np.maximum(factor * shares, FEWEST_IN_LEAF), side="right") - 1]

    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if rounded(middle).sum() <= n else (low, middle)
    return rounded(low)


@functools.lru_cache(maxsize=64)
def _sizes(n: int, d: int) -> Indices:
    return even_sizes(n, d)


@dataclass(frozen=True)
class LeafEstimator:
    r"""Σ_ℓ V_ℓ Î_ℓ with Î_ℓ by leave-one-out in leaf ℓ, and the error (Σ_ℓ V_ℓ² e_ℓ²)^½.

    Attributes
    ----------
    integrand : Integrand
        On the box that is partitioned.
    partition : Partition
        Chosen without the samples of this estimate, which is unbiased therefore.
    rng : numpy.random.Generator
        Of the samples.
    threads : int
        Of the rule; the result does not depend on it.
    """

    integrand: Integrand
    partition: Partition
    rng: np.random.Generator
    threads: int

    def __call__(self, n: int) -> Estimate:
        """An estimate from at most n samples."""
        groups = draw(self.partition, n, EVEN, self.rng)
        places = np.concatenate([group.places(self.partition) for group in groups])
        begin = len(self.integrand.function.tape)
        values = self.integrand(places)
        power = powers(values, axis=1)
        values = np.ldexp(values, -power)
        cuts = np.cumsum([group.samples.n * len(group.leaves) for group in groups])[:-1]
        parts = [self._part(*one) for one in zip(groups, np.split(values, cuts, axis=1), strict=True)]
        weights, corrections, weighted = (np.concatenate(x, axis=1) for x in zip(*parts, strict=True))
        found = self._estimate(places, weights * values, corrections, weighted, power[:, 0])
        return replace(found, terms=self.integrand.weighted_calls(begin, places, weights))

    def _part(self, group: LeafSets, values: Array) -> tuple[Array, Array, Array]:
        """Weights (1, samples), corrections and values times volumes, (fields, samples), of the leaves of a group."""
        sets, size = len(group.leaves), group.samples.n
        by_set = np.ascontiguousarray(values.reshape(-1, sets, size).swapaxes(0, 1))
        order = 1 if group.samples.d <= HIGHEST_DIMENSION else 0
        fit = fit_strata(group.samples, local(order), self.threads, by_set)
        volumes = self.partition.volumes[group.leaves, None, None]
        found = (volumes * fit.weights[:, None], volumes / size * fit.residuals, volumes / size * by_set)
        weights, of_corrections_, of_values = (x.swapaxes(0, 1).reshape(x.shape[1], -1) for x in found)
        return weights, of_corrections_, of_values

    def _estimate(
        self, places: Array, terms: Array, corrections: Array, weighted: Array, power: NDArray[np.intc]
    ) -> Estimate:
        n = len(places)
        bar = of_corrections(n * corrections)
        rounding = ROUNDING * self.integrand.epsilon * np.abs(terms).sum(axis=1)
        mean, error, rounding = (
            np.ldexp(x, power) for x in (terms.sum(axis=1), np.hypot(bar.error, rounding), rounding)
        )
        warnings = [] if self.integrand.empty else self._warnings(places, weighted, corrections)
        freedom = float(bar.degrees_of_freedom.min(initial=math.inf))
        return Estimate(mean, error, rounding, n, freedom, tuple(warnings), corrections, ("leaves",) * len(mean))

    def _warnings(self, places: Array, weighted: Array, corrections: Array) -> list[IntegrationWarning]:
        sizes = np.abs(weighted)
        squares = np.square(sizes).sum(axis=1)
        tails = [[of_field] for of_field in weighted]
        found = unresolved(sizes.sum(axis=1), squares, squares == 0, len(places), tails)
        unit = np.maximum(sizes.max(axis=1, keepdims=True), np.finfo(float).tiny)
        lone = surprising_stratum(self.integrand, places, weighted / unit, corrections / unit)
        return found if lone is None or any(w.kind in UNRESOLVED for w in found) else [*found, lone]
