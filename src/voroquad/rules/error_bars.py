"""Error bars of one set, read off what its samples correct.

The estimate is the sum over the strata of the integrals of predictions P_i and of corrections |S_i| (f_i − P_i(x_i)).
Where corrections r are independent, Σ r² tells the variance of its error. They are not where a sample spoils the
predictions of its neighbours, and few of them are large where an integrand has an end with a power. So a bar is the
widest of several, and Student's t distribution makes up for the few corrections that one rests on
(docs/theory.md, (32)).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import ndtri, stdtrit

from .._support.arrays import Array, Indices
from .cusps import of_cusps
from .ends import at_faces, deviations
from .faces import of_faces
from .poles import of_poles

#: The level at which intervals of several kinds are compared.
LEVEL = 0.975
NORMAL = float(ndtri(LEVEL))

#: What the squared correction of a stratum at an end of the line counts at least: there the parabola is extrapolated.
OF_ENDS = 0.2

#: How many times half an interval is what curves with the exponents of ends leave of the means there, at least.
OF_CURVES = 1.5

#: Factor of the standard error by what differs within strata where it rests on a single one, and on so many.
OF_ONE, OF_MANY, MANY = 0.88, 0.95, 20

#: How many degrees of freedom the variance of a stratum inside the line counts for, against that of one at an end, and
#: how many each degree after the first: they are not independent.
INSIDE, OF_OTHERS = 1.5, 0.45

#: The least part of the variance that is believed to be left where corrections follow a coordinate, and as how many
#: second differences of each index along an axis those of all count.
LEAST_SPREAD, OF_ALL = 0.05, 2.0

#: Part of the squared differences between neighbours below which squared corrections say that models resolve the
#: integrand.
RESOLVED = 0.001

#: Fewest degrees of freedom that are told. With one or two, intervals of other levels would be far too wide or narrow.
FEWEST_DEGREES = 3.0


@dataclass(frozen=True)
class ErrorBar:
    """Standard errors and degrees of freedom of Student's t distribution, by field."""

    error: Array
    degrees_of_freedom: Array

    def with_equal_freedom(self) -> tuple[Array, float]:
        """Standard errors that keep the 95 % intervals with the fewest degrees of freedom of any field, and these."""
        fewest = float(self.degrees_of_freedom.min(initial=np.inf))
        return self.error * (stdtrit(self.degrees_of_freedom, LEVEL) / stdtrit(fewest, LEVEL)), fewest


def of_corrections(residuals: Array, scale: float = 1.0) -> ErrorBar:
    """(Σ r²)^½ / n times a scale, for corrections (fields, n).

    The degrees of freedom are (Σ r²)² / Σ r⁴: so many equal corrections would make as certain a sum of squares.
    """
    squares = np.square(residuals)
    total = squares.sum(axis=-1)
    error = scale * np.sqrt(total) / residuals.shape[-1]
    return ErrorBar(error, np.maximum(_effective(squares), 1.0))


def on_line(points: Array, values: Array, residuals: Array, around: Array, reference: Array) -> ErrorBar:
    """The bar of orders that are chosen by stratum.

    Parameters
    ----------
    points : ndarray, (n,)
        In the order of their strata.
    values : ndarray, (fields, n)
        Of the integrands.
    residuals, around, reference : ndarray, (fields, n), (fields, n, 3), (fields, n)
        As :class:`voroquad.rules.line_fits.LineChoice` has them.

    Notes
    -----
    V_i is the variance over S_i of the parabola through what P_i misses of its three nearest samples, and Δ_i their
    second difference, whose mean square is six times the variance of misses that are independent. The parabola is right
    where what is missed is smooth, and Δ where it is rough; where both exceed the correction, that counts. Where the
    order has adapted to the integrand, so that corrections are far smaller than those of a fixed order, each is one of
    many tries and counts for more degrees of freedom.
    """
    n = len(points)
    squares = np.square(residuals)
    variances = _variances_of_parabolas(points, around)
    seconds = np.square(around[..., 0] - 2 * around[..., 1] + around[..., 2])
    either = np.minimum(variances + seconds / 6, squares)
    variances[:, [0, -1]] = np.maximum(variances[:, [0, -1]], OF_ENDS * squares[:, [0, -1]])
    adapted = _adapted(_neighbours_on_line(squares), _neighbours_on_line(np.square(reference)))
    each = (1 + 4 * adapted**6) * np.where((np.arange(n) == 0) | (np.arange(n) == n - 1), 1, INSIDE)
    freedom = 1 + OF_OTHERS * np.maximum(_effective(variances, each) - 1, 0)
    factor = OF_ONE + (OF_MANY - OF_ONE) * np.minimum(1, _effective(either) / MANY)
    curves = OF_CURVES / NORMAL * deviations(points, values, around).sum(axis=-1)
    plain = [factor * np.sqrt(either.sum(axis=-1)), curves, np.sqrt(of_cusps(points, values))]
    return _widest([x / n for x in plain], np.sqrt(variances.sum(axis=-1)) / n, freedom)


def in_box(points: Array, strata: tuple[int, ...], colours: Indices, values: Array, residuals: Array) -> ErrorBar:
    """The bar of models that are chosen by colour, for multi-jittered samples.

    Parameters
    ----------
    points : ndarray, (n, d)
        In C order of their strata.
    strata : tuple of int
        Numbers of strata along the axes.
    colours : ndarray, (n,)
        Of the strata.
    values, residuals : ndarray, (fields, n)
        Of the integrands, and what samples correct of the chosen predictions.

    Notes
    -----
    Samples of one colour and slab are evenly spread along the slab's axis. Where corrections follow that coordinate, as
    beside an edge along the axes, only what they do not follow it in makes error. Where models resolve the integrand,
    corrections depend on where in its stratum a sample lies more than on luck, and count for twice as many degrees of
    freedom.
    """
    n = len(points)
    squares = np.square(residuals)
    variances = _spread(points, strata, colours, residuals) * squares
    freedom = np.maximum(_effective(variances), 1.0) * (1 + _resolved(strata, values, squares))
    faces = OF_CURVES / NORMAL * at_faces(points, strata, colours, values, residuals)
    powers = np.sqrt(of_faces(points, strata, colours, values, residuals))
    poles = np.sqrt(of_poles(strata, values, residuals))
    return _widest([faces / n, powers / n, poles / n], np.sqrt(variances.sum(axis=-1)) / n, freedom)


def _widest(plain: list[Array], error: Array, freedom: Array) -> ErrorBar:
    """The bar of the widest interval: normal ones of `plain` errors, Student's t of one with few degrees of freedom.

    Its degrees of freedom are those told, at least :data:`FEWEST_DEGREES`; the error makes its interval as wide.
    """
    normal = np.max(plain, axis=0)
    student = stdtrit(freedom, LEVEL) * error
    told = np.where(student > NORMAL * normal, np.maximum(freedom, FEWEST_DEGREES), np.inf)
    return ErrorBar(np.fmax(student, NORMAL * normal) / stdtrit(told, LEVEL), told)


def _effective(variances: Array, each: Array | float = 1.0) -> Array:
    """(Σ V)² / Σ (V² / g): how many equal V are as many degrees of freedom, with g of each; of none, infinity."""
    variances = variances / np.maximum(variances.max(axis=-1, keepdims=True, initial=0), np.finfo(float).tiny)
    squares = (np.square(variances) / each).sum(axis=-1)
    return np.divide(variances.sum(axis=-1) ** 2, squares, out=np.full(squares.shape, np.inf), where=squares > 0)


def _adapted(chosen: Array, reference: Array) -> Array:
    """How far chosen squares have come below those of reference, from 0 to 1."""
    ratio = np.divide(chosen, reference, out=np.ones_like(chosen), where=reference > 0)
    return np.maximum(1 - ratio, 0)


def _variances_of_parabolas(points: Array, around: Array) -> Array:
    """The variances (fields, n) over each stratum of the parabola through values (fields, n, 3) at the nearest samples.

    With t from 0 to 1 in the stratum, that of a + b t + c t² is b²/12 + b c/6 + 4 c²/45.
    """
    n = len(points)
    i = np.arange(n)
    near = np.clip(i, 1, n - 2)[:, None] + np.arange(-1, 2)
    t = n * points[near] - i[:, None]
    first = (around[..., 1] - around[..., 0]) / (t[:, 1] - t[:, 0])
    second = (around[..., 2] - around[..., 1]) / (t[:, 2] - t[:, 1])
    c = (second - first) / (t[:, 2] - t[:, 0])
    b = first - c * (t[:, 0] + t[:, 1])
    variances: Array = np.square(b) / 12 + b * c / 6 + np.square(c) * (4 / 45)
    return variances


def _neighbours_on_line(squares: Array) -> Array:
    """Sums (fields, n) over each stratum and those beside it."""
    padded = np.pad(squares, ((0, 0), (1, 1)))
    return padded[:, :-2] + padded[:, 1:-1] + padded[:, 2:]


def _resolved(strata: tuple[int, ...], values: Array, squares: Array) -> Array:
    """How far squared corrections (fields, n) have come below squared differences of neighbours: (fields,), 0 to 1."""
    grid = values.reshape(-1, *strata)
    axes = tuple(range(1, grid.ndim))
    steps = np.sum([np.square(np.diff(grid, axis=a)).sum(axis=axes) for a in axes], axis=0)
    total = squares.sum(axis=-1)
    part = np.divide(total, RESOLVED * steps, out=np.ones_like(total), where=steps > 0)
    return np.maximum(1 - part, 0)


def _spread(points: Array, strata: tuple[int, ...], colours: Indices, residuals: Array) -> Array:
    """What the even spread of a colour's samples leaves of the variance of independent ones: (fields, n).

    From :data:`LEAST_SPREAD` to 1. In the order of their coordinate along an axis, three successive corrections of a
    colour in a slab have the second difference r_1 − 2 r_2 + r_3, whose mean square is six times the variance that a
    linear trend leaves, and that of independent corrections. Over all strata with the same index along the axis it is
    compared with what the squares of the corrections make of it. Few second differences say little, so that part is
    drawn towards that of the whole axis. Of the axes that which leaves least counts.
    """
    left = np.ones_like(residuals)
    slabs = _Slabs.along_axes(strata, colours.tobytes())
    for x, k, of in zip(points.T, strata, slabs, strict=True):
        r = residuals[:, np.lexsort((x * k, of.slab))]
        seconds = np.square(r[:, :-2] - 2 * r[:, 1:-1] + r[:, 2:]) * of.within
        found, expected = seconds @ of.by_row[:, 1:-1].T, (np.square(r) * of.of_each) @ of.by_row.T
        of_axis = _part(found.sum(axis=-1, keepdims=True), expected.sum(axis=-1, keepdims=True))
        part = _part(found + of.more * of_axis * expected, (1 + of.more) * expected)
        left = np.minimum(left, np.clip(part, LEAST_SPREAD, 1)[:, of.row])
    return left


def _part(found: Array, expected: Array) -> Array:
    """Of what is expected, 1 of nothing."""
    part: Array = np.divide(found, expected, out=np.ones_like(found), where=expected > 0)
    return part


@dataclass(frozen=True)
class _Slabs:
    """The strata of each colour with the same index along an axis: what does not depend on where samples lie in them.

    Attributes
    ----------
    slab, row : ndarray, (n,)
        The number of the slab, and the index along the axis.
    within : ndarray, (n − 2,)
        1 where three successive strata, slab by slab, are of one slab, else 0.
    of_each : ndarray, (n,)
        How often, squared, a correction is in a second difference, slab by slab.
    by_row : ndarray, (rows, n)
        1 where a stratum has an index, slab by slab.
    more : ndarray, (rows,)
        What the second differences of the whole axis count beside those of an index.
    """

    slab: Indices
    row: Indices
    within: Array
    of_each: Array
    by_row: Array
    more: Array

    @classmethod
    @lru_cache(maxsize=16)
    def along_axes(cls, strata: tuple[int, ...], colours: bytes) -> list[_Slabs]:
        """Those along each axis, with the bytes of the colours (n,)."""
        found = []
        for k, row in zip(strata, np.indices(strata).reshape(len(strata), -1), strict=True):
            slab = np.frombuffer(colours, dtype=np.intp) * k + row
            order = np.argsort(slab, kind="stable")
            within = (slab[order][2:] == slab[order][:-2]).astype(np.float64)
            by_row = (row[order] == np.arange(k)[:, None]).astype(np.float64)
            more = OF_ALL / np.maximum(within @ by_row[:, 1:-1].T, 1)
            found.append(cls(slab, row, within, np.convolve(within, [1.0, 4.0, 1.0]), by_row, more))
        return found
