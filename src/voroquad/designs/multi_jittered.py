"""One point per stratum, evenly spread in each coordinate too, and independent of its neighbours.

Colour each stratum by its index modulo a period q on each axis. Points of different colours are
independent. Those of one colour are a multi-jittered set (Chiu, Shirley and Wang 1994), in any dimension:
in each slab of strata along an axis, their coordinates along that axis are a Latin arrangement. A rule that
corrects each sample by a fit to others of different colours is as unbiased as with independent points
(docs/theory.md, (13)), and an edge across a slab costs it the variance of one sample in place of many.
"""

from __future__ import annotations

import math

import numpy as np

from .._support.arrays import Array, Indices
from .grids import corners, grid_shape, inside

_GOLDEN_RATIO = (math.sqrt(5) - 1) / 2


def period(d: int) -> int:
    """The period of the colours by dimension. In one there is nothing to arrange: 0, all independent."""
    return {1: 0, 2: 3}.get(d, 2)


def colours(strata: tuple[int, ...]) -> Indices:
    """The colour (n,) of each stratum, in C order, counted from 0.

    Examples
    --------
    >>> from voroquad.designs.multi_jittered import colours
    >>> colours((3, 3, 2))
    array([0, 1, 2, 3, 0, 1, 4, 5, 6, 7, 4, 5, 0, 1, 2, 3, 0, 1])
    """
    d, q = len(strata), period(len(strata))
    if q == 0:
        return np.arange(math.prod(strata))
    remainders = np.indices(strata).reshape(d, -1) % q
    colour = np.ravel_multi_index(tuple(remainders), (q,) * d)
    return np.unique(colour, return_inverse=True)[1].astype(np.intp)


def points(sets: int, n: int, d: int, rng: np.random.Generator) -> Array:
    """Points (sets, n, d) of independent sets, each in C order of its strata."""
    strata = grid_shape(n, d)
    lower = corners(strata)
    return inside((lower + offsets(strata, sets, rng)) / strata, lower, strata)


def offsets(strata: tuple[int, ...], sets: int, rng: np.random.Generator) -> Array:
    """Places (sets, n, d) of the points within their strata, each uniform in [0, 1)^d.

    Take the m strata of one colour with the same index along axis a. The coordinates along a of their
    points within them are (r + u) / m, with independent uniform u and a permutation r of 0 … m−1: the
    order of the sums Σ_{b≠a} π(j_b)/n_b modulo 1, where j_b < n_b counts the colour's strata along axis b
    and the permutation π spreads them by the golden ratio. So the points of each row and block of the slab
    are evenly spread as well. Ties are broken at random, and a random cyclic shift makes each r uniform.
    """
    d, n = len(strata), math.prod(strata)
    if period(d) == 0:
        return rng.random((sets, n, d))
    index = np.indices(strata).reshape(d, n).T
    colour, spread = colours(strata), _spread(index, strata)
    places = np.empty((sets, n, d))
    for a in range(d):
        slab = np.unique(colour * strata[a] + index[:, a], return_inverse=True)[1]
        size = np.bincount(slab)
        sums = np.round(np.delete(spread, a, axis=1).sum(axis=1) % 1, 9) % 1
        key = np.unique(slab + sums, return_inverse=True)[1]
        order = np.argsort(key + rng.random((sets, n)) / 2, axis=1)
        rank = np.empty((sets, n))
        np.put_along_axis(rank, order, np.arange(n) - (np.cumsum(size) - size)[slab[order]], axis=1)
        shift = np.floor(rng.random((sets, len(size))) * size)
        rank = (rank + shift[:, slab]) % size[slab]
        places[..., a] = (rank + rng.random((sets, n))) / size[slab]
    return places


def _spread(index: Indices, strata: tuple[int, ...]) -> Array:
    """π(j_b)/n_b (n, d) of the strata with those indices (n, d)."""
    q = period(len(strata))
    count = (np.asarray(strata) - 1 - index % q) // q + 1
    spread = np.empty(index.shape)
    for size in np.unique(count):
        golden = np.argsort(np.argsort(np.arange(size) * _GOLDEN_RATIO % 1))
        alike = count == size
        spread[alike] = golden[index[alike] // q] / size
    return spread
