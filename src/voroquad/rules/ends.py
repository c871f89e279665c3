"""What a power or a logarithm at an end of the line adds to the error of a single set.

The prediction of the stratum at an end is extrapolated, and its only sample tells little of what it misses. But the
exponent β of an integrand that behaves as a + A t^β, t strata from the end, is told by the slopes farther in, which
fall off as t^(β − 1). With it the curve through what is missed at the three nearest samples is known, and so is what
the sample in the stratum leaves of its mean: docs/theory.md, (33).
"""

from __future__ import annotations

import numpy as np

from .._support.arrays import Array

#: Slopes that tell the exponent, from the second sample on.
SLOPES = 7

#: Largest root mean square deviation of the logarithms of the slopes from a line. Of powers and logarithms it is at
#: most .1, however the samples lie in their strata.
STRAIGHT = 0.2

#: The exponents of ends: below, the integral hardly exists; above, parabolas do as well.
LEAST, MOST = -0.9, 0.9


def deviations(points: Array, values: Array, around: Array) -> Array:
    """What remains of the means over the first and the last stratum, in units of values: (fields, 2).

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
    left = _deviation(n * points[: SLOPES + 2], values[:, : SLOPES + 2], around[:, 0])
    from_right = n * (1 - points[: -SLOPES - 3 : -1])
    right = _deviation(from_right, values[:, : -SLOPES - 3 : -1], around[:, -1, ::-1])
    return np.stack([left, right], axis=1)


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
    slopes = np.diff(values[:, 1:]) / np.diff(t[1:])
    one_sign = (np.sign(slopes) == np.sign(slopes[:, :1])).all(axis=1) & (slopes != 0).all(axis=1)
    logs = np.log(np.abs(np.where(one_sign[:, None], slopes, 1)))
    places = np.log((t[2:] + t[1:-1]) / 2)
    places = places - places.mean()
    logs = logs - logs.mean(axis=1, keepdims=True)
    rate = logs @ places / (places @ places)
    off = np.sqrt(np.square(logs - rate[:, None] * places).mean(axis=1))
    found: Array = np.where(one_sign & (off <= STRAIGHT) & (rate + 1 <= MOST), np.maximum(rate + 1, LEAST), np.nan)
    return found


def _deviation(t: Array, values: Array, missed: Array) -> Array:
    """Of one end, |mean − r_1| of the curve r through what is missed at the first three samples (fields, 3)."""
    beta = exponents(t, values)
    t = t[:3]
    curve = _power(t, np.where(np.isnan(beta), 1.0, beta))
    of_missed, of_curve = _differences(t, missed), _differences(t, curve)
    amount = np.divide(of_missed[1], of_curve[1], out=np.zeros(len(beta)), where=~np.isnan(beta))
    mean = -1 / (1 + beta)
    bent = mean - curve[:, 0] - (0.5 - t[0]) * of_curve[0]
    return np.where(np.isnan(beta), 0.0, np.abs((0.5 - t[0]) * of_missed[0] + amount * bent))


def _power(t: Array, beta: Array) -> Array:
    """(t^β − 1)/β, and log t at β = 0: (fields, m); its mean over [0, 1] is −1/(1 + β)."""
    beta = np.where(np.abs(beta) < 1e-6, 1e-6, beta)[:, None]
    powers: Array = np.expm1(beta * np.log(t)) / beta
    return powers


def _differences(t: Array, values: Array) -> tuple[Array, Array]:
    """The first and second divided differences (fields,) of values (fields, 3) at t (3,)."""
    first = np.diff(values) / np.diff(t)
    return first[:, 0], (first[:, 1] - first[:, 0]) / (t[2] - t[0])
