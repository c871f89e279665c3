"""What a power of the distance from a point adds to the error of a single set.

Such a point, a *pole* here, may be a corner of the box or lie anywhere. Its stratum has the value that is farthest from
the others. The means of the values over rings of strata around it fall off as a power of what the rings enclose,
whatever the integrand does along a ring. So the exponent is known, and with it the variance within the stratum of the
pole, even if the sample there lies far from it: docs/theory.md, (35).
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from .._support.arrays import Array, Indices
from .cusps import NODES, OF_VARIANCE, WEIGHTS
from .ends import power, power_of

#: Most rings about a stratum that tell the exponent, and the fewest.
RINGS, FEWEST_RINGS = 6, 4

#: Largest root mean square deviation of the logarithms of the slopes from a line.
STRAIGHT = 0.3

#: The exponents of poles, as powers of a volume: below there is no integral, above the error is small.
LEAST, MOST = -1.0, -0.2

#: Part of the squared differences to the first ring above which squared corrections say that the models do not resolve
#: the pole.
UNRESOLVED = 0.003

#: Part of what the power promises at the border of its stratum by which the value there exceeds the first ring at
#: least: the top of a smooth peak does not.
RISES = 0.35

#: How many times the squared corrections there the variance is at most: inside, where neighbours on all sides betray a
#: pole, and in a corner, where models extrapolate it.
MOST_TIMES, MOST_TIMES_IN_CORNER = 8.0, 100.0


def of_poles(strata: tuple[int, ...], values: Array, residuals: Array) -> Array:
    """The variance of the sum of one value in each stratum that the pole of each integrand makes: (fields,).

    0 where there is none.

    Parameters
    ----------
    strata : tuple of int
        Numbers of strata along each axis.
    values, residuals : ndarray, (fields, n)
        Of the integrands, in C order of the strata, and what predictions miss of them.

    Examples
    --------
    >>> import numpy as np, voroquad as vq
    >>> from voroquad.rules.poles import of_poles
    >>> x = vq.sample("multi-jittered", 144, 2, rng=1).points
    >>> r = np.hypot(*(x - 0.31).T)
    >>> values = np.stack([1 / r, r, np.exp(-r)])
    >>> of_poles((12, 12), values, values) > 0
    array([ True, False, False])
    """
    total = np.zeros(len(values))
    extreme = np.abs(values - np.median(values, axis=1, keepdims=True)).argmax(axis=1)
    for stratum in np.unique(extreme).tolist():
        rings = _rings(strata, stratum)
        if len(rings.starts) >= FEWEST_RINGS:
            own = extreme == stratum
            total[own] = _of_pole(rings, values[own], residuals[own])
    return total


class _Rings(NamedTuple):
    """Rings of strata about one."""

    centre: int
    strata: Indices  # of all rings, ring after ring
    starts: Indices  # of each ring in these
    enclosed: Array  # how many strata there are within the first ring, and with each ring
    in_corner: bool  # of the box


@lru_cache(maxsize=64)
def _rings(strata: tuple[int, ...], extreme: int) -> _Rings:
    """The rings about the stratum with the extreme value, or about the corner beside it.

    In a corner that is a pole, the sample of a stratum next to it may be nearer than its own.
    """
    centre = np.array(np.unravel_index(extreme, strata))
    ends = np.where(centre < 2, 0, np.array(strata) - 1)
    in_corner = bool((np.abs(centre - ends) <= 1).all())
    if in_corner:
        centre = ends
    offsets = np.indices(strata).reshape(len(strata), -1) - centre[:, None]
    away = np.abs(offsets).max(axis=0)
    counts = np.bincount(away)[: RINGS + 1]
    order = np.argsort(away, kind="stable")[1 : counts.sum()]
    starts = np.concatenate([[0], np.cumsum(counts[1:-1])])
    number = int(np.ravel_multi_index(tuple(centre), strata))
    return _Rings(number, order, starts, np.cumsum(counts).astype(float), in_corner)


def _of_pole(rings: _Rings, values: Array, residuals: Array) -> Array:
    """The variance in the stratum that rings are about: (fields,)."""
    first, at_centre = values[:, rings.strata[: rings.starts[1]]], values[:, rings.centre]
    squares = np.square(residuals[:, rings.strata[: rings.starts[1]]]).sum(axis=1)
    squares += np.square(residuals[:, rings.centre])
    steps = np.square(first - at_centre[:, None]).sum(axis=1)
    found = np.zeros(len(values))
    unresolved = squares > UNRESOLVED * steps
    if unresolved.any():
        sums = np.add.reduceat(values[unresolved][:, rings.strata], rings.starts, axis=1)
        variance = _variance(rings.enclosed, at_centre[unresolved], sums / np.diff(rings.enclosed))
        most_times = MOST_TIMES_IN_CORNER if rings.in_corner else MOST_TIMES
        found[unresolved] = np.minimum(variance, most_times * squares[unresolved])
    return found


def _variance(enclosed: Array, at_centre: Array, means: Array) -> Array:
    """The variance over the part 0 ≤ t ≤ 1 that rings are about of b + A t^β: (fields,).

    Means (fields, rings) are those of the rings, from t = `enclosed` on, and `at_centre` (fields,) is one value within.
    """
    places = (enclosed[1:] + enclosed[:-1]) / 2
    slopes = np.diff(means) / np.diff(places)
    beta, off = power_of(np.sqrt(places[1:] * places[:-1]), slopes)
    known = (off <= STRAIGHT) & (beta >= LEAST) & (beta <= MOST)
    beta = np.maximum(np.where(known, beta, MOST), OF_VARIANCE)
    border, nearer, farther = power(np.array([1.0, *places[:2]]), beta).T
    amount = np.where(known, (means[:, 1] - means[:, 0]) / (farther - nearer), 0.0)
    promised = amount * (border - nearer)
    known &= (at_centre - means[:, 0]) * np.sign(promised) >= RISES * np.abs(promised)
    curve = power(NODES, beta)
    of_curve = np.square(curve) @ WEIGHTS - np.square(curve @ WEIGHTS)
    variance: Array = np.where(known, np.square(amount) * of_curve, 0.0)
    return variance
