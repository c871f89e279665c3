"""Corners of domains as they are given, and volumes that floating point can hold."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._support.arrays import Array, Indices
from .._support.checks import real_numbers

#: Exponents of two up to which numbers, and their sums and inverses, neither overflow nor vanish
IN_RANGE = 900


def points(name: str, given: ArrayLike) -> Array:
    """Finite points (m, d)."""
    array = real_numbers(name, given)
    if array.ndim != 2 or array.size == 0 or not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite points (m, d), got shape {array.shape}")
    return array


def ring(name: str, given: ArrayLike) -> Array:
    """Corners (m, 2) of a polygon; the first is not repeated at the end."""
    corners = points(name, given)
    if corners.shape[1] != 2:
        raise ValueError(f"{name} must be points of the plane (m, 2), got shape {corners.shape}")
    corners = corners[(corners != np.roll(corners, 1, axis=0)).any(axis=1)]
    if len(corners) < 3:
        raise ValueError(f"{name} must have three corners or more that differ, got {len(corners)}")
    return corners


def area(ring: Array) -> float:
    """Area within a ring."""
    x, y = (ring - ring[0]).T
    return abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2


def numbers_of_corners(given: ArrayLike, vertices: Array) -> Indices:
    """Numbers of corners (k, d + 1)."""
    m, d = vertices.shape
    corners = np.asarray(given)
    if corners.ndim != 2 or corners.shape[1] != d + 1 or corners.size == 0 or corners.dtype.kind not in "iu":
        raise ValueError(f"simplices must be whole numbers (k, {d + 1}), got {corners.dtype} of shape {corners.shape}")
    if corners.min() < 0 or corners.max() >= m:
        raise ValueError(f"simplices must be numbers from 0 to {m - 1}, got {corners.min()} to {corners.max()}")
    return corners.astype(np.intp)


def neighbours_on_line(vertices: Array) -> Indices:
    """Numbers (k, 2) of the ends of intervals between neighbours among points (m, 1); ValueError if all coincide."""
    if not np.ptp(vertices) > 0:
        raise ValueError
    order = np.argsort(vertices[:, 0])
    return np.column_stack([order[:-1], order[1:]])


def near_one(vectors: Array) -> tuple[Array, int]:
    """Vectors (..., d) divided by a power of two, and its exponent: 0 where volumes and their squares are in range.

    Elsewhere the largest coordinate comes into [1/2, 1).
    """
    exponent = math.frexp(float(np.abs(vectors).max(initial=0.0)))[1]
    if 2 * vectors.shape[-1] * abs(exponent) <= IN_RANGE:
        return vectors, 0
    return np.ldexp(vectors, -exponent), exponent


def scaled_volume(name: str, volume: float, exponent: int, given: Any) -> float:
    """volume · 2^exponent; ValueError where that is not a normal number."""
    with np.errstate(over="ignore", under="ignore"):
        scaled = float(np.ldexp(volume, exponent))
    if not np.finfo(float).tiny <= scaled < math.inf:
        raise ValueError(f"{name}: the volume is not a normal number, got {given!r}; change the unit")
    return scaled


def refuse_out_of_range(name: str, corners: Array) -> None:
    """Raise ValueError where the box around corners (m, d) has no volume that is a normal number."""
    with np.errstate(over="ignore", under="ignore"):
        volume = float(np.prod(np.ptp(corners, axis=0)))
    scaled_volume(name, volume, 0, corners.tolist())
