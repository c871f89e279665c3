"""Grids of strata: equal boxes that cut the unit box, as near to cubes as their number allows."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from .._support.arrays import Array, Indices


@lru_cache(maxsize=256)
def grid_shape(n: int, d: int) -> tuple[int, ...]:
    """Numbers of boxes along each axis whose product is n, ascending and as equal as n allows.

    A grid is near-cubic when its longest axis has at most twice the boxes of its shortest.
    """
    shape = _near_cubic(n, d)
    if shape is None:
        below = next((m for m in range(n - 1, 0, -1) if _near_cubic(m, d)), None)
        above = next(m for m in itertools.count(n + 1) if _near_cubic(m, d))
        raise ValueError(
            f"n = {n} samples do not fill a near-cubic grid in d = {d}; "
            f"the nearest that do are n = {below} and n = {above}"
        )
    return shape


def _near_cubic(n: int, d: int) -> tuple[int, ...] | None:
    """The most equal factors of n whose largest is at most twice the smallest, or None."""
    if d == 1:
        return (n,)

    def factors(rest: int, axes: int, least: int) -> Iterator[tuple[int, ...]]:
        if axes == 1:
            if rest >= least:
                yield (rest,)
            return
        k = least
        while k**axes <= rest:
            if rest % k == 0:
                for tail in factors(rest // k, axes - 1, k):
                    yield (k, *tail)
            k += 1

    # The smallest factor is at least n^(1/d) / 2, since the product is at most k·(2k)^(d−1)
    smallest = max(1, math.ceil((n / 2 ** (d - 1)) ** (1 / d) - 1e-9))
    near = [shape for shape in factors(n, d, smallest) if shape[-1] <= 2 * shape[0]]
    return min(near, key=lambda shape: shape[-1] / shape[0], default=None)


@lru_cache(maxsize=256)
def largest_grid(n: int, d: int) -> tuple[int, ...]:
    """The grid of the most boxes, at most n, whose numbers along the axes differ by at most two.

    Examples
    --------
    >>> from voroquad.designs.grids import largest_grid
    >>> largest_grid(1024, 2), largest_grid(1000, 3), largest_grid(15, 4)
    ((32, 32), (10, 10, 10), (1, 2, 2, 2))
    """
    k = math.floor(n ** (1 / d) + 1e-9)
    candidates = [s for least in (max(1, k - 1), k) for s in _even_shapes(least, d) if math.prod(s) <= n]
    best = max(candidates, key=lambda shape: (math.prod(shape), shape[0]))
    return grid_shape(math.prod(best), d)


def even_sizes(n: int, d: int) -> Indices:
    """The numbers up to n of boxes of grids whose numbers along the axes differ by at most two, ascending.

    Examples
    --------
    >>> from voroquad.designs.grids import even_sizes
    >>> even_sizes(40, 3)
    array([ 1,  2,  4,  8, 12, 16, 18, 24, 27, 32, 36])
    """
    shapes = (_even_shapes(least, d) for least in range(1, math.floor(n ** (1 / d) + 1e-9) + 1))
    sizes = {math.prod(shape) for some in shapes for shape in some}
    return np.array(sorted(size for size in sizes if size <= n), dtype=np.intp)


def _even_shapes(least: int, d: int) -> list[tuple[int, ...]]:
    """Near-cubic shapes of `least` boxes along some axis, and up to two more along the others."""
    shapes = [
        (least,) * (d - ones - twos) + (least + 1,) * ones + (least + 2,) * twos
        for twos in range(d + 1)
        for ones in range(d - twos + 1)
    ]
    return [shape for shape in shapes if shape[-1] <= 2 * shape[0]]


def stratum_index(points: Array, strata: tuple[int, ...]) -> Indices:
    """The C-order index (..., n) of the stratum each point (..., n, d) lies in."""
    k = np.asarray(strata)
    boxes = np.minimum((points * k).astype(np.intp), k - 1)
    return np.ravel_multi_index(tuple(np.moveaxis(boxes, -1, 0)), strata)


def corners(strata: tuple[int, ...]) -> Indices:
    """The lower corners (n, d) of the strata in C order, in units of their sides."""
    return np.indices(strata).reshape(len(strata), -1).T


def inside(points: Array, corners: Indices, strata: tuple[int, ...]) -> Array:
    """Move points back into their stratum if rounding has put them on or beyond one of its faces."""
    while (astray := (points * strata).astype(np.intp) - corners).any():
        points = np.where(astray == 0, points, np.nextafter(points, np.where(astray > 0, 0.0, 1.0)))
    return points
