"""What a power or a logarithm at the faces of a box adds to the error of a single set.

Along an axis, from stratum to stratum, the slopes of a power of the distance from a face fall off as those at an end of
the line do (:mod:`voroquad.rules.ends`), whatever the integrand does along the face. The median over the face of each
slope is little disturbed by that. So the exponent is known, and with it the variance in the strata at the face, even
if no sample lies close to it: docs/theory.md, (35).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from .. import _core
from .._support.arrays import Array, Indices
from .cusps import EVENLY, NODES, OF_VARIANCE, WEIGHTS
from .ends import power, power_of

#: Slabs from a face on that tell its exponent, and the fewest: the first of them tells nothing.
SLABS, FEWEST_SLABS = 8, 6

#: Largest root mean square deviation of the logarithms of the median slopes from a line. It is larger than at an end,
#: since functions that vary along the face disturb them.
STRAIGHT = 0.21

#: The exponents of faces. Above, Student's t makes up for the few corrections that are large.
LEAST, MOST = -1.2, 0.25

#: Part of the squared differences to the strata next to a face above which squared corrections there say that the
#: models do not resolve it.
UNRESOLVED = 0.01

#: Fewest points of a replicate: of fewer, the nearest to a face are far from each other.
FEWEST_OF_REPLICATE = 64

#: How many times the squared corrections at a face its variance is at most.
MOST_TIMES = 12.0


def of_faces(points: Array, strata: tuple[int, ...], colours: Indices, values: Array, residuals: Array) -> Array:
    """The variance of the sum of one value in each stratum that powers at the faces make: (fields,).

    Parameters
    ----------
    points : ndarray, (n, d)
        Of multi-jittered strata, in their C order.
    strata : tuple of int
        Numbers of strata along each axis.
    colours : ndarray, (n,)
        Of the strata.
    values, residuals : ndarray, (fields, n)
        Of the integrands, and what predictions miss of them.
    """
    total = np.zeros(len(values))
    of_all = _core.powers_of_slabs(points, strata, np.ascontiguousarray(values), FEWEST_SLABS, SLABS)
    for number, (beta, off, first, second) in enumerate(of_all.swapaxes(0, 1)):
        known = (off <= STRAIGHT) & (beta >= LEAST) & (beta <= MOST) & (first * second > 0)
        if not known.any():
            continue
        a, from_high = divmod(number, 2)
        slabs, x = _slabs(strata)[a], points[:, a]
        order, along = (slabs[::-1][:SLABS], 1 - x) if from_high else (slabs[:SLABS], x)
        squares = np.square(residuals[:, order[0]]).sum(axis=1)
        steps = np.square(values[:, order[1]] - values[:, order[0]]).sum(axis=1)
        known = known & (squares > UNRESOLVED * steps)
        if known.any():
            f = values[:, order]
            places, slopes = _median_slopes(strata[a] * along[order], f)
            beta = np.maximum(beta[known], OF_VARIANCE)
            amount = _amount(slopes[known, 1], places[1], beta)
            found = _variance(beta, amount[:, None] * _along_face(f[:, 1:][known]), colours[order[0]])
            total[known] += np.minimum(found, MOST_TIMES * squares[known])
    return total


@lru_cache(maxsize=32)
def _slabs(strata: tuple[int, ...]) -> list[Indices]:
    """The strata (k, m) of each slab across each axis."""
    numbers = np.arange(math.prod(strata)).reshape(strata)
    return [np.moveaxis(numbers, a, 0).reshape(k, -1) for a, k in enumerate(strata)]


def of_replicates(points: Array, values: Array) -> Array:
    """The variance of the mean over replicates that powers at the faces make: (fields,).

    Predictions from other replicates do not see them. 0 where points are not evenly spread, or fewer than
    :data:`FEWEST_OF_REPLICATE`.

    Parameters
    ----------
    points : ndarray, (sets, n, d)
        Independent replicates. Of evenly spread points each n-th part of each axis holds one of each replicate, as of
        Sobol' points if n is a power of two.
    values : ndarray, (sets, fields, n)
        Of integrands, at the points.
    """
    sets, n, _ = points.shape
    total = np.zeros(values.shape[1])
    if n < FEWEST_OF_REPLICATE:
        return total
    for along in (points, 1 - points):
        nearest = np.argpartition(along, SLABS, axis=1)[:, :SLABS]
        order = np.take_along_axis(nearest, np.take_along_axis(along, nearest, 1).argsort(axis=1), 1)
        t = n * np.take_along_axis(along, order, 1)
        evenly = (np.floor(t) == np.arange(SLABS)[:, None]).all(axis=(0, 1))
        for a in np.flatnonzero(evenly):
            f = np.stack([of_set[:, i] for of_set, i in zip(values, order[:, 1:, a], strict=True)], axis=-1)
            places, slopes = _median_slopes(t[:, 1:, a].T, f)
            beta, off = power_of(places, slopes)
            known = (off <= STRAIGHT) & (beta >= LEAST) & (beta <= MOST)
            if known.any():
                beta = np.maximum(beta[known], OF_VARIANCE)
                amount = _amount(slopes[known, 0], places[0], beta)
                total[known] += np.square(amount) * np.sum([_of_power(beta, j, 1) for j in range(SLABS)], axis=0)
    return total / (sets * n**2)


def _median_slopes(t: Array, f: Array) -> tuple[Array, Array]:
    """Places (k − 1,) and medians over the rows of slopes (fields, k − 1), of values (fields, k, m) at t (k, m)."""
    found = _core.places_and_slopes(np.ascontiguousarray(t), np.ascontiguousarray(f))
    return found[0], found[1:]


def _amount(slopes: Array, place: float, beta: Array) -> Array:
    """A of powers A t^β / β with slopes (fields,) at a place."""
    found: Array = np.abs(slopes) * place ** (1 - beta)
    return found


def _along_face(f: Array) -> Array:
    """How much larger than in their median the values (fields, slabs, m) are in each row of strata: (fields, m).

    1 where they have no common sign.
    """
    rows = f.mean(axis=1)
    one_sign = (np.sign(rows) == np.sign(rows[:, :1])).all(axis=1, keepdims=True) & (rows != 0).all(
        axis=1, keepdims=True
    )
    relative: Array = np.where(one_sign, rows / np.median(np.where(one_sign, rows, 1), axis=1, keepdims=True), 1)
    return relative


def _variance(beta: Array, amounts: Array, colours: Indices) -> Array:
    """Of the sum over the strata at a face of amounts (fields, m) times the powers β (fields,): (fields,).

    The m_c samples of a colour are evenly spread: one in each of m_c parts of the strata. Equal amounts have the
    variance within the parts, and the differences of amounts that over the whole.
    """
    total = np.zeros(len(beta))
    whole = _of_power(beta, 0, 1)
    for c in np.unique(colours):
        own = amounts[:, colours == c]
        m = own.shape[1]
        mean = own.mean(axis=1)
        within = np.sum([_of_power(beta, j / m, 1 / m) for j in range(m)], axis=0)
        total += np.square(own - mean[:, None]).sum(axis=1) * whole + np.square(mean) * within
    return total


def _of_power(beta: Array, first: float, width: float) -> Array:
    """The variance of (t^β − 1)/β over an interval: (fields,)."""
    nodes, weights = (NODES, WEIGHTS) if first == 0 else (EVENLY, np.full(len(EVENLY), 1 / len(EVENLY)))
    curve = power(first + width * nodes, beta)
    variance: Array = np.square(curve) @ weights - np.square(curve @ weights)
    return variance
