"""Adaptation to peaks: pilot rounds learn where samples should go, and a final round of fresh ones estimates."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._support.arrays import Array, Indices
from ..designs.grids import largest_grid
from ..designs.sampling import sample
from .end_powers import has_end_powers
from .estimates import Estimate
from .integrand import Integrand
from .leaves import LeafSets, draw
from .partition import Partition, grow
from .pieces import Part
from .regions import Region, within
from .separable_map import INTERVALS, MappedRegion, SeparableMap, refined
from .units import scaled

#: Rounds of the pilot with maps, and then with maps and trees; the part of all evaluations that each takes, as the
#: first one does. What is left is the final round's.
MAP_ROUNDS, TREE_ROUNDS, ROUND_PART = 2, 2, 0.06

#: Fewest evaluations of all sets: a sample of the first round for each interval of a map.
FEWEST = math.ceil(INTERVALS / ROUND_PART)

#: Part of the evaluations that a first look takes, and the most of them.
LOOK, MOST_OF_LOOK = 0.03, 256

#: Fewest steps of the map after a round; after round t there are t, all on the samples so far.
STEPS = 2

#: Part of a pilot round with a tree that leaves get by their volume alone.
EVEN_IN_PILOT = 0.3

#: With "auto" a map is learned if the first values rest on a smaller part of their points than this, by dimension, and
#: in six dimensions or more. In up to three dimensions the grid of the pilot rule sees peaks that are wider; in many,
#: smooth functions are concentrated, too (benchmarks/smooth_cost.py).
CONCENTRATED, IN_MANY_DIMENSIONS = {1: 0.002, 2: 0.03, 3: 0.1, 4: 0.1, 5: 0.07}, 0.05


@dataclass(frozen=True)
class Adaptation:
    r"""What the pilot of an adaptive integral found.

    Attributes
    ----------
    adapted : bool
        Whether the estimate uses a learned map.
    nodes : ndarray, (d, 25)
        Images of 0, 1/24, …, 1 under the map, along each axis of the unit box; in a box with finite limits they are at
        a + (b − a) nodes. If there is one leaf, the intervals between nodes have equally many samples.
    low, high : ndarray, (leaves, d)
        Corners of the boxes (leaves of a tree) that have their own samples, in the unit box that the map takes to the
        domain.
    concentration : float
        Part of the samples of the first round that the integral rests on, (Σ\|f\|)² / (n Σ f²). Of several components
        the largest counts, because a map for a peak costs a smooth component its digits.
    n_pilot : int
        Evaluations of the pilot, which take no part in the estimate.
    """

    adapted: bool
    nodes: Array
    low: Array
    high: Array
    concentration: float
    n_pilot: int


@dataclass(frozen=True)
class Round:
    """Where the samples of a pilot round lie: how many in each leaf of a partition behind a map."""

    warp: SeparableMap
    partition: Partition
    counts: Indices

    def density(self, u: Array) -> Array:
        """Samples per volume (n,) at u (d, n)."""
        v = within(self.warp.inverse(u))
        leaf = self.partition.leaf_of(v)
        with np.errstate(divide="ignore"):
            return self.counts[leaf] / self.partition.volumes[leaf] / self.warp(v)[1]


class PilotSamples:
    """The samples of all pilot rounds: positions u (d, n), values (fields, n), and samples per volume there (n,)."""

    def __init__(self, u: Array, values: Array, first: Round):
        self.u, self.values, self.density = u, values, first.density(u)
        self._rounds = [first]

    def add(self, u: Array, values: Array, drawn: Round) -> None:
        """Those of one round more. All samples count as drawn from the mixture of the rounds."""
        self._rounds.append(drawn)
        at_new = np.sum([other.density(u) for other in self._rounds], axis=0)
        self.density = np.concatenate([self.density + drawn.density(self.u), at_new])
        self.u, self.values = np.concatenate([self.u, u], axis=1), np.concatenate([self.values, values], axis=1)

    @property
    def n(self) -> int:
        """Their number."""
        return self.u.shape[1]

    @property
    def weights(self) -> Array:
        """The volume (n,) that each stands for, 1 / Σ_t n_t p_t(u)."""
        return 1 / self.density

    def masses(self) -> Array:
        r"""What each sample (n,) stands for of the integral of \|f\|, which is 1 for each component."""
        masses = np.abs(np.nan_to_num(scaled(self.values, axis=1))) * self.weights
        sums = masses.sum(axis=1, keepdims=True)
        return np.divide(masses, sums, out=np.zeros_like(masses), where=sums > 0).sum(axis=0)

    def map_from(self, warp: SeparableMap) -> SeparableMap:
        """A better map than that."""
        masses = self.masses()
        for _ in range(max(STEPS, len(self._rounds))):
            warp = refined(warp, self.u, masses)
        return warp

    def partition_behind(self, warp: SeparableMap) -> Partition:
        """The tree of the integrand behind a map."""
        v = within(warp.inverse(self.u))
        slopes = warp(v)[1]
        with np.errstate(divide="ignore"):
            weights = np.where(slopes > 0, self.weights / slopes, 0)
        return grow(v, scaled(self.values, axis=1) * slopes, weights)


@dataclass(frozen=True)
class Learner:
    """What learns where samples should go.

    Attributes
    ----------
    integrand : callable
        Makes the integrand of a region.
    region : Region
        What to integrate over.
    always : bool
        Whether to adapt whatever the first values show.
    rng : numpy.random.Generator
        Of its samples.
    """

    integrand: Callable[[Region], Integrand]
    region: Region
    always: bool
    rng: np.random.Generator

    def concentrated(self, found_in: float) -> bool:
        """Whether the first values have less than the concentration of a smooth integrand."""
        return found_in < CONCENTRATED.get(self.region.d, IN_MANY_DIMENSIONS)

    def adapts(self, u: Array, values: Array) -> bool:
        """Whether to adapt, from the first values (fields, n) at u (d, n): if each component that is not 0 is
        concentrated or has powers at the faces."""
        return self.always or self.concentrated(concentration(values[~has_end_powers(u, values)]))

    @property
    def has_gradients(self) -> bool:
        """Whether the values so far have gradients, which the pilot rule does not keep."""
        return bool(self.integrand(self.region).function.tape)

    def even(self, n: int) -> tuple[Array, Array, Round]:
        """At most n samples of the region as it is. Above four dimensions grids have few sizes."""
        d = self.region.d
        identity, whole = SeparableMap.identity(d), Partition.whole(d)
        if d <= 4:
            return self.draw(identity, whole, n)
        u = within(sample("sobol", n, d, rng=self.rng).points)
        return u.T, self.integrand(self.region)(u), Round(identity, whole, np.array([n]))

    def draw(self, warp: SeparableMap, partition: Partition, n: int) -> tuple[Array, Array, Round]:
        """Samples u (d, m) of at most n evaluations, their values, and where they lie."""
        groups = draw(partition, n, EVEN_IN_PILOT, self.rng)
        v = within(np.concatenate([group.places(partition) for group in groups]).T)
        u, _ = warp(v)
        return u, self.integrand(self.region)(u.T), Round(warp, partition, _counted(groups, len(partition)))

    def learn_map(self, pool: PilotSamples, rounds: int, n: int) -> SeparableMap:
        """The map that the samples so far and rounds of at most n more make; the pool takes these."""
        warp = SeparableMap.identity(self.region.d)
        for _ in range(rounds):
            warp = pool.map_from(warp)
            pool.add(*self.draw(warp, Partition.whole(self.region.d), n))
        return pool.map_from(warp)

    def learn_tree(self, pool: PilotSamples, warp: SeparableMap, rounds: int, n: int) -> tuple[SeparableMap, Partition]:
        """The map and the tree behind it, as for :meth:`learn_map`."""
        for _ in range(rounds):
            pool.add(*self.draw(warp, pool.partition_behind(warp), n))
            warp = pool.map_from(warp)
        return warp, pool.partition_behind(warp)


@dataclass(frozen=True)
class AdaptiveEstimator:
    """Learns from pilot rounds where samples should go and estimates with fresh ones, so the estimate stays unbiased.

    Given the pilot, map and tree are fixed, and the final round is a rule for the integrand behind them. Samples of the
    pilot take no part: a mean of all rounds, weighted by the inverse of the variances that they show, is biased.

    Attributes
    ----------
    pilot : Learner
        Learns.
    plain : callable
        Estimates without adaptation, from at most so many samples of each set.
    final : callable
        Takes a region behind a map, and a partition of its box, and returns what estimates from at most so many
        samples of each set.
    look : callable
        Number of samples of a first look, for so many in all.
    sets : int
        Sets of the final round.
    report : callable
        Gets the :class:`Adaptation`.
    """

    pilot: Learner
    plain: Callable[[int], Estimate]
    final: Callable[[Region, Partition], Callable[[int], Estimate]]
    look: Callable[[int], int]
    sets: int
    report: Callable[[Adaptation], None]

    def __call__(self, n: int) -> Estimate:
        """An estimate from at most n evaluations for each set, those of the pilot included."""
        learner, size = self.pilot, round_size(n, self.sets)
        look = size if learner.always else self.look(n)
        pool = PilotSamples(*learner.even(look))
        found_in = concentration(pool.values)
        if not learner.adapts(pool.u, pool.values):
            return self._estimate(pool, found_in, None, self.plain, n)
        if look < size:
            pool.add(*learner.even(size - look))
        warp = learner.learn_map(pool, MAP_ROUNDS, size)
        warp, partition = learner.learn_tree(pool, warp, TREE_ROUNDS, size)
        estimate = self.final(MappedRegion(learner.region, warp), partition)
        return self._estimate(pool, found_in, (warp, partition), estimate, n)

    def _estimate(
        self,
        pool: PilotSamples,
        found_in: float,
        learned: tuple[SeparableMap, Partition] | None,
        estimate: Callable[[int], Estimate],
        n: int,
    ) -> Estimate:
        """What is left of the samples makes the estimate."""
        d, used = self.pilot.region.d, pool.n
        warp, partition = learned or (SeparableMap.identity(d), Partition.whole(d))
        self.report(Adaptation(learned is not None, warp.nodes, partition.low, partition.high, found_in, used))
        found = estimate((n * self.sets - used) // self.sets)
        return replace(found, n=found.n + used)


def round_size(n: int, sets: int) -> int:
    """Evaluations of a pilot round, for sets of n each."""
    if n * sets < FEWEST:
        raise ValueError(f"n_points must be at least {math.ceil(FEWEST / sets)} to adapt, got {n}; leave adapt out")
    return int(ROUND_PART * (n * sets))


def _counted(groups: Sequence[LeafSets], leaves: int) -> Indices:
    found = np.empty(leaves, dtype=np.intp)
    for group in groups:
        found[group.leaves] = group.samples.n
    return found


def look_size(n: int, d: int) -> int:
    """Samples of a first look in four dimensions or more, at most as many as a pilot round has.

    In four dimensions these are those that a grid of strata leaves over, of n samples or of 1.5 % less.

    Examples
    --------
    >>> from voroquad.integrals.adaptation import look_size
    >>> look_size(2048, 4), look_size(2048, 6)  # 6 · 6 · 7 · 8 = 2016
    (32, 62)
    """
    look = math.ceil(LOOK * n)
    size = n - math.prod(largest_grid(n - look // 2, d)) if d == 4 else min(look, MOST_OF_LOOK)
    return min(size, int(ROUND_PART * n))


def single(parts: Sequence[Part], adapt: Any, tolerance: bool) -> Region | None:
    """The region to adapt to; None for False, and where "auto" has none.

    Raises ValueError for what `adapt=True` does not go with, and what is none of the three.
    """
    if not isinstance(adapt, bool | np.bool_) and not (isinstance(adapt, str) and adapt == "auto"):
        raise ValueError(f"adapt must be True, False or 'auto', got {adapt!r}")
    if not adapt:
        return None
    if isinstance(adapt, str):
        return None if tolerance or len(parts) > 1 else parts[0].region
    if tolerance:
        raise ValueError("adapt and a tolerance do not go together: give n_points in place of rtol and atol")
    if len(parts) > 1:
        raise ValueError(f"adapt is for one region, and this is the sum of {len(parts)} pieces; leave adapt out")
    return parts[0].region


def concentration(values: Array) -> float:
    """(Σ|f|)² / (n Σ f²), the largest of all components (fields, n); of all 0, 0."""
    sizes = np.abs(np.nan_to_num(scaled(values, axis=1)))
    return concentration_of_parts([row] for row in sizes)


def concentration_of_parts(components: Iterable[Sequence[Array]]) -> float:
    """The same of components that come in parts, in units in which no square over- or underflows."""
    found = []
    for parts in components:
        square = sum(float(part @ part) for part in parts)
        if square > 0:
            size, n = sum(float(np.abs(part).sum()) for part in parts), sum(len(part) for part in parts)
            found.append(size**2 / (n * square))
    return max(found, default=0.0)
