"""Squares of numbers of any size: in units of a power of two none over- or underflows, and units change no bit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._support.arrays import Array


def powers(values: Array, axis: int) -> NDArray[np.intc]:
    """Powers of two in units of which the largest finite size along an axis is ½ to 1. The axis stays, of length 1.

    Examples
    --------
    >>> import numpy as np
    >>> from voroquad.integrals.units import powers
    >>> powers(np.array([[3.0, -8.0], [0.0, 0.25]]), axis=1).tolist()
    [[4], [-1]]
    """
    _, power = np.frexp(np.abs(values).max(axis=axis, keepdims=True, initial=0, where=np.isfinite(values)))
    return np.asarray(power, dtype=np.intc)


def scaled(values: Array, axis: int) -> Array:
    """Values in these units."""
    found: Array = np.ldexp(values, -powers(values, axis))
    return found


def deviation(values: Array, axis: int) -> Array:
    """Standard deviations along an axis, of a sample."""
    power = powers(values, axis)
    found: Array = np.ldexp(np.ldexp(values, -power).std(axis=axis, ddof=1), power.squeeze(axis))
    return found


def norm(values: Array, axis: int) -> Array:
    """Roots of the sums of squares along an axis."""
    power = powers(values, axis)
    found: Array = np.ldexp(np.sqrt(np.square(np.ldexp(values, -power)).sum(axis=axis)), power.squeeze(axis))
    return found
