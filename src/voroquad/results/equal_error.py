"""How many samples a method needs for a given error, from its measured convergence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .power_law import fit_power_law


@dataclass(frozen=True)
class Samples:
    """A number of samples, and whether it lies beyond those measured."""

    n: float
    extrapolated: bool


def samples_for_error(n: Sequence[float], mse: Sequence[float], target: float) -> Samples:
    """Samples with which a method reaches a mean squared error.

    Parameters
    ----------
    n : sequence of float
        Numbers of samples at which the method was measured, increasing.
    mse : sequence of float
        Its mean squared errors there, positive.
    target : float
        The mean squared error to reach, positive.

    Returns
    -------
    Samples
        Linear in log n and log MSE between the measurements; beyond them along the least-squares slope of them all,
        through the nearest one. NaN where that cannot be known: beyond a single measurement, or a slope that is not
        negative.

    Notes
    -----
    Where noise makes a larger n the worse one, the best so far counts: n is the smallest with which the target has
    been seen to be reached.

    Examples
    --------
    >>> from voroquad.results.equal_error import samples_for_error
    >>> samples_for_error([16, 64], [1 / 16, 1 / 64], 1 / 32)
    Samples(n=32.0, extrapolated=False)
    >>> samples_for_error([16, 64], [1 / 16, 1 / 64], 1 / 1024)
    Samples(n=1024.0, extrapolated=True)
    """
    law = fit_power_law(n, mse)
    slope = 0.0 if law is None else law.slope
    x, y, level = np.log2(n), np.log2(mse), math.log2(target)
    best = np.minimum.accumulate(y)
    first = np.append(True, best[1:] < best[:-1])  # where the best was first seen
    x, y = x[first], y[first]
    if y[-1] <= level <= y[0]:
        return Samples(_power(float(np.interp(-level, -y, x))), extrapolated=False)
    end = 0 if level > y[0] else -1
    return Samples(
        _power(float(x[end]) + (level - float(y[end])) / slope) if slope < 0 else math.nan, extrapolated=True
    )


def equal_error_ratio(baseline: Sequence[tuple[float, float]], n: float, mse: float) -> Samples:
    """Samples that a baseline needs for the mean squared error `mse`, over the `n` that gave it.

    Parameters
    ----------
    baseline : sequence of (n, mse)
        Its measurements by increasing n; those whose error is zero or not finite are left out.
    n : float
        Samples.
    mse : float
        Mean squared error.

    Returns
    -------
    Samples
        The ratio; NaN where it cannot be known.

    Examples
    --------
    >>> from voroquad.results.equal_error import equal_error_ratio
    >>> equal_error_ratio([(16, 1 / 16), (64, 1 / 64)], 16, 1 / 32)
    Samples(n=2.0, extrapolated=False)
    """
    measured = [(samples, error) for samples, error in baseline if 0 < error < math.inf]
    if not (0 < mse < math.inf and measured):
        return Samples(math.nan, extrapolated=True)
    found = samples_for_error([samples for samples, _ in measured], [error for _, error in measured], mse)
    return Samples(found.n / n, found.extrapolated)


def _power(exponent: float) -> float:
    """2^exponent, to the digits that rounding leaves."""
    return float(f"{2.0**exponent:.12g}") if exponent < 1000 else math.inf
