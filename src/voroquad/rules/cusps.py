"""What a power or a logarithm inside the line adds to the error of a single set.

Around a cusp, b + A |x − a|^β, the slopes on both sides are those of an end (:mod:`voroquad.rules.ends`): they fall off
as powers of the distance. The samples next to the cusp tell little of what it adds to the error, but both sides
together tell where it is, and the curve through them what its variance is in the strata there: docs/theory.md, (33).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from .._support.arrays import Array, Indices
from .ends import LEAST, SLOPES, power, powers_of_slopes

#: Where in its stratum a cusp may lie.
PLACES = (0.1, 0.3, 0.5, 0.7, 0.9)

#: Largest root mean square deviation of the logarithms of the slopes from a line, on either side. Of powers and
#: logarithms it is at most .1 for the best of the places, however the samples lie; of narrow peaks it is more.
STRAIGHT = 0.1

#: The largest exponent of a cusp: above, other parts of the error bar do as well.
MOST = 0.6

#: Exponents below count as this one in a variance, which is infinite from −½ on.
OF_VARIANCE = -0.4

#: Nodes and weights for means over 0 ≤ t ≤ 1 of powers and logarithms, and of what is smooth.
_UNIFORM, _OF_UNIFORM = (np.polynomial.legendre.leggauss(16)[0] + 1) / 2, np.polynomial.legendre.leggauss(16)[1] / 2
NODES, WEIGHTS = _UNIFORM**5, 5 * _UNIFORM**4 * _OF_UNIFORM
EVENLY = (np.arange(16) + 0.5) / 16

#: Strata on either side in which the same cusp may be seen.
BESIDE = 2


def of_cusps(points: Array, values: Array) -> Array:
    """The variance of the sum of one value in each stratum that cusps make in theirs and beside it: (fields,).

    0 where there is no cusp.

    Parameters
    ----------
    points : ndarray, (n,)
        In the order of their strata.
    values : ndarray, (fields, n)
        Of the integrands.

    Examples
    --------
    >>> import numpy as np
    >>> from voroquad.rules.cusps import of_cusps
    >>> x = (np.arange(40) + 0.5) / 40
    >>> of_cusps(x, np.stack([np.log(np.abs(x - 0.51)), np.abs(x - 0.51), np.exp(-((x - 0.51) ** 2))])).round(2)
    array([1.43, 0.  , 0.  ])
    """
    n = len(points)
    field, i = _candidates(points, values)
    found = np.zeros(len(values))
    if not len(i):
        return found
    beside = np.arange(1, SLOPES + 2)
    sides = [(n * (points[i[:, None] + s * beside] - i[:, None] / n), values[field[:, None], i[:, None] + s * beside])
             for s in (-1, 1)]  # fmt: skip
    straightest, variance = np.full(len(i), STRAIGHT), np.zeros(len(i))
    for place in PLACES:
        away = [(abs(t - place), f) for t, f in sides]
        told = [powers_of_slopes(t, f) for t, f in away]
        off = np.maximum(told[0][1], told[1][1])
        taken = (off < straightest) & np.all([(b >= LEAST) & (b <= MOST) for b, _ in told], axis=0)
        straightest = np.where(taken, off, straightest)
        variance[taken] = _variance(
            (told[0][0] + told[1][0])[taken] / 2, place, *((t[taken], f[taken]) for t, f in away)
        )
    variance = np.where(_straightest_around(field, i, straightest, values.shape), variance, 0)
    np.add.at(found, field, variance)
    return found


def _candidates(points: Array, values: Array) -> tuple[Indices, Indices]:
    """Fields and strata where values rise, or fall, towards the stratum from both sides and ever more steeply."""
    none = np.empty(0, dtype=np.intp)
    if len(points) < 2 * SLOPES + 3:
        return none, none
    slopes = np.diff(values) / np.diff(points)
    signs = sliding_window_view(np.sign(slopes), SLOPES, axis=1).sum(axis=-1)
    before, after = signs[:, : -SLOPES - 2], signs[:, SLOPES + 2 :]
    steep = abs(slopes)
    count = before.shape[1]
    nearer = (steep[:, SLOPES - 1 :][:, :count] > steep[:, :count]) & (
        steep[:, SLOPES + 2 :][:, :count] > steep[:, 2 * SLOPES + 1 :][:, :count]
    )
    field, first = np.nonzero((before * after == -(SLOPES**2)) & nearer)
    return field, first + SLOPES + 1


def _straightest_around(field: Indices, i: Indices, off: Array, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Which strata are the straightest of those nearby, since a cusp may be seen from strata beside its own."""
    fields, n = shape
    whole = np.full((fields, n + 2 * BESIDE), np.inf)
    whole[field, i + BESIDE] = off
    nearby = np.min([whole[field, i + k] for k in range(2 * BESIDE + 1)], axis=0)
    return off <= nearby


def _variance(beta: Array, place: float, left: tuple[Array, Array], right: tuple[Array, Array]) -> Array:
    """That over the stratum of a cusp and over those beside it, added up: (m,).

    Of the curves with exponents β (m,) on either side, through the nearest two values (m, 2) at t.
    """
    beta = np.maximum(beta, OF_VARIANCE)
    curves = [_continued(beta, *side) for side in (left, right)]
    own = np.concatenate([curve(part * NODES) for curve, part in zip(curves, (place, 1 - place), strict=True)], axis=1)
    weights = np.concatenate([place * WEIGHTS, (1 - place) * WEIGHTS])
    outside = [curve(part + EVENLY) for curve, part in zip(curves, (place, 1 - place), strict=True)]
    variance: Array = np.square(own) @ weights - np.square(own @ weights) + np.var(outside, axis=2).sum(axis=0)
    return variance


def _continued(beta: Array, t: Array, f: Array) -> Callable[[Array], Array]:
    """The curves with exponents β (m,) through the nearest two values (m, 2) at t, as a function of t (k,): (m, k)."""
    curve = power(t[:, :2], beta)
    slope = ((f[:, 1] - f[:, 0]) / (curve[:, 1] - curve[:, 0]))[:, None]
    first, at = f[:, :1], curve[:, :1]
    return lambda t: first + slope * (power(t, beta) - at)
