"""Kriging by tiles: samples predict those near them, so that the cost grows with their number and not with its cube.

The strata are cut into tiles. What lies in a tile is predicted from its samples and those of a margin around it, each
tile by a kriging of its own. Beyond a few strata samples have next to no influence on a prediction, and the drift of a
tile fits it as well as one of higher degree fits the whole box. The formulas are those of kriging with a tile's
part of the distribution of each group: docs/theory.md, (19) to (21).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from .. import _core
from .._support.arrays import Array, Indices
from . import polynomials
from .groups import Groups
from .kriging import LARGEST_CONDITION, Model, model
from .kriging_rules import strata_in_colours
from .polynomials import Intervals

#: Strata along each side of a tile, at least, and those of its margin, by dimension. Elsewhere tiles with margins
#: would be little smaller than the box.
SIDE, MARGIN = {2: 16}, 5


@dataclass(frozen=True)
class Tile:
    """Some strata, and those of them that are predicted.

    Attributes
    ----------
    strata : ndarray, (n,)
        Their numbers.
    own : ndarray, (n,)
        1 for those that are predicted, 0 for those of the margin.
    groups : Groups
        Of the n samples.
    axes : sequence of Intervals
        The distributions of the samples that are predicted, by group.
    """

    strata: Indices
    own: Array
    groups: Groups
    axes: tuple[Intervals, ...]

    @cached_property
    def in_core(self) -> _core.SampleGroups:
        """What the core is to know of it."""
        known = _core.SampleGroups(self.groups.of_each, len(self.groups.members), self.own)
        for axis in self.axes:
            known.add_axis(axis.low, axis.high, axis.part.astype(np.intp), axis.parts)
        return known


@lru_cache(maxsize=32)
def tiles(strata: tuple[int, ...], period: int) -> tuple[Tile, ...]:
    """The tiles of a grid, with colours of a period as groups.

    Examples
    --------
    >>> from voroquad.rules.tiled_kriging import tiles
    >>> [len(tile.strata) for tile in tiles((32, 32), 3)], [len(tile.strata) for tile in tiles((8, 8, 8), 2)]
    ([441, 441, 441, 441], [512])
    """
    group, axes = strata_in_colours(strata, period)
    index = np.indices(strata).reshape(len(strata), -1)
    found = []
    for ranges in itertools.product(*(_ranges(k, SIDE.get(len(strata), k)) for k in strata)):
        within = [(low <= i) & (i < high) for i, (low, high) in zip(index, ranges, strict=True)]
        around = [(low - MARGIN <= i) & (i < high + MARGIN) for i, (low, high) in zip(index, ranges, strict=True)]
        (numbers,) = np.nonzero(np.all(around, axis=0))
        parts = tuple(_some(axis, slice(*one)) for axis, one in zip(axes, ranges, strict=True))
        own = np.all(within, axis=0)[numbers].astype(np.float64)
        found.append(Tile(numbers, own, Groups.of(group[numbers], group.max() + 1), parts))
    return tuple(found)


@lru_cache(maxsize=32)
def spread_out(strata: tuple[int, ...], period: int, most: int) -> Tile:
    """A part of the strata, at most so many, all over the box: what tells models apart at little cost.

    Examples
    --------
    >>> from voroquad.rules.tiled_kriging import spread_out
    >>> spread_out((32, 32), 3, 4).strata
    array([ 84, 296, 752, 982])
    """
    group, axes = strata_in_colours(strata, period)
    numbers = np.sort(np.random.default_rng(0).permutation(len(group))[:most])
    return Tile(numbers, np.ones(len(numbers)), Groups.of(group[numbers], group.max() + 1), tuple(axes))


@lru_cache(maxsize=64)
def tile_model(assumed: Model, n: int, d: int) -> Model:
    """The model of a tile with n samples: that of the whole box, with a drift of no more terms than n allow."""
    return replace(assumed, degree=min(assumed.degree, model(n, d).degree))


def _ranges(k: int, side: int) -> Iterator[tuple[int, int]]:
    """Strata 0 … k − 1 in parts of at least `side`, about equal."""
    ends = np.linspace(0, k, max(1, k // side) + 1).round().astype(int)
    return itertools.pairwise(ends.tolist())


def _some(axis: Intervals, which: slice) -> Intervals:
    return Intervals(axis.low[which], axis.high[which], axis.part[which], axis.parts)


class TiledKriging:
    """A candidate of :mod:`voroquad.rules.model_choice`.

    Parameters
    ----------
    name : str
        Of the model.
    assumed : Model
        Of the whole box.
    points : ndarray, (n, d)
        One sample in each stratum, in their C order.
    parts : sequence of Tile
        Of the strata.
    threads : int
        Number of threads; results do not depend on it.
    """

    def __init__(self, name: str, assumed: Model, points: Array, parts: Sequence[Tile], threads: int):
        self.names: tuple[str, ...] = (name,)
        self._n, self._tiles = len(points), parts
        self._points, self._assumed, self._threads = points, assumed, threads

    @cached_property
    def _predictions(self) -> list[_core.LeftOutKriging]:
        """Of the tiles; what is never asked for costs nothing."""
        return [self._prediction(tile, np.ascontiguousarray(self._points[tile.strata])) for tile in self._tiles]

    def _prediction(self, tile: Tile, points: Array) -> _core.LeftOutKriging:
        n, d = points.shape
        own = tile_model(self._assumed, n, d)
        powers = polynomials.powers_up_to(own.degree, d)
        return _core.LeftOutKriging(
            tile.in_core, own.covariance.name, points, own.length, own.noise, LARGEST_CONDITION,
            polynomials.at_points(points, powers), polynomials.over_boxes(tile.axes, powers),
            [math.comb(p + d, d) for p in range(own.degree + 1)], self._threads,
        )  # fmt: skip

    def squares(self, pairs: Indices, values: Array) -> Array:
        """As :class:`voroquad.rules.model_choice.Candidates` has it."""
        squares = sum(p.squares(pairs, v) for p, v in self._by_tile(values))
        return np.asarray(squares)[None]

    def residuals(self, which: int, groups: Indices, values: Array) -> Array:
        """As :class:`voroquad.rules.model_choice.Candidates` has it."""
        residuals = np.zeros_like(values)
        for tile, (prediction, v) in zip(self._tiles, self._by_tile(values), strict=True):
            residuals[:, tile.strata] += prediction.residuals(groups, v)
        return residuals

    def weights(self, which: int, groups: Indices) -> Array:
        """As :class:`voroquad.rules.model_choice.Candidates` has it."""
        weights = np.zeros((len(groups), self._n))
        for tile, prediction in zip(self._tiles, self._predictions, strict=True):
            weights[:, tile.strata] += prediction.weights(groups)
        return weights

    def _by_tile(self, values: Array) -> Iterator[tuple[_core.LeftOutKriging, Array]]:
        """The prediction of each tile, and the values (fields, n) of its samples."""
        for tile, prediction in zip(self._tiles, self._predictions, strict=True):
            yield prediction, np.ascontiguousarray(values[:, tile.strata])
