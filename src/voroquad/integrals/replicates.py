"""Many samples in many dimensions: Sobol' replicates, corrected by polynomials from a grid or from each other."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._support.arrays import Array, Indices
from ..rules.chosen_fits import told
from ..rules.fit import ROUNDING
from ..rules.gauss_grid import grid_coefficients, grid_points, nodes_of_an_axis
from ..rules.nested_fits import (
    DEGREES_BELOW,
    SAMPLES_PER_TERM,
    NestedFits,
    embedded,
    highest_degree,
    terms_of,
    truncated,
)
from ..rules.steps import MOST, of_steps
from .estimates import Estimate, unresolved
from .integrand import Integrand
from .spread import across
from .units import deviation

#: Fewest replicates, without a grid and beside one; there are up to twice as many, less one.
FEWEST_REPLICATES, FEWEST_BESIDE_GRID = 4, 3

#: Highest dimension. Above it there are too few terms for a choice of their number.
HIGHEST_DIMENSION = 20

#: Points of the kernel come sixteen at a time, and of a replicate there are no fewer.
BLOCK = 16

#: Fewest evaluations.
FEWEST = FEWEST_REPLICATES * BLOCK

#: Largest number of terms over the square root of the evaluations: with it, the time of fits is in proportion to the
#: evaluations. And the largest number at all.
TERMS, MOST_TERMS = 2.0, 2000

#: The same of polynomials from a grid, whose time is that of their means over the nets alone.
TERMS_OF_GRID = 8.0

#: Factor of the standard error of the mean of replicates without a grid. They are not independent: each is
#: corrected by polynomials that are fitted to others. benchmarks/calibrate_replicates.py measures the least that
#: suffices.
ERROR_SCALE = 1.3

#: The same of small replicates, which have fewer than this number of points for each corner of the box: those of peaks
#: and corners seldom have a fair share of the large values, and then none of them shows it.
SCALE_OF_FEW, FEW_PER_CORNER = 1.6, 8

#: The same of replicates beside a grid. They are independent but for the choice of a degree: the least that suffices
#: is 1.05 to 1.13.
SCALE_BESIDE_GRID = 1.15

#: Number of parts of a net by which a candidate is judged, of a smaller net its blocks; and the part of the plain
#: mean's squared error that it may leave to be chosen.
PARTS, WORTH = 16, 0.1

#: Powers of two that values may exceed the unit by: squares of 2^32 are far from overflow.
ROOM = 32

#: Points of a call of the integrand.
POINTS_AT_ONCE = 1 << 15


@dataclass(frozen=True)
class Sizes:
    """What n evaluations in d dimensions are: a grid of side^d nodes, if any, and `count` replicates of m points."""

    side: int
    cells: int
    m: int
    count: int

    @classmethod
    def of(cls, n: int, d: int) -> Sizes:
        """As many as fit.

        Examples
        --------
        >>> from voroquad.integrals.replicates import Sizes
        >>> Sizes.of(16_384, 4), Sizes.of(16_384, 6)
        (Sizes(side=8, cells=4096, m=4096, count=3), Sizes(side=0, cells=0, m=4096, count=4))
        """
        side = nodes_of_an_axis(n, d)
        cells = side**d if side else 0
        fewest = FEWEST_BESIDE_GRID if side else FEWEST_REPLICATES
        m = 1 << int(math.log2(max((n - cells) // fewest, BLOCK)))
        return cls(side, cells, m, (n - cells) // m)

    @property
    def whole(self) -> int:
        """All evaluations."""
        return self.cells + self.count * self.m


def error_scale(sizes: Sizes, d: int) -> float:
    """The factor of the standard error of the mean of replicates.

    Examples
    --------
    >>> from voroquad.integrals.replicates import Sizes, error_scale
    >>> [error_scale(Sizes.of(n, 8), 8) for n in (1024, 4096, 16_384)]
    [1.6, 1.6, 1.3]
    """
    if sizes.side:
        return SCALE_BESIDE_GRID
    return SCALE_OF_FEW if sizes.m < FEW_PER_CORNER << d else ERROR_SCALE


@dataclass(frozen=True)
class ReplicateEstimator:
    r"""Scrambled Sobol' replicates, corrected by polynomials.

    The estimate of replicate r is ∫ P_r + mean(f − P_r). P_r is the candidate whose residuals vary least on other
    replicates, in their means over parts of a net (:func:`_best`). The candidates come from values at the nodes of a
    Gauss grid (:func:`~voroquad.rules.gauss_grid.nodes_of_an_axis`) or, without one, from fits: the replicates are two
    groups, and P_r is fitted to the group without r and chosen by the others of its own. So P_r does not depend on
    replicate r, whose points are uniform, and each estimate is unbiased. Several estimates share the grid.
    """

    integrand: Integrand
    sets: int
    rng: np.random.Generator
    threads: int

    def __call__(self, n: int) -> Estimate:
        """An estimate from at most n evaluations for each of the sets."""
        found: list[Estimate] = []
        degrees: list[Indices] = []
        sizes = Sizes.of(n, self.integrand.d)
        grid = self._grid(sizes)
        for _ in range(self.sets):
            replicates = _Replicates(self.integrand, sizes, grid, self.rng, self.threads)
            self.integrand.watch.follow((lambda: across(found, sizes.cells)) if found else replicates.known)
            estimate, of_nets = replicates.estimate()
            found.append(estimate)
            degrees.append(of_nets)
        return replace(across(found, sizes.cells), rules=_told(np.concatenate(degrees)))

    def _grid(self, sizes: Sizes) -> Array | None:
        """Values (fields, nodes). They only predict, so the integral exists where they are not finite."""
        at_once, d = POINTS_AT_ONCE, self.integrand.d
        begins = range(0, sizes.cells, at_once)
        nodes = (grid_points(sizes.side, d, b, min(b + at_once, sizes.cells)) for b in begins)
        values = [self.integrand.of_prediction(self.integrand.pull_back(u.T)) for u in nodes]
        return np.concatenate(values, axis=1) if values else None


class _Replicates:
    """Replicates of m points each; values are in units of 2^power, so that no square over- or underflows."""

    def __init__(self, integrand: Integrand, sizes: Sizes, grid: Array | None, rng: np.random.Generator, threads: int):
        d = integrand.d
        self.integrand, self.grid, self.threads = integrand, grid, threads
        self.side, self.cells, self.m, self.count = sizes.side, sizes.cells, sizes.m, sizes.count
        self.scale = error_scale(sizes, d)
        half = self.count // 2
        most = min(MOST_TERMS, (TERMS if grid is None else TERMS_OF_GRID) * math.sqrt(sizes.whole))
        if grid is None:
            self.groups: tuple[range, ...] = (range(half), range(half, self.count))
            self.highest = highest_degree(d, min(most, half * self.m / SAMPLES_PER_TERM))
        else:
            self.groups = (range(self.count),)
            self.highest = min(highest_degree(d, most), d * (self.side - 1))
        #: Points of a replicate that take part in fits, and come first in any case, a power of two
        wanted = SAMPLES_PER_TERM * math.comb(self.highest + d, d) / half
        self.fitted = min(self.m, 1 << max(4, math.ceil(math.log2(wanted))))
        self.parts = min(PARTS, self.m // BLOCK)
        keys = rng.integers(0, 2**64, size=(self.count, d, 65), dtype=np.uint64)
        self.nets = [_core.SobolNet(key, int(math.log2(self.m))) for key in keys]
        self._begun: list[Array] = []  # means (fields,) of the points of a replicate that take part in fits
        self._done: list[Array] = []  # plain means (fields,) of the replicates that are evaluated

    def estimate(self) -> tuple[Estimate, Indices]:
        """Draws, fits, and corrects; with the degrees that correct each replicate, (nets, fields)."""
        kept, sums, power = self._evaluated()
        corrections, degrees = self._corrections(kept, sums, power)
        return self._estimate(corrections, kept, sums, power), degrees

    def _evaluated(self) -> tuple[list[Array], list[_PartSums], NDArray[np.intc]]:
        """Of each net the values (fields, n) that take part in fits, and sums of all; and the power of their unit."""
        kept = []
        for net in self.nets:
            kept.append(self._values(net, 0, self.fitted))
            self._begun.append((kept[-1] / self.fitted).sum(axis=1))  # the sum of the largest values would overflow
        _, power = np.frexp(np.max([_largest(y) for y in kept], axis=0))
        kept = [np.ldexp(y, -power[:, None]) for y in kept]
        sums = [_PartSums(len(power), self.m, self.parts) for _ in kept]
        for of_net, y in zip(sums, kept, strict=True):
            of_net.add(0, y)
        for net, of_net in zip(self.nets, sums, strict=True):
            begin = self.fitted
            while begin < self.m:
                at_once = min(begin, POINTS_AT_ONCE)  # blocks of a net begin at a multiple of their size
                values = self._values(net, begin, at_once)
                shift = _shift(values, power, np.max([s.absolute for s in sums], axis=0))
                if shift.any():
                    power, kept = power - shift, [np.ldexp(y, shift[:, None]) for y in kept]
                    for s in sums:
                        s.rescale(shift)
                of_net.add(begin, np.ldexp(values, -power[:, None]))
                begin += at_once
            self._done.append(np.ldexp(of_net.means.mean(axis=1), power))
        return kept, sums, power

    def known(self) -> Estimate | None:
        """The plain mean of the replicates that are evaluated, or of the points for fits; None of fewer than two."""
        means, each = (self._done, self.m) if len(self._done) > 1 else (self._begun, self.fitted)
        if len(means) < 2:
            return None
        error = self.scale * deviation(np.stack(means), axis=0) / math.sqrt(len(means))
        n = self.cells + each * len(means)
        return Estimate(np.mean(means, axis=0), error, np.zeros_like(error), n, len(means) - 1)

    def _values(self, net: _core.SobolNet, begin: int, n: int) -> Array:
        return self.integrand(net.points(begin, n).T)

    def _fits(self, group: range, kept: list[Array], sums: list[_PartSums]) -> NestedFits:
        """Polynomials fitted to a group."""

        points = [self.nets[r].points(0, self.fitted) for r in group]

        def samples(n: int) -> tuple[Array, Array]:
            of_each = min(self.fitted, -(-n // (len(group) * BLOCK)) * BLOCK)
            both = zip(points, (kept[r] for r in group), strict=True)
            x, y = zip(*((x[:, :of_each], y[:, :of_each]) for x, y in both), strict=True)
            return np.concatenate(x, axis=1), np.concatenate(y, axis=1)

        plain = np.mean([sums[r].means.var(axis=1) for r in group], axis=0)
        worth = WORTH * plain * (self.m // self.parts)
        return NestedFits.of(samples, self.integrand.d, len(worth), self.highest, worth)

    def _of_grid(self, sums: list[_PartSums], power: NDArray[np.intc]) -> tuple[NestedFits, NDArray[np.bool_]]:
        """Polynomials from the grid, in units of 2^power, and for which replicates (nets, fields) they promise to pay.

        They do where what the highest degree leaves at the nodes is small beside what the plain mean leaves of others.
        Values at the nodes that are not finite predict nothing. The grid has a unit of its own: values far above those
        of the replicates leave more than these, even by rounding, and their coefficients are not used.
        """
        assert self.grid is not None
        d, p = self.integrand.d, self.highest
        finite = np.asarray(np.isfinite(self.grid).all(axis=1))
        _, above = np.frexp(_largest(self.grid))  # the unit of the grid
        scaled = np.ldexp(np.where(finite[:, None], self.grid, 0.0), -above[:, None])
        coefficients, left = grid_coefficients(scaled, self.side, d, p)
        above -= power
        plain = _of_others(np.stack([s.means.var(axis=1) for s in sums])) / (self.count - 1)
        with np.errstate(over="ignore"):
            promising = finite & (np.ldexp(left, 2 * above) <= WORTH * plain * (self.m // self.parts))
        used = promising.any(axis=0)
        coefficients = np.ldexp(np.where(used[:, None], coefficients, 0.0), np.where(used, above, 0)[:, None])
        below = range(max(1, p - DEGREES_BELOW), p + 1)
        fits = NestedFits(np.where(used, p, 0), {q: truncated(coefficients, d, p, q) for q in below})
        return fits, promising

    def _corrections(self, kept: list[Array], sums: list[_PartSums], power: NDArray[np.intc]) -> tuple[Array, Indices]:
        """What is subtracted from the plain means, and the degrees of P, 0 for the plain mean: both (nets, fields).

        That is the mean of P over the net, less its integral.
        """
        found = np.zeros((self.count, len(sums[0].means)))
        if self.grid is None:
            fits, promising = [self._fits(group, kept, sums) for group in self.groups], np.ones(found.shape, dtype=bool)
        else:
            of_grid, promising = self._of_grid(sums, power)
            fits = [of_grid]
        degrees = np.zeros(found.shape, dtype=np.intp)
        for group, others in zip(self.groups, reversed(fits), strict=True):
            top = int(others.degrees.max(initial=0))
            if top == 0:
                continue
            terms = [self._term_means(self.nets[r], top) for r in group]
            for field in np.flatnonzero(others.degrees):
                candidates = self._candidates(others, int(field), top)
                parts = np.stack([np.einsum("ct,pt->cp", candidates[:, 1:], of_net[:, 1:]) for of_net in terms])
                best = _best(parts, np.stack([sums[r].means[field] for r in group]))
                best = np.where(promising[group, field], best, -1)
                chosen = np.take_along_axis(parts.mean(axis=-1), np.maximum(best, 0)[:, None], axis=1)[:, 0]
                found[group, field] = np.where(best < 0, 0.0, chosen)
                degrees[group, field] = np.where(best < 0, 0, _candidate_degrees(others.degrees[field])[best])
        return found, degrees

    def _candidates(self, fits: NestedFits, field: int, top: int) -> Array:
        """Coefficients (candidates, terms) for a component: its highest degrees, as of degree `top`."""
        degrees = _candidate_degrees(fits.degrees[field])
        rows = [embedded(fits.coefficients[p][field : field + 1], self.integrand.d, p, top) for p in degrees.tolist()]
        return np.concatenate(rows)

    def _term_means(self, net: _core.SobolNet, degree: int) -> Array:
        """Means (parts, terms) over the parts of a net."""
        terms = terms_of(self.integrand.d, degree)
        at_once = min(POINTS_AT_ONCE, self.m)
        of_a_call = max(1, at_once * self.parts // self.m)
        found = [
            terms.means(net.points(begin, at_once), of_a_call, self.threads) for begin in range(0, self.m, at_once)
        ]
        means: Array = np.concatenate(found).reshape(self.parts, -1, len(terms)).mean(axis=1)
        return means

    def _estimate(
        self, corrections: Array, kept: list[Array], sums: list[_PartSums], power: NDArray[np.intc]
    ) -> Estimate:
        plain = np.stack([s.means.mean(axis=1) for s in sums])
        samples, means = self.count * self.m, plain - corrections
        absolute, square = (np.mean(x, axis=0) for x in ([s.absolute for s in sums], [s.square for s in sums]))
        rounding = ROUNDING * self.integrand.epsilon * (absolute + np.abs(corrections).mean(axis=0))
        spread = self.scale * means.std(axis=0, ddof=1) / math.sqrt(self.count)
        first = min(MOST, self.fitted)
        of_nets = np.stack([net.points(0, first).T for net in self.nets])
        spread = np.maximum(spread, np.sqrt(of_steps(of_nets, np.stack([y[:, :first] for y in kept]), self.m)))
        empty = self.integrand.empty
        tails = [[y[field] for y in kept] for field in range(len(power))]
        warnings = [] if empty else unresolved(samples * absolute, samples * square, square == 0, samples, tails)
        mean, error, rounding = (np.ldexp(v, power) for v in (means.mean(axis=0), np.hypot(spread, rounding), rounding))
        deviations = (means - means.mean(axis=0)).T
        n = self.cells + samples
        return Estimate(mean, error, rounding, n, self.count - 1, tuple(warnings), deviations)


class _PartSums:
    """Means of values over the parts of a net, (fields, parts), and of |f| and f² over all of it, (fields,)."""

    def __init__(self, fields: int, m: int, parts: int):
        self.m, self.part = m, m // parts
        self.means = np.zeros((fields, parts))
        self.absolute, self.square = np.zeros((2, fields))

    def add(self, begin: int, values: Array) -> None:
        """Take values (fields, n) from point `begin` on: whole parts, or less than one."""
        n = values.shape[1]
        at = slice(begin // self.part, -(-(begin + n) // self.part))
        self.means[:, at] += values.reshape(len(values), -1, min(n, self.part)).sum(axis=-1) / self.part
        self.absolute += np.abs(values).sum(axis=1) / self.m
        self.square += np.square(values).sum(axis=1) / self.m

    def rescale(self, shift: NDArray[np.intc]) -> None:
        """The same of values times 2^shift, (fields,)."""
        self.means, self.absolute = np.ldexp(self.means, shift[:, None]), np.ldexp(self.absolute, shift)
        self.square = np.ldexp(self.square, 2 * shift)


def _best(parts: Array, plain: Array) -> Indices:
    """For each net the candidate (nets,) with the least residuals on the others of its group, −1 for the plain mean.

    Given are means over the parts of each net, which are nets, too: of the candidates (nets, candidates, parts), and of
    the values (nets, parts). The criterion is not the size of residuals but their error in the mean over a net. There
    the plain mean is hard to beat, and it is left only where a tenth of its squared error or less remains.
    """
    scores, of_plain = (plain[:, None] - parts).var(axis=-1), plain.var(axis=-1)
    elsewhere, plain_elsewhere = _of_others(scores), _of_others(of_plain)
    best = np.argmin(elsewhere, axis=1)
    least = np.take_along_axis(elsewhere, best[:, None], axis=1)[:, 0]
    return np.where(least < WORTH * plain_elsewhere, best, -1)


def _of_others(scores: Array) -> Array:
    """For each net the sum over all others; a difference from the whole sum would hold the rounding of its own."""
    return np.stack([np.delete(scores, r, axis=0).sum(axis=0) for r in range(len(scores))])


def _candidate_degrees(highest: int) -> Indices:
    """Those of a component, whose fits go up to the highest."""
    return np.arange(max(1, highest - DEGREES_BELOW), highest + 1)


def _told(degrees: Indices) -> tuple[str, ...]:
    """What corrects the replicates, by component, from degrees (nets, fields); 0 is the plain mean.

    Examples
    --------
    >>> import numpy as np
    >>> from voroquad.integrals.replicates import _told
    >>> _told(np.array([[6, 0], [6, 0], [0, 0], [6, 0]]))
    ('polynomials of degree 6 in 3 of 4 replicates, plain mean in 1', 'plain mean')
    """
    names = [*(f"polynomials of degree {p}" for p in range(1, degrees.max(initial=0) + 1)), "plain mean"]
    return told(names, (degrees.T[None] - 1) % len(names), "replicates")


def _shift(values: Array, power: NDArray[np.intc], before: Array) -> NDArray[np.intc]:
    """What brings components (fields,) to new units: of values (fields, n) far above theirs, or the first but 0."""
    size, needed = np.frexp(_largest(values))
    other = (size > 0) & ((before == 0) | (needed > power + ROOM))
    return np.where(other, power - needed, 0).astype(np.intc)


def _largest(values: Array) -> Array:
    largest = np.maximum(values.max(axis=1), -values.min(axis=1))
    if np.isfinite(largest).all():
        return largest
    return np.abs(values).max(axis=1, initial=0, where=np.isfinite(values))
