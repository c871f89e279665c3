"""Kriging by tiles: samples predict those near them, so that the cost grows with their number and not with its cube.

The strata are cut into tiles. What lies in a tile is predicted from its samples and those of a margin around it, each
tile by a kriging of its own. Beyond a few strata samples have next to no influence on a prediction, and the drift of a
tile fits it as well as one of higher degree fits the whole box. The formulas are those of kriging with a tile's
part of the distribution of each group: docs/theory.md, (19) to (21).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from .._support.arrays import Array, Indices
from .groups import Groups
from .kriging import Kriging, Model, model
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
    def _predictions(self) -> list[_Prediction]:
        """Of the tiles; what is never asked for costs nothing."""
        return [_Prediction(tile, self._assumed, self._points[tile.strata], self._threads) for tile in self._tiles]

    def squares(self, pairs: Indices, values: Array) -> Array:
        """As :class:`voroquad.rules.model_choice.Candidates` has it."""
        squares = np.zeros((1, len(values), *pairs.shape))
        for tile, prediction in zip(self._tiles, self._predictions, strict=True):
            missed = prediction.missed(pairs, values[:, tile.strata])
            counted = np.square(missed) * tile.own[prediction.samples(pairs)][..., None]
            squares[0] += np.moveaxis(counted.reshape(*pairs.shape, -1, len(values)).sum(axis=2), -1, 0)
        return squares

    def residuals(self, which: int, groups: Indices, values: Array) -> Array:
        """As :class:`voroquad.rules.model_choice.Candidates` has it."""
        residuals = np.zeros_like(values)
        for tile, prediction in zip(self._tiles, self._predictions, strict=True):
            members = tile.groups.members[groups]
            told = (tile.groups.real[groups] * tile.own[members]).astype(bool)
            missed = prediction.missed(groups[:, None], values[:, tile.strata])
            residuals[:, tile.strata[members[told]]] = missed[told].T
        return residuals

    def weights(self, which: int, groups: Indices) -> Array:
        """As :class:`voroquad.rules.model_choice.Candidates` has it."""
        weights = np.zeros((len(groups), self._n))
        for tile, prediction in zip(self._tiles, self._predictions, strict=True):
            weights[:, tile.strata] += prediction.weights(groups)
        return weights


class _Prediction:
    """What is predicted of a tile."""

    def __init__(self, tile: Tile, assumed: Model, points: Array, threads: int):
        self._tile = tile
        self.kriging = Kriging(points, tile_model(assumed, *points.shape), threads)

    def samples(self, sets: Indices) -> Indices:
        """The members (sets, size) of sets of groups (sets, groups)."""
        return self._tile.groups.members[sets].reshape(len(sets), -1)

    def missed(self, sets: Indices, values: Array) -> Array:
        """What predictions without sets of groups (sets, groups) miss of values (fields, n): (sets, size, fields)."""
        return self.solve(sets, self.kriging.apply(values).T[self.samples(sets)])

    def solve(self, sets: Indices, right: Array) -> Array:
        """B_uu⁻¹ times right-hand sides (sets, size, fields) for the samples u of each set of groups; 0 elsewhere."""
        real = self._tile.groups.real[sets].reshape(len(sets), -1)
        blocks = self.kriging.blocks(self.samples(sets)) * real[:, :, None] * real[:, None, :]
        diagonal = np.arange(real.shape[1])
        blocks[:, diagonal, diagonal] += 1 - real
        return np.asarray(np.linalg.solve(blocks, right * real[..., None]), dtype=np.float64)

    def weights(self, groups: Indices) -> Array:
        """v + B y with y_c = B_cc⁻¹ (1 − v_c), where 1 stands for samples that are predicted: (groups, n)."""
        v = self.kriging.integrals(self.kriging.over_boxes(self._tile.axes))[groups]
        members = self._tile.groups.members[groups]
        missing = np.take_along_axis(self._tile.own - v, members, axis=1)
        y = np.zeros_like(v)
        np.put_along_axis(y, members, self.solve(groups[:, None], missing[..., None])[..., 0], axis=1)
        return v + self.kriging.apply(y)
