"""Error bars of one set, read off what its samples correct.

The estimate is the sum over the strata of the integrals of predictions P_i and of corrections |S_i| (f_i − P_i(x_i)).
Where corrections r are independent, Σ r² tells the variance of its error. They are not where a sample spoils the
predictions of its neighbours, and few of them are large where an integrand has an end with a power. So a bar is the
widest of several, and Student's t distribution makes up for the few corrections that one rests on
(docs/theory.md, (32)).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtrit

from .._support.arrays import Array, Indices
from .ends import deviations

#: The level at which intervals of several kinds are compared.
LEVEL = 0.975
NORMAL = float(ndtri(LEVEL))

#: What the squared correction of a stratum at an end of the line counts at least: there the parabola is extrapolated.
OF_ENDS = 0.25

#: How many times half an interval is what curves with the exponents of the ends leave of the means there, at least.
OF_CURVES = 1.5

#: Fewest degrees of freedom that are told. With one or two, intervals of other levels would be far too wide or narrow.
FEWEST_DEGREES = 3.0


@dataclass(frozen=True)
class ErrorBar:
    """Standard errors and degrees of freedom of Student's t distribution, by field."""

    error: Array
    degrees_of_freedom: Array


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
    V_i is the variance over S_i of the parabola through what P_i misses of its three nearest samples. Where the order
    has adapted to the integrand, so that corrections are far smaller than those of a fixed order, each is one of many
    tries and counts for more degrees of freedom.
    """
    n = len(points)
    variances = _variances_of_parabolas(points, around)
    variances[:, [0, -1]] = np.maximum(variances[:, [0, -1]], OF_ENDS * np.square(residuals[:, [0, -1]]))
    adapted = _adapted(_neighbours_on_line(np.square(residuals)), _neighbours_on_line(np.square(reference)))
    freedom = 1 + 0.5 * np.maximum(_effective(variances, 1 + 4 * adapted**6) - 1, 0)
    squares = np.square(residuals)
    plain = (0.75 + 0.15 * np.minimum(1, _effective(squares) / 40)) * np.sqrt(squares.sum(axis=-1))
    ends = OF_CURVES / NORMAL * deviations(points, values, around).sum(axis=-1)
    return _widest([plain / n, ends / n], np.sqrt(variances.sum(axis=-1)) / n, freedom)


def in_plane(points: Array, strata: tuple[int, ...], colours: Indices, residuals: Array, reference: Array) -> ErrorBar:
    """The bar of models that are chosen by colour, for multi-jittered samples.

    Parameters
    ----------
    points : ndarray, (n, 2)
        In C order of their strata.
    strata : tuple of int
        Numbers of strata along the axes.
    colours : ndarray, (n,)
        Of the strata.
    residuals, reference : ndarray, (fields, n)
        What samples correct of the chosen predictions, and of local parabolas.

    Notes
    -----
    Samples of one colour and slab are evenly spread along the slab's axis. Where corrections follow that coordinate, as
    beside an edge along the axes, only the differences of neighbours in it make error.
    """
    n = len(points)
    squares = np.square(residuals)
    spread = _spread(points, strata, colours, residuals)
    border = _border(points, strata)
    variances = np.where(np.isnan(border), spread * squares / 3, border * squares)
    adapted = _adapted(_neighbours_in_plane(squares, strata), _neighbours_in_plane(np.square(reference), strata))
    freedom = 1 + 0.7 * np.maximum(_effective(variances, 1 + 2 * adapted**100) - 1, 0)
    plain = [np.sqrt((spread * squares).sum(axis=-1)) / n, 0.5 * np.sqrt(squares.sum(axis=-1)) / n]
    return _widest(plain, np.sqrt(variances.sum(axis=-1)) / n, freedom)


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


def _neighbours_in_plane(squares: Array, strata: tuple[int, ...]) -> Array:
    """Sums (fields, n) over each stratum and the eight around it."""
    padded = np.pad(squares.reshape(-1, *strata), ((0, 0), (1, 1), (1, 1)))
    rows = padded[:, :-2] + padded[:, 1:-1] + padded[:, 2:]
    return (rows[:, :, :-2] + rows[:, :, 1:-1] + rows[:, :, 2:]).reshape(squares.shape)


def _spread(points: Array, strata: tuple[int, ...], colours: Indices, residuals: Array) -> Array:
    """What the even spread of a colour's samples leaves of the variance of independent ones, (fields, n), from .1 to 1.

    It is half the squared difference of corrections that follow each other along an axis, over their square. Of the two
    axes the one that leaves less counts.
    """
    index = np.indices(strata).reshape(len(strata), -1)
    left = np.ones_like(residuals)
    for a, k in enumerate(strata):
        slab = np.unique(colours * k + index[a], return_inverse=True)[1]
        order = np.lexsort((points[:, a] * k - index[a], slab))
        r, slabs = residuals[:, order], slab[order]
        size = np.bincount(slab)
        same = (slabs[1:] == slabs[:-1]).astype(float)
        steps = np.zeros((len(residuals), len(size)))
        squares = np.zeros_like(steps)
        for field in range(len(residuals)):
            steps[field] = np.bincount(slabs[1:], np.square(np.diff(r[field])) * same, minlength=len(size))
            squares[field] = np.bincount(slabs, np.square(r[field]), minlength=len(size))
        factor = np.divide(size, 2 * (size - 1), out=np.zeros(len(size)), where=size > 1)
        part = np.divide(factor * steps, squares, out=np.ones_like(steps), where=(squares > 0) & (size > 1))
        left = np.minimum(left, np.clip(part, 0.1, 1)[:, slab])
    return left


def _border(points: Array, strata: tuple[int, ...], slack: float = 0.3) -> Array:
    """The factor (n,) of a correction's square in the variance of a stratum at the border; NaN inside.

    What a prediction misses, taken as δ(t) ∝ 1 + ε − t at t strata from the border, is known at one place only. The
    factor, a product over the axes that touch the border, is the mean of δ² over the stratum over its value there.
    """
    factors, touched = np.ones(len(points)), np.zeros(len(points), dtype=bool)
    for a, k in enumerate(strata):
        place = points[:, a] * k
        distance = np.minimum(place, k - place)
        at_border = distance < 1
        factor = ((1 + slack) ** 3 - slack**3) / (3 * np.square(1 + slack - distance))
        factors *= np.where(at_border, np.clip(factor, 1, 9), 1)
        touched |= at_border
    return np.where(touched, factors, np.nan)
