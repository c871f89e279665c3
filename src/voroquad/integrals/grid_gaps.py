"""Values for the points of a grid where an integrand has none, such as sin(x)/x at 0."""

from __future__ import annotations

import math

import numpy as np

from .._support.arrays import Array, Indices

#: Most points on either side that a missing value is interpolated from.
REACH = 4


def fill_gaps(grid: Array) -> None:
    """Replace the values of a grid (k, …, k) that are not finite, in place.

    They are interpolated along the axes on which most points on either side have values, and then from each other; if
    that is impossible they are 0. A grid only predicts, so any values leave the estimate unbiased. These keep
    predictions accurate where a smooth function cannot be computed at a point.

    Examples
    --------
    >>> import numpy as np
    >>> from voroquad.integrals.grid_gaps import fill_gaps
    >>> grid = np.cos(np.linspace(-1, 1, 21))
    >>> grid[10] = np.nan  # at x = 0
    >>> fill_gaps(grid)
    >>> bool(abs(grid[10] - 1) < 1e-9)
    True
    """
    if math.isfinite(float(grid.max()) - float(grid.min())):
        return
    grid[~np.isfinite(grid)] = np.nan
    for _ in range(grid.ndim):  # where planes without values cross, only the values filled in before are near
        gaps = np.nonzero(np.isnan(grid))
        grid[gaps] = _interpolated(grid, gaps)
    np.nan_to_num(grid, copy=False)


def _interpolated(grid: Array, gaps: tuple[Indices, ...]) -> Array:
    """The values at gaps from polynomials along the axes, of the highest degree; NaN without a point on either side.

    The value at 0 of the polynomial through ±1, …, ±m is Σ_j w_j (f(j) + f(−j)), with
    w_j = (−1)^(j+1) (m!)² / ((m − j)! (m + j)!).
    """
    found = np.full(len(gaps[0]), np.nan)
    for m in range(1, REACH + 1):
        values = np.zeros((grid.ndim, len(found)))
        for j in range(1, m + 1):
            weight = (-1) ** (j + 1) * math.factorial(m) ** 2 / (math.factorial(m - j) * math.factorial(m + j))
            for axis in range(grid.ndim):
                values[axis] += weight * (_beside(grid, gaps, axis, j) + _beside(grid, gaps, axis, -j))
        known = np.isfinite(values)
        mean = np.where(known, values, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
        found = np.where(known.any(axis=0), mean, found)
    return found


def _beside(grid: Array, gaps: tuple[Indices, ...], axis: int, step: int) -> Array:
    """The values so many steps from the gaps along an axis; NaN in other gaps and outside of the grid."""
    at = gaps[axis] + step
    inside = (at >= 0) & (at < grid.shape[axis])
    moved = tuple(np.where(inside, at, 0) if a == axis else i for a, i in enumerate(gaps))
    return np.where(inside, grid[moved], np.nan)
