"""What a power or a logarithm at an end of the line, or at a face of the box, adds to the error of a single set.

The prediction of the stratum at an end is extrapolated, and its only sample tells little of what it misses. But the
exponent β of an integrand that behaves as a + A t^β, t strata from the end, is told by the slopes farther in, which
fall off as t^(β − 1). With it the curve through what is missed at the three nearest samples is known, and so is what
the sample in the stratum leaves of its mean: docs/theory.md, (33).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from .. import _core
from .._support.arrays import Array, Indices

#: Slopes that tell the exponent of an end, from the second sample on, and the fewest samples at a face that do.
SLOPES, FEWEST = 7, 8

#: Largest root mean square deviation of the logarithms of the slopes from a line. Of powers and logarithms it is at
#: most .1, however the samples lie in their strata.
STRAIGHT = 0.2

#: The exponents of ends: what is steeper is a peak, since the integral would not exist; above, parabolas do as well.
LEAST, MOST = -1.0, 0.9


def deviations(points: Array, values: Array, around: Array) -> Array:
    """On a line, what remains of the means over the first and the last stratum, in units of values: (fields, 2).

    0 where slopes follow no power, or one that is no singularity.

    Parameters
    ----------
    points : ndarray, (n,)
        In the order of their strata.
    values : ndarray, (fields, n)
        Of the integrands.
    around : ndarray, (fields, n, 3)
        What predictions of each stratum miss at the three samples nearest to it, in their order.
    """
    n = len(points)
    if n < SLOPES + 2:
        return np.zeros((len(values), 2))
    found = []
    for t, f, missed in (
        (n * points, values, around[:, 0]),
        (n * (1 - points[::-1]), values[:, ::-1], around[:, -1, ::-1]),
    ):
        beta = exponents(t[: SLOPES + 2], f[:, : SLOPES + 2])
        found.append(np.abs(_deviation(beta, t[:3], missed)))
    return np.stack(found, axis=1)


def at_faces(points: Array, strata: tuple[int, ...], colours: Indices, values: Array, residuals: Array) -> Array:
    """In a box, what remains of the sums over the strata at each of its faces, added up over faces: (fields,).

    In the strata at a face, samples of one colour are evenly spread along the axis across it: to what lies next to the
    face they are what the samples of a line are, with as many strata as there are samples of the colour.

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
    some = _singular(*_core.powers_at_faces(points, strata, np.ascontiguousarray(values), FEWEST))
    for number in np.flatnonzero(~np.isnan(some).all(axis=1)).tolist():
        a, from_high = divmod(number, 2)
        face, across = _faces(strata)[a][from_high], points[:, a]
        t = ((1 - across) if from_high else across)[face] * strata[a]
        order = np.argsort(t)
        face, t = face[order], t[order]
        beta, of_face = exponents(t, values[:, face]), colours[face]
        alike = (np.flatnonzero(of_face == c) for c in np.unique(of_face))
        parts = (_deviation(beta, len(i) * t[i[:3]], residuals[:, face[i[:3]]]) for i in alike if len(i) >= 3)
        total += np.abs(sum(parts, np.zeros(len(values))))
    return total


@lru_cache(maxsize=32)
def _faces(strata: tuple[int, ...]) -> list[tuple[Indices, Indices]]:
    """The strata at the two faces across each axis."""
    index = np.indices(strata).reshape(len(strata), -1)
    return [(np.flatnonzero(i == 0), np.flatnonzero(i == k - 1)) for i, k in zip(index, strata, strict=True)]


def exponents(t: Array, values: Array) -> Array:
    """The exponents β of a + A t^β (fields,) from values (fields, m) at t (m,), ascending; NaN where there is none.

    Examples
    --------
    >>> import numpy as np
    >>> from voroquad.rules.ends import exponents
    >>> t = np.arange(9) + 0.5
    >>> exponents(t, np.stack([np.sqrt(t), np.log(t), np.exp(t), np.cos(9 * t)])).round(1) + 0
    array([0.5, 0. , nan, nan])
    """
    return _singular(*powers_of_slopes(t[1:], values[:, 1:]))


def _singular(beta: Array, off: Array) -> Array:
    """The exponents that are those of singularities and whose slopes are straight, of any shape; else NaN."""
    found: Array = np.where((off <= STRAIGHT) & (beta >= LEAST) & (beta <= MOST), beta, np.nan)
    return found


def powers_of_slopes(t: Array, values: Array) -> tuple[Array, Array]:
    """The exponents β for which slopes fall off as t^(β − 1), and how far their logarithms are from that line.

    From values (..., m) at t (..., m), ascending: (...), root mean squares. NaN where slopes differ in sign.
    """
    return power_of((t[..., 1:] + t[..., :-1]) / 2, np.diff(values) / np.diff(t))


def power_of(places: Array, slopes: Array) -> tuple[Array, Array]:
    """The same from slopes (..., m) at places (..., m) or (m,)."""
    m = slopes.shape[-1]
    rows = (np.ascontiguousarray(x, dtype=np.float64).reshape(-1, m) for x in (places, slopes))
    beta, off = _core.powers_of(*rows)
    return beta.reshape(slopes.shape[:-1]), off.reshape(slopes.shape[:-1])


def _deviation(beta: Array, t: Array, missed: Array) -> Array:
    """The mean over 0 ≤ t ≤ 1 of the curve through what is missed at three samples t (3,) less that at the first.

    From exponents (fields,), NaN where there is none, and what is missed (fields, 3): (fields,).
    """
    known = ~np.isnan(beta)
    beta = np.where(known, beta, 1.0)
    curve = power(t, beta)
    of_missed, of_curve = _differences(t, missed), _differences(t, curve)
    amount = np.divide(of_missed[1], of_curve[1], out=np.zeros(len(beta)), where=known)
    bent = -1 / (1 + beta) - curve[:, 0] - (0.5 - t[0]) * of_curve[0]
    return np.where(known, (0.5 - t[0]) * of_missed[0] + amount * bent, 0.0)


def power(t: Array, beta: Array) -> Array:
    """(t^β − 1)/β, and log t at β = 0: (fields, m) at t (m,) or (fields, m); its mean over [0, 1] is −1/(1 + β)."""
    beta = _apart_from_0(beta)[:, None]
    powers: Array = np.expm1(beta * np.log(t)) / beta
    return powers


def _apart_from_0(beta: Array) -> Array:
    return np.where(np.abs(beta) < 1e-6, 1e-6, beta)


def _differences(t: Array, values: Array) -> tuple[Array, Array]:
    """The first and second divided differences (fields,) of values (fields, 3) at t (3,)."""
    first = np.diff(values) / np.diff(t)
    return first[:, 0], (first[:, 1] - first[:, 0]) / (t[2] - t[0])
