"""The pilot rule: a grid that predicts and says where samples go, and nets of samples that correct it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._support.arrays import Array
from ..rules.chosen_fits import counted
from ..rules.fit import ROUNDING
from .diagnostics import IntegrationWarning, diagnosis
from .estimates import FEWEST_STRATA, SURPRISE, UNRESOLVED, Estimate, unresolved
from .grid_gaps import fill_gaps
from .helper import Helper, Task, done, helper
from .integrand import Integrand
from .pilot_error import variance
from .spread import across

#: Highest dimension in which the rule exists.
HIGHEST_DIMENSION = 3

#: Fewest evaluations. Of fewer the residuals do not tell the error.
FEWEST = 16

#: Share of the evaluations that are the grid's.
GRID_SHARE = 0.25

#: The most cells: beyond, all further evaluations are samples, and memory stays what it is, 201 MB a component.
MOST_CELLS = 1 << 24

#: Samples of a cell which tell its error even where they alone make up the error.
MANY_SAMPLES = 16

#: Ratio of the squares of residuals to what the grid leads to expect, from which on the grid is taken to miss
#: something; that of smooth integrands, kinks, edges and singularities is seldom above 300. Errors up to so many
#: times rounding count as rounding.
UNFORESEEN, LEAST_ERROR = 1e3, 10.0

#: Points of a call of the integrand, about; a cell may have 2^14 samples.
POINTS_AT_ONCE = 1 << 17

#: Parts that the samples come in, in random order, as long as each has about so many samples.
PARTS, FEWEST_OF_A_PART = 32, 1 << 11

#: Time of func, beside that of the rule on all threads, from which on the rule works ahead on a thread of its own.
WORTH_A_THREAD = 0.25

#: Powers of two that values may exceed the unit by: fourth powers of 2^32 are far from overflow.
ROOM = 32

RULES: dict[int, type[_core.PilotRule]] = {1: _core.PilotRule1, 2: _core.PilotRule2, 3: _core.PilotRule3}


def grid_side(n: int, d: int) -> int:
    """The number k of cells along an axis: the largest with k^d at most a quarter of n evaluations, and 2^24.

    Examples
    --------
    >>> from voroquad.integrals.pilot import grid_side
    >>> grid_side(16384, 2), grid_side(16384, 3), grid_side(10**9, 3)
    (64, 16, 256)
    """
    return max(1, int(min(GRID_SHARE * n, MOST_CELLS) ** (1 / d) + 1e-9))


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
        run = PilotRun(self.integrand, grid_side(n, self.integrand.d), self.rng, self.threads)
        run.evaluate_grid()
        return run.estimates(n, self.sets)


class PilotRun:
    """The rule on a grid of k^d cells; values are in units of 2^power, so that no power of them over- or underflows.

    The units are those of the grid, and grow where samples are far larger.
    """

    def __init__(self, integrand: Integrand, k: int, rng: np.random.Generator, threads: int):
        self.integrand, self.k, self.rng, self.threads = integrand, k, rng, threads
        self.cells = int(k**integrand.d)
        self.parts = self.samples = 0
        self.steps: list[Array] = []  # Σ over cells of (their mean − the value at the centre), after each part
        self._adding: Task[None] = done(None)

    def evaluate_grid(self) -> None:
        """Fill the grid, component by component."""
        self.integrand.watch.follow(self.known)
        kind, keys = RULES[self.integrand.d], self._keys()
        filled: list[list[tuple[float, bool]]] = []
        for begin in range(0, self.cells, POINTS_AT_ONCE):
            centres = kind.centres(self.k, begin, min(begin + POINTS_AT_ONCE, self.cells))
            values = self.integrand.of_prediction(self.integrand.pull_back(centres))
            if begin == 0:
                self.rule = kind(self.k, len(values), keys)
            filled.append(self._fill(begin, values))
        largest = np.array([self._largest_of_grid(f, [part[f] for part in filled]) for f in range(len(values))])
        self.grid_is_zero = largest == 0
        _, self.power = np.frexp(largest)
        for f, power in enumerate(self.power.tolist()):
            self.rule.rescale(f, -power)
        self._of_grid: Array | None = None

    def _fill(self, begin: int, values: Array) -> list[tuple[float, bool]]:
        """Put values (fields, n) into the grid; of each field the largest size, and whether all are finite."""
        for f, of_field in enumerate(values):
            self.rule.grid(f)[begin : begin + len(of_field)] = of_field
        return [_core.sizes(of_field) for of_field in values]

    def _largest_of_grid(self, field: int, parts: Sequence[tuple[float, bool]]) -> float:
        """The largest absolute value of a component on the grid, whose gaps are filled."""
        if all(finite for _, finite in parts):
            return max(size for size, _ in parts)
        grid = self.rule.grid(field)
        fill_gaps(grid.reshape((self.k,) * self.integrand.d))
        return _largest(grid)

    def _midpoints(self) -> Array:
        """The sums (fields,) over the grid; only who watches asks for them."""
        if self._of_grid is None:
            self._of_grid = np.array([self.rule.grid(f).sum() for f in range(len(self.power))])
        return self._of_grid

    def _keys(self) -> NDArray[np.uint64]:
        d = self.integrand.d
        return self.rng.integers(0, 2**64, size=(RULES[d].sequences, d, 65), dtype=np.uint64)

    def grid_values(self) -> Array:
        """Values (fields, cells) at the centres."""
        grids = [self.rule.grid(f) for f in range(len(self.power))]
        return np.stack([np.ldexp(grid, power) for grid, power in zip(grids, self.power, strict=True)])

    def mean_size(self) -> Array:
        r"""The mean of \|f\| (fields,) over the grid."""
        sums = [sum(float(np.abs(part).sum()) for part in parts) for parts in self.parts_of_components()]
        return np.ldexp(np.array(sums) / self.cells, self.power)

    def parts_of_components(self) -> list[list[Array]]:
        """The values of each component, in units, in parts that are no burden to memory."""
        at = range(0, self.cells, POINTS_AT_ONCE)
        grids = [self.rule.grid(f) for f in range(len(self.power))]
        return [[grid[b : b + POINTS_AT_ONCE] for b in at] for grid in grids]

    def difficulty(self) -> Array:
        """In proportion to the errors (fields,) that the grid leads to expect of a given number of samples."""
        found: Array = np.ldexp(self.rule.difficulty(self.threads), self.power)
        return found

    def estimates(self, n: int, sets: int) -> Estimate:
        """The mean of estimates from the grid and at most n minus its size samples each."""
        samples = n - self.cells
        most = min(max(samples // PARTS, FEWEST_OF_A_PART), POINTS_AT_ONCE)
        self.parts = self.rule.plan(samples, most, self.threads)
        found: list[Estimate] = []
        self.integrand.watch.follow(lambda: across(found, self.cells) if found else self.known())
        for _ in range(sets):
            found.append(self._fresh())
        return across(found, self.cells)

    def _fresh(self) -> Estimate:
        """From the grid and samples of which no estimate before knows.

        The parts come in random order, so that those so far are a fair sample of all at any time.
        """
        rule = self.rule
        if self.steps:
            rule.renew(self._keys())
        self.steps.clear()
        self.samples = 0
        order = iter(self.rng.permutation(self.parts) if self.parts > 1 else range(1))

        def draw() -> Callable[[], tuple[Array, Array]]:
            return self.integrand.ahead(rule.draw(next(order), self.threads))

        threads = self.threads if self._first_part(draw) else 1
        with helper(threads, self.parts - 1) as aside:
            for pulled in aside.ahead(draw, self.parts - 1):
                self._take(self.integrand.at(pulled()), aside)
            self._adding.result()
        return self._estimate()

    def _first_part(self, draw: Callable[[], Callable[[], tuple[Array, Array]]]) -> bool:
        """Do the first part. Whether func takes so long that a thread of its own for the rule gains time.

        All threads share the work of the rule. One more beside func, which has only one, slows all down a little.
        """
        begin = time.perf_counter()
        pulled = draw()
        drawn = time.perf_counter()
        values = self.integrand.at(pulled())
        evaluated = time.perf_counter()
        self._take(values, Helper())
        of_func = evaluated - drawn
        return of_func > WORTH_A_THREAD * (time.perf_counter() - begin - of_func)

    def _take(self, values: Array, aside: Helper) -> None:
        """Add values of the next part when those before have been added."""
        self._adding.result()
        self._adjust_units(values)
        self._adding = aside.do(partial(self._add, values))

    def _add(self, values: Array) -> None:
        self.rule.add(values, self.threads)
        self.steps.append(self.rule.integral - self.rule.midpoints)
        self.samples += values.shape[1]

    def _adjust_units(self, values: Array) -> None:
        """New units for components with values (fields, n) far above theirs, or with no value but 0 before."""
        size, power = np.frexp([_largest(v) for v in values])
        unknown = self.grid_is_zero & (self.rule.largest == 0)
        other = (size > 0) & (unknown | (power > self.power + ROOM))
        shift = np.where(other, self.power - power, 0).astype(np.intc)
        for field in np.flatnonzero(shift):
            self.rule.rescale(int(field), int(shift[field]))
        self.steps = [np.ldexp(x, shift) for x in self.steps]
        if shift.any():
            self._of_grid = None
        self.power = self.power - shift

    def known(self) -> Estimate | None:
        """What two parts or more tell of all: they are drawn from them without replacement.

        With D_c the sum over the cells of part c of their means minus the values at their centres, the sum of all D is
        estimated by B times the mean of b of them, B being their number. Its variance is B² (1 − b/B) s²/b for the
        choice of the parts, and B/b times that of the samples in them, at most Σ (r/m)² with the residuals r.
        """
        self._adding.result()
        b, whole = len(self.steps), self.parts
        if b < 2:
            return None
        differences = np.diff(self.steps, axis=0, prepend=0.0)
        mean = self._midpoints() + whole * differences.mean(axis=0)
        between = whole * (whole - b) / b * differences.var(axis=0, ddof=1)
        error = np.sqrt(between + whole / b * self.rule.square)
        mean, error = (np.ldexp(x / self.cells, self.power) for x in (mean, error))
        return Estimate(mean, error, np.zeros_like(error), self.cells + self.samples, b - 1)

    def _estimate(self) -> Estimate:
        rule, cells = self.rule, self.cells
        mean, rounding = rule.integral / cells, ROUNDING * self.integrand.epsilon * rule.size / cells
        error, freedom = self._error(rounding)
        warnings = []
        if not self.integrand.empty:
            zero = self.grid_is_zero & (rule.value_square == 0)
            tails = self.parts_of_components()
            warnings = unresolved(rule.absolute, rule.value_square, zero, self.samples, tails)
            resolved = not any(warning.kind in UNRESOLVED for warning in warnings)
            if resolved and (surprise := self._surprise() or self._unforeseen(rounding)):
                warnings.append(surprise)
        mean, error, rounding = (np.ldexp(x, self.power) for x in (mean, error, rounding))
        return Estimate(
            mean, error, rounding, cells + self.samples, freedom, tuple(warnings), rule.deviations, self._told()
        )

    def _error(self, rounding: Array) -> tuple[Array, float]:
        """Standard error, rounding included, and the degrees of freedom of the component that has fewest."""
        of_sum, freedom = variance(*self.rule.differences())
        sampled, whole = of_sum / self.cells**2, of_sum / self.cells**2 + np.square(rounding)
        share = np.divide(sampled, whole, out=np.zeros_like(whole), where=whole > 0)
        freedom = np.divide(freedom, np.square(share), out=np.full(len(share), np.inf), where=share > 0)
        return np.sqrt(whole), float(freedom.min())

    def _told(self) -> tuple[str, ...]:
        """The grid, and which stencils predict in how many of its cells, by component."""
        grid = f"pilot grid of {' × '.join([str(self.k)] * self.integrand.d)} cells"
        counts = [self.rule.picked(f) for f in range(len(self.power))]
        names = [f"stencil of {2 * q + 1}" for q in range(len(counts[0]))]
        return tuple(f"{grid}, {counted(names, of_field, 'cells')}" for of_field in counts)

    def _surprise(self) -> IntegrationWarning | None:
        """A warning where one cell makes up the error of a component and a value there came as a surprise."""
        if self.cells < FEWEST_STRATA:
            return None
        for f, (total, largest) in enumerate(zip(self.rule.square, self.rule.largest, strict=True)):
            cell, samples, square, residual, value = self.rule.worst(f)
            if (
                samples < MANY_SAMPLES
                and square > 0.5 * total
                and residual >= max(value / 2, SURPRISE * max(largest, 0.5))
            ):
                centre = RULES[self.integrand.d].centres(self.k, cell, cell + 1)
                x, _ = self.integrand.pull_back(centre)
                return diagnosis("one-stratum", x=x[:, 0].tolist(), share=round(square / total, 3))
        return None

    def _unforeseen(self, rounding: Array) -> IntegrationWarning | None:
        """A warning where residuals are far larger than the grid led to expect: it does not see the integrand."""
        rule = self.rule
        seen = np.sqrt(rule.square) / self.cells <= LEAST_ERROR * rounding  # what is left may be rounding
        times = np.divide(rule.square, rule.expected, out=np.zeros_like(rounding), where=~seen)
        if not (times > UNFORESEEN).any():
            return None
        return diagnosis("unforeseen", times=float(f"{math.sqrt(times.max()):.3g}"), component=int(times.argmax()))


def _largest(values: Array) -> float:
    """The largest finite absolute value; 0 of none."""
    largest, finite = _core.sizes(values)
    return largest if finite else float(np.abs(values).max(initial=0, where=np.isfinite(values)))
