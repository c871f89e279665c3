"""The pilot rule: a grid that predicts and says where samples go, and nets of samples that correct it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._support.arrays import Array
from ..rules.fit import ROUNDING
from .diagnostics import IntegrationWarning, diagnosis
from .estimates import FEWEST_STRATA, SURPRISE, Estimate, unresolved
from .integrand import Integrand
from .spread import across

#: Highest dimension in which the rule exists.
HIGHEST_DIMENSION = 3

#: Fewest evaluations: a grid of one cell, and a sample in it.
FEWEST = 4

#: Share of the evaluations that are the grid's.
GRID_SHARE = 0.25

#: Points of a call of the integrand, about; a cell may have 2^14 samples.
POINTS_AT_ONCE = 1 << 17

RULES: dict[int, type[_core.PilotRule]] = {1: _core.PilotRule1, 2: _core.PilotRule2, 3: _core.PilotRule3}


def grid_side(n: int, d: int) -> int:
    """The number k of cells along an axis: the largest with k^d at most a quarter of n evaluations.

    Examples
    --------
    >>> from voroquad.integrals.pilot import grid_side
    >>> grid_side(16384, 2), grid_side(16384, 3)
    (64, 16)
    """
    return max(1, int((GRID_SHARE * n) ** (1 / d) + 1e-9))


@dataclass(frozen=True)
class PilotEstimator:
    """Integrals from a deterministic grid and scrambled Sobol' samples, by include/voroquad/pilot.hpp.

    Several estimates share the grid: given it, they are independent.
    """

    integrand: Integrand
    sets: int
    rng: np.random.Generator
    threads: int

    def __call__(self, n: int) -> Estimate:
        """An estimate from at most n evaluations for each of the sets."""
        d = self.integrand.d
        run = _Run(self.integrand, grid_side(n, d), self.threads)
        run.evaluate_grid(self._keys())
        found = [run.estimate(n)]
        for _ in range(1, self.sets):
            run.start_again(self._keys())
            found.append(run.estimate(n))
        return across(found, shared=run.k**d)

    def _keys(self) -> NDArray[np.uint64]:
        d = self.integrand.d
        return self.rng.integers(0, 2**64, size=(RULES[d].sequences, d, 65), dtype=np.uint64)


@dataclass
class _Run:
    """The rule on a grid of k^d cells; values are in units of 2^power, so that no square over- or underflows."""

    integrand: Integrand
    k: int
    threads: int
    rule: _core.PilotRule = field(init=False)
    power: NDArray[np.intc] = field(init=False)
    grid_is_zero: NDArray[np.bool_] = field(init=False)

    @property
    def cells(self) -> int:
        return int(self.k**self.integrand.d)

    def evaluate_grid(self, keys: NDArray[np.uint64]) -> None:
        """Fill the grid, component by component."""
        kind = RULES[self.integrand.d]
        for begin in range(0, self.cells, POINTS_AT_ONCE):
            end = min(begin + POINTS_AT_ONCE, self.cells)
            values = self.integrand(kind.centres(self.k, begin, end).T)
            if begin == 0:
                self.rule = kind(self.k, len(values), keys)
                fields = [self.rule.grid(f) for f in range(len(values))]
            for grid, of_field in zip(fields, values, strict=True):
                grid[begin:end] = of_field
        largest = np.array([_largest(grid) for grid in fields])
        self.grid_is_zero = largest == 0
        _, self.power = np.frexp(largest)
        for grid, power in zip(fields, self.power, strict=True):
            np.ldexp(grid, -power, out=grid)

    def start_again(self, keys: NDArray[np.uint64]) -> None:
        """The same grid, other samples."""
        old, fields = self.rule, len(self.power)
        self.rule = RULES[self.integrand.d](self.k, fields, keys)
        for f in range(fields):
            self.rule.grid(f)[:] = old.grid(f)

    def estimate(self, n: int) -> Estimate:
        """From the grid and at most n minus its size samples."""
        rule = self.rule
        rule.plan(n - self.cells, self.threads)
        samples = 0
        while (points := rule.next(POINTS_AT_ONCE, self.threads)).size:
            values = self.integrand(points.T)
            unknown = self.grid_is_zero & (rule.largest == 0)
            if unknown.any():  # no value but 0 so far: any unit will do for those
                _, power = np.frexp([_largest(v) for v in values])
                self.power = np.where(unknown, power, self.power).astype(np.intc)
            rule.add(np.ldexp(values, -self.power[:, None]), self.threads)
            samples += points.shape[1]
        return self._estimate(samples)

    def _estimate(self, samples: int) -> Estimate:
        rule, cells = self.rule, self.cells
        mean, rounding = rule.integral / cells, ROUNDING * self.integrand.epsilon * rule.size / cells
        error = np.hypot(np.sqrt(rule.square) / cells, rounding)
        warnings = []
        if not self.integrand.empty:
            zero = self.grid_is_zero & (rule.value_square == 0)
            warnings = unresolved(rule.absolute, rule.value_square, zero, samples)
            if surprise := self._surprise():
                warnings += [] if any(w.kind == "few-samples" for w in warnings) else [surprise]
        mean, error, rounding = (np.ldexp(x, self.power) for x in (mean, error, rounding))
        return Estimate(mean, error, rounding, cells + samples, math.inf, tuple(warnings))

    def _surprise(self) -> IntegrationWarning | None:
        """A warning where one cell makes up the error of a component and a value there came as a surprise."""
        if self.cells < FEWEST_STRATA:
            return None
        for f, (total, largest) in enumerate(zip(self.rule.square, self.rule.largest, strict=True)):
            cell, square, residual, value = self.rule.worst(f)
            if square > 0.5 * total and residual >= max(value / 2, SURPRISE * max(largest, 0.5)):
                centre = RULES[self.integrand.d].centres(self.k, cell, cell + 1)
                x, _ = self.integrand.pull_back(centre)
                return diagnosis("one-stratum", x=x[:, 0].tolist(), share=round(square / total, 3))
        return None


def _largest(values: Array) -> float:
    """The largest finite absolute value; 0 of none."""
    largest = max(float(values.max()), -float(values.min()))
    return largest if math.isfinite(largest) else float(np.abs(values).max(initial=0, where=np.isfinite(values)))
