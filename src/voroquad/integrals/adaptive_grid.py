"""Adaptation in up to three dimensions: the pilot rule, behind a learned map where that is better."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .._support.arrays import Array
from .adaptation import Adaptation, Learner, PilotSamples, Round, concentration_of_parts, round_size
from .estimates import Estimate
from .partition import Partition
from .pilot import RULES, PilotRun, grid_side
from .regions import Region
from .separable_map import MappedRegion, SeparableMap

#: Pilot rounds that learn a map.
ROUNDS = 2

#: The most cells of a grid that "auto" puts behind a map: the pool of the pilot holds all centres, and a finer grid
#: sees peaks by itself.
MOST_CELLS = 1 << 20

#: Part of the evaluations that a coarse grid takes.
LOOK = 0.015

#: Expected errors, beside the mean size of values, above which a coarse grid is too rough for the rule for few points,
#: and any grid so rough that a map may gain: benchmarks/smooth_cost.py.
ROUGH = 12.0
WORTH_A_MAP = {1: 0.0, 2: 5.0, 3: ROUGH}


@dataclass(frozen=True)
class AdaptiveGrid:
    """The pilot rule in the coordinates, plain or behind a map, in which its grid leads to expect the smaller error.

    The plain grid is the first round of the pilot. Both grids, and all rounds of the pilot, are fixed or known before
    the samples are drawn that correct the prediction, so the estimate is unbiased.

    Attributes
    ----------
    pilot : Learner
        Learns.
    sets : int
        Estimates, which share the pilot and the grid.
    threads : int
        Of the rule; the result does not depend on it.
    report : callable
        Gets the :class:`~voroquad.integrals.adaptation.Adaptation`.
    """

    pilot: Learner
    sets: int
    threads: int
    report: Callable[[Adaptation], None]

    def __call__(self, n: int, before: int = 0, with_gradients: Callable[[int], Estimate] | None = None) -> Estimate:
        """An estimate from at most n evaluations for each set. The evaluations `before` are counted, but not used. The
        rule does not keep gradients: values that have them go to `with_gradients`, if that is given."""
        d = self.pilot.region.d
        size = round_size(n, 1)
        plain = self.run(grid_side(n, d))
        identity = SeparableMap.identity(d)
        found_in = concentration_of_parts(plain.parts_of_components())
        if with_gradients is not None and self.pilot.has_gradients:
            self.tell(identity, found_in, before + plain.cells, False)
            return _with(before + plain.cells, with_gradients(n - plain.cells))
        if not self.pilot.always and not (self.pilot.concentrated(found_in) and self._worth_a_map(plain)):
            self.tell(identity, found_in, before, False)
            return _with(before, plain.estimates(n, self.sets))
        values = plain.grid_values()
        centres = RULES[d].centres(plain.k, 0, plain.cells)
        pool = PilotSamples(centres, values, Round(identity, Partition.whole(d), np.array([plain.cells])))
        warp = self.pilot.learn_map(pool, ROUNDS, size)
        used = pool.u.shape[1]
        mapped = self._run(MappedRegion(self.pilot.region, warp), grid_side(n - used, d))
        better = _easier(mapped.difficulty(), plain.difficulty())
        chosen, other = (mapped, plain) if better else (plain, mapped)
        wasted = used - plain.cells + other.cells
        self.tell(warp if better else identity, found_in, before + wasted, better)
        return _with(before + wasted, chosen.estimates(n - wasted, self.sets))

    def _worth_a_map(self, plain: PilotRun) -> bool:
        return plain.cells <= MOST_CELLS and rougher(plain, WORTH_A_MAP[self.pilot.region.d])

    def run(self, k: int) -> PilotRun:
        """The rule on a grid of k^d cells of the region as it is, with the values at their centres."""
        return self._run(self.pilot.region, k)

    def _run(self, region: Region, k: int) -> PilotRun:
        run = PilotRun(self.pilot.integrand(region), k, self.pilot.rng, self.threads)
        run.evaluate_grid()
        return run

    def tell(self, warp: SeparableMap, found_in: float, n: int, adapted: bool) -> None:
        """Report what the pilot found, and its n evaluations, which take no part in the estimate."""
        whole = Partition.whole(len(warp.nodes))
        self.report(Adaptation(adapted, warp.nodes, whole.low, whole.high, found_in, n))


@dataclass(frozen=True)
class GridAtNeed:
    """A rule for few points; the adaptive grid where a coarse grid of about 1.5 % of them is too rough for it.

    The coarse grid is deterministic, so the choice is no cause of bias.

    Attributes
    ----------
    grid : AdaptiveGrid
        Where the integrand is rough.
    few : callable
        Where it is smooth.
    """

    grid: AdaptiveGrid
    few: Callable[[int], Estimate]

    def __call__(self, n: int) -> Estimate:
        """An estimate from at most n evaluations."""
        learner = self.grid.pilot
        coarse = self.grid.run(coarse_side(n, learner.region.d))
        if rough(coarse) and not learner.has_gradients:
            return self.grid(n - coarse.cells, coarse.cells)
        self.grid.tell(
            SeparableMap.identity(learner.region.d),
            concentration_of_parts(coarse.parts_of_components()),
            coarse.cells,
            False,
        )
        return _with(coarse.cells, self.few(n - coarse.cells))


def coarse_side(n: int, d: int) -> int:
    """Cells along an axis of the coarse grid for n evaluations.

    Examples
    --------
    >>> from voroquad.integrals.adaptive_grid import coarse_side
    >>> coarse_side(3000, 3), coarse_side(5000, 3)
    (3, 4)
    """
    return int((LOOK * n) ** (1 / d) + 1e-9)


def rough(coarse: PilotRun) -> bool:
    """Whether a coarse grid is rough."""
    return rougher(coarse, ROUGH)


def rougher(grid: PilotRun, bound: float) -> bool:
    """Whether the error that a grid leads to expect is more than that times the mean size of its values.

    It is so for one of the components that are not 0, or all are 0.
    """
    size = grid.mean_size()
    return bool(((size > 0) & (grid.difficulty() > bound * size)).any() or not size.any())


def _with(n: int, found: Estimate) -> Estimate:
    """An estimate that n evaluations more led to."""
    return replace(found, n=found.n + n)


def _easier(one: Array, other: Array) -> bool:
    """Whether one grid has the smaller difficulties (fields,), each compared with the other's."""
    both = one + other
    return bool(np.divide(one, both, out=np.full_like(one, 0.5), where=both > 0).mean() < 0.5)
