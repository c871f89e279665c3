"""Adaptation in up to three dimensions: the pilot rule, behind a learned map where that is better."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .._support.arrays import Array
from .adaptation import Adaptation, Learner, PilotSamples, Round, concentration, round_size
from .estimates import Estimate
from .partition import Partition
from .pilot import RULES, PilotRun, grid_side
from .regions import Region
from .separable_map import MappedRegion, SeparableMap

#: Pilot rounds that learn a map.
ROUNDS = 2


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

    def __call__(self, n: int) -> Estimate:
        """An estimate from at most n evaluations for each set."""
        d = self.pilot.region.d
        size = round_size(n, 1)
        plain = self._run(self.pilot.region, grid_side(n, d))
        values, identity = plain.grid_values(), SeparableMap.identity(d)
        if not self.pilot.adapts(concentration(values)):
            self._tell(identity, values, 0, False)
            return plain.estimates(n, self.sets)
        centres = RULES[d].centres(plain.k, 0, plain.cells)
        pool = PilotSamples(centres, values, Round(identity, Partition.whole(d), np.array([plain.cells])))
        warp = self.pilot.learn_map(pool, ROUNDS, size)
        used = pool.u.shape[1]
        mapped = self._run(MappedRegion(self.pilot.region, warp), grid_side(n - used, d))
        better = _easier(mapped.difficulty(), plain.difficulty())
        chosen, other = (mapped, plain) if better else (plain, mapped)
        wasted = used - plain.cells + other.cells
        self._tell(warp if better else identity, values, wasted, better)
        found = chosen.estimates(n - wasted, self.sets)
        return replace(found, n=found.n + wasted)

    def _run(self, region: Region, k: int) -> PilotRun:
        run = PilotRun(self.pilot.integrand(region), k, self.pilot.rng, self.threads)
        run.evaluate_grid()
        return run

    def _tell(self, warp: SeparableMap, values: Array, n: int, adapted: bool) -> None:
        whole = Partition.whole(len(warp.nodes))
        self.report(Adaptation(adapted, warp.nodes, whole.low, whole.high, concentration(values), n))


def _easier(one: Array, other: Array) -> bool:
    """Whether one grid has the smaller difficulties (fields,), each compared with the other's."""
    both = one + other
    return bool(np.divide(one, both, out=np.full_like(one, 0.5), where=both > 0).mean() < 0.5)
