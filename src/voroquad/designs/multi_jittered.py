"""One point per stratum, evenly spread in each coordinate too, and independent of its neighbours.

Colour each stratum by its index modulo a period q on each axis. Points of different colours are
independent. Those of one colour are a multi-jittered set (Chiu, Shirley and Wang 1994), in any dimension:
in each slab of strata along an axis, their coordinates along that axis are a Latin arrangement. A rule that
corrects each sample by a fit to others of different colours is as unbiased as with independent points
(docs/theory.md, (13)), and an edge across a slab costs it the variance of one sample in place of many.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from .._support.arrays import Array, Indices
from .grids import corners, grid_shape, inside

_GOLDEN_RATIO = (math.sqrt(5) - 1) / 2

#: Strata of a grid, at most, that is remembered from one set to the next.
MOST_KNOWN = 4096


def period(d: int) -> int:
    """The period of the colours by dimension. In one dimension it is 0: all points are independent."""
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
    places = np.empty((sets, n, d))
    for a, slabs in enumerate(_slabs(strata)):
        order = np.argsort(slabs.key + rng.random((sets, n)) / 2, axis=1)
        rank = np.empty((sets, n))
        rank[np.arange(sets)[:, None], order] = np.arange(n) - slabs.begin[order]
        shift = np.floor(rng.random((sets, len(slabs.sizes))) * slabs.sizes)
        rank = (rank + shift[:, slabs.number]) % slabs.size
        places[..., a] = (rank + rng.random((sets, n))) / slabs.size
    return places


@dataclass(frozen=True)
class Slabs:
    """For an axis, the strata of one colour with the same index along it, told by what each stratum (n,) belongs to.

    Attributes
    ----------
    number, size, begin : ndarray, (n,)
        The number of the stratum's slab, how many strata that has, and how many those before it have.
    sizes : ndarray, (slabs,)
        Strata of each slab.
    key : ndarray, (n,)
        Orders the strata by slabs, and in a slab by their sums.
    """

    number: Indices
    size: Indices
    begin: Indices
    sizes: Indices
    key: Indices

    @classmethod
    def along(cls, a: int, strata: tuple[int, ...], index: Indices, colour: Indices, spread: Array) -> Slabs:
        """Those along axis a of strata with these indices (n, d), colours (n,) and spread π(j)/n (n, d)."""
        number = np.unique(colour * strata[a] + index[:, a], return_inverse=True)[1]
        sizes = np.bincount(number)
        sums = np.round(np.delete(spread, a, axis=1).sum(axis=1) % 1, 9) % 1
        key = np.unique(number + sums, return_inverse=True)[1]
        return cls(number, sizes[number], (np.cumsum(sizes) - sizes)[number], sizes, key)


def _slabs(strata: tuple[int, ...]) -> tuple[Slabs, ...]:
    """Those along each axis."""
    return _known_slabs(strata) if math.prod(strata) <= MOST_KNOWN else _known_slabs.__wrapped__(strata)


@lru_cache(maxsize=8)
def _known_slabs(strata: tuple[int, ...]) -> tuple[Slabs, ...]:
    d = len(strata)
    index = np.indices(strata).reshape(d, -1).T
    colour, spread = colours(strata), _spread(index, strata)
    return tuple(Slabs.along(a, strata, index, colour, spread) for a in range(d))


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
