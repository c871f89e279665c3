"""Adaptation to peaks: a map that spreads samples where the integrand is large, learned from pilot rounds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from .._support.arrays import Array
from .._support.checks import one_of
from ..designs.sampling import sample
from .estimates import Estimate
from .integrand import Integrand
from .pieces import Part
from .regions import Region, within

#: Intervals of the map along an axis; between their ends it is a monotone cubic, since kinks cost smooth peaks digits.
INTERVALS = 24

#: Rounds of the pilot, and the part of all evaluations that each takes. What is left is the final round's.
ROUNDS, ROUND_PART = 5, 0.06

#: Exponent that damps the changes of a round, and the least part of the mass that an interval is taken to have.
DAMPING, LEAST = 0.8, 1e-12

#: With "auto" the map is learned if the first round rests on a smaller part of its samples than this.
CONCENTRATED = 0.1


@dataclass(frozen=True)
class Adaptation:
    r"""What the pilot of an adaptive integral found.

    Attributes
    ----------
    adapted : bool
        Whether a map was learned.
    nodes : ndarray, (d, 25)
        Along each axis of the unit box the ends of intervals that have equally many samples. Of a box with finite
        limits x = a + (b − a) nodes.
    concentration : float
        Part of the samples of the first round that the integral rests on, (Σ\|f\|)² / (n Σ f²), the least of all
        components.
    n_pilot : int
        Evaluations of the pilot.
    """

    adapted: bool
    nodes: Array
    concentration: float
    n_pilot: int


class SeparableMap:
    """A map of the unit box onto itself, axis by axis, u_a = S_a(v_a).

    Parameters
    ----------
    nodes : ndarray, (d, k + 1)
        S_a(j/k), from 0 to 1, ascending.
    """

    def __init__(self, nodes: Array):
        self.nodes = nodes
        grid = np.linspace(0, 1, nodes.shape[1])
        self._axes = [PchipInterpolator(grid, axis) for axis in nodes]
        self._slopes = [axis.derivative() for axis in self._axes]

    @classmethod
    def identity(cls, d: int) -> SeparableMap:
        """The map that changes nothing."""
        return cls(np.tile(np.linspace(0, 1, INTERVALS + 1), (d, 1)))

    def __call__(self, v: Array) -> tuple[Array, Array]:
        """Points u (d, n) and the volume element (n,) at v (d, n)."""
        u = np.stack([s(x) for s, x in zip(self._axes, v, strict=True)])
        return u, np.prod([s(x) for s, x in zip(self._slopes, v, strict=True)], axis=0)

    def inverse(self, u: Array) -> Array:
        """v (d, n) of points u (d, n), by bisection within the interval of each."""
        low, high = np.zeros_like(u), np.ones_like(u)
        for _ in range(48):
            middle = (low + high) / 2
            below = np.stack([s(x) for s, x in zip(self._axes, middle, strict=True)]) < u
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        return (low + high) / 2


class MappedRegion:
    """A region behind a map of its unit box."""

    def __init__(self, region: Region, warp: SeparableMap):
        self.region, self.warp = region, warp

    @property
    def d(self) -> int:
        """Dimension of the unit box."""
        return self.region.d

    @property
    def empty(self) -> bool:
        """Whether the integral is 0 whatever f is."""
        return self.region.empty

    def pull_back(self, v: Array) -> tuple[Array, Array]:
        """Points x (k, n) and the volume element (n,) at v (d, n)."""
        u, inner = self.warp(within(v))
        x, outer = self.region.pull_back(u)
        return x, inner * outer


@dataclass
class PilotSamples:
    """The samples of all pilot rounds: positions u (d, n), values (fields, n), and the maps that drew them."""

    u: Array
    values: Array
    rounds: list[tuple[SeparableMap, int]] = field(default_factory=list)

    def weights(self) -> Array:
        """1 / Σ_t n_t p_t(u), (n,): the samples of all rounds as one from the mixture of their densities p_t."""
        density = np.zeros(self.u.shape[1])
        for warp, n in self.rounds:
            density += n / warp(warp.inverse(self.u))[1]
        return 1 / density


@dataclass(frozen=True)
class AdaptiveEstimator:
    """Learns a map from pilot rounds and estimates with fresh samples, so that the estimate stays unbiased.

    Given the pilot, the map is fixed, and the final round is the rule of `quad` for the integrand behind it. Samples of
    the pilot take no part: a mean of all rounds, weighted by the inverse of the variances that they show, is biased.

    Attributes
    ----------
    integrand : callable
        Makes the integrand of a region.
    estimator : callable
        Takes a region and returns what estimates from at most so many samples of each set.
    region : Region
        What to integrate over.
    sets : int
        Sets of the final round.
    always : bool
        Whether to adapt whatever the first round shows.
    rng : numpy.random.Generator
        Of the pilot.
    report : callable
        Gets the :class:`Adaptation`.
    """

    integrand: Callable[[Region], Integrand]
    estimator: Callable[[Region], Callable[[int], Estimate]]
    region: Region
    sets: int
    always: bool
    rng: np.random.Generator
    report: Callable[[Adaptation], None]

    def __call__(self, n: int) -> Estimate:
        """An estimate from at most n evaluations for each set, those of the pilot included."""
        d, size = self.region.d, int(ROUND_PART * n * self.sets)
        if size < INTERVALS:
            raise ValueError(
                f"n_points must be at least {int(INTERVALS / ROUND_PART) + 1} to adapt, got {n}; leave adapt out"
            )
        warp = SeparableMap.identity(d)
        pool = self._round(warp, size, None)
        concentration = _concentration(pool.values)
        adapted = self.always or concentration < CONCENTRATED
        if adapted:
            for _ in range(ROUNDS - 1):
                warp = refined(warp, pool)
                pool = self._round(warp, size, pool)
            warp = refined(warp, pool)
        used = pool.u.shape[1]
        self.report(Adaptation(adapted, warp.nodes, concentration, used))
        region = MappedRegion(self.region, warp) if adapted else self.region
        found = self.estimator(region)((n * self.sets - used) // self.sets)
        return replace(found, n=found.n + used)

    def _round(self, warp: SeparableMap, n: int, pool: PilotSamples | None) -> PilotSamples:
        """The pool with n more samples, drawn through a map."""
        v = within(sample("halton", n, self.region.d, rng=self.rng).points.T)
        u, _ = warp(v)
        values = self.integrand(self.region)(u.T)
        if pool is None:
            return PilotSamples(u, values, [(warp, n)])
        together = np.concatenate([pool.u, u], axis=1), np.concatenate([pool.values, values], axis=1)
        return PilotSamples(*together, [*pool.rounds, (warp, n)])


def single(parts: Sequence[Part], adapt: Any, tolerance: bool) -> Region:
    """The region to adapt to. Raises ValueError for what `adapt` does not go with, and for a value that it has not."""
    if adapt is not True:
        one_of("adapt", adapt, ("auto",))
    if tolerance:
        raise ValueError("adapt and a tolerance do not go together: give n_points in place of rtol and atol")
    if len(parts) > 1:
        raise ValueError(f"adapt is for one region, and this is the sum of {len(parts)} pieces; leave adapt out")
    return parts[0].region


def refined(warp: SeparableMap, pool: PilotSamples) -> SeparableMap:
    r"""A better map: along each axis the intervals get equal parts of the damped mass of \|f\|.

    Notes
    -----
    Of all products of densities, that of the marginals of \|f\| has the least Kullback–Leibler divergence from \|f\|.
    D_k is the mass of interval k as all samples so far estimate it, a part of the sum, and smoothed over three
    intervals. The new ends cut ((1 − D)/log(1/D))^0.8, which Lepage (1978) takes of second moments, into equal parts.
    """
    masses = np.abs(np.nan_to_num(pool.values)) * pool.weights()
    sums = masses.sum(axis=1, keepdims=True)
    total = np.divide(masses, sums, out=np.zeros_like(masses), where=sums > 0).sum(axis=0)
    if not total.any():
        return warp
    v = warp.inverse(pool.u)
    return SeparableMap(np.stack([_recut(*axis, total) for axis in zip(warp.nodes, v, strict=True)]))


def _recut(nodes: Array, v: Array, masses: Array) -> Array:
    """The new nodes (k + 1,) of an axis from the masses (n,) of samples at v (n,)."""
    k = len(nodes) - 1
    parts = np.bincount(np.minimum((v * k).astype(int), k - 1), masses, k)
    padded = np.concatenate([parts[:1], parts, parts[-1:]])
    smooth = padded[:-2] + 2 * parts + padded[2:]
    smooth = np.maximum(smooth / smooth.sum(), LEAST)
    damped = ((1 - smooth) / -np.log(smooth)) ** DAMPING
    cut = np.concatenate([[0.0], np.cumsum(damped)])
    at = np.interp(np.linspace(0, cut[-1], k + 1), cut, nodes)
    at[0], at[-1] = 0.0, 1.0
    return at


def _concentration(values: Array) -> float:
    """(Σ|f|)² / (n Σ f²), the least of all components (fields, n) that are not 0."""
    sizes = np.abs(np.nan_to_num(values))
    squares = np.square(sizes).sum(axis=1)
    parts = sizes.sum(axis=1)[squares > 0] ** 2 / (values.shape[1] * squares[squares > 0])
    return float(parts.min()) if len(parts) else 1.0
