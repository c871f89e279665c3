"""Weights where they help: per tile of the image, the share λ of the weighted estimate that has least variance.

With A the plain mean of a pixel's samples and D the weighted mean less the plain one, A + λ D has the same
expectation for every λ that does not depend on the samples in A and D, since D has mean zero. Its variance is least at
λ = −Cov(A, D) / Var(D): 1 where the sampled domain makes the noise, 0 where other dimensions do (docs/theory.md,
section 4).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: Side of a tile in pixels
TILE = 16
#: Least and greatest standard deviation of λ between tiles that is expected
SPREAD = (0.25, 0.5)
#: What a tile's neighbour counts in its surroundings, less than 1; the next one counts the square, and so on
NEARBY = 0.7


def checkerboard(height: int, width: int, start: int = 0) -> NDArray[np.intp]:
    """The half, 0 or 1, of each pixel (height, width); `start` is that of the first."""
    y, x = np.indices((height, width))
    return (x + y + start) % 2


class Share:
    """What λ to use, by the pixels and rounds seen so far.

    Parameters
    ----------
    height, width : int
        Size of the image in pixels.

    Notes
    -----
    D has mean zero, so Σ (A − c) D / Σ D² over the pixels of a tile and over the channels estimates
    Cov(A, D) / Var(D) for any c that does not depend on D: c is the pixel's mean over the rounds before, in the first
    round what its neighbours in the same half of a checkerboard predict (`from_neighbours`).

    A tile's estimate l has the variance v, from the spread of (A − c) D + l D² over its pixels. Tiles resemble those
    around them: λ is the mean of l and of the surroundings' m, weighted by 1/v and 1/s², where m and the variance s²
    around it are weighted means of l and of (l − m)² − v over the other tiles, the nearer the more; cut to [0, 1].
    """

    def __init__(self, height: int, width: int) -> None:
        self.products = np.zeros((height, width))  # Σ (A − c) D
        self.squares = np.zeros((height, width))  # Σ D²

    def observe(self, plain: Floats, difference: Floats, centre: Floats) -> None:
        """Add a round: A, D and c, each (height, width, channels)."""
        self.products += ((plain - centre) * difference).sum(-1)
        self.squares += (difference**2).sum(-1)

    def map(self, pixels: NDArray[np.bool_] | None = None) -> Floats:
        """λ (height, width) of each pixel's tile, by the tile's pixels or by those of `pixels` only."""
        height, width = self.products.shape
        used = np.ones((height, width), bool) if pixels is None else pixels
        products, squares = self.products * used, self.squares * used
        numerator, denominator = _tile_sums(products), _tile_sums(squares)
        some = denominator > 0
        denominator = np.where(some, denominator, 1)
        estimate = -numerator / denominator
        residual = products + _spread(estimate, height, width) * squares
        # Degrees of freedom: of n equal pixels, 1 − 1/n
        free = 1 - _tile_sums(squares**2) / denominator**2
        known = some & (free > 1e-9)
        if not known.any():
            return np.zeros((height, width))
        variance = np.full_like(free, np.inf)
        np.divide(_tile_sums(residual**2), denominator**2 * free, where=known, out=variance)

        # What surrounding tiles say; far outliers count as near ones
        weight = 1 / (variance + SPREAD[0] ** 2)
        bounded = np.clip(estimate, -0.5, 1.5)
        near = _surroundings(weight)
        prior = np.clip(_surroundings(weight * bounded) / near, 0, 1)
        excess = (
            _surroundings(weight * np.where(known, (bounded - prior) ** 2 - np.where(known, variance, 0), 0)) / near
        )
        between = np.clip(excess, SPREAD[0] ** 2, SPREAD[1] ** 2)

        trust = between / (variance + between)  # 1 where the tile's own estimate is certain, 0 where it is worthless
        return _spread(np.clip(trust * estimate + (1 - trust) * prior, 0, 1), height, width)


def from_neighbours(image: Floats) -> Floats:
    """What a pixel's neighbours in its half of a checkerboard say it should be, (height, width, channels).

    Half the sum of the four diagonal neighbours less a quarter of the sum of the four at distance 2 along the axes:
    right for what varies linearly, or along one diagonal only. The image is mirrored at its border; it needs three
    pixels in each direction.
    """
    height, width = image.shape[:2]
    padded = np.pad(image, ((2, 2), (2, 2), (0, 0)), mode="reflect")

    def at(y: int, x: int) -> Floats:
        return padded[2 + y : 2 + y + height, 2 + x : 2 + x + width]

    near = at(-1, -1) + at(-1, 1) + at(1, -1) + at(1, 1)
    far = at(-2, 0) + at(2, 0) + at(0, -2) + at(0, 2)
    return near / 2 - far / 4


def halves_of_one_round(plain: Floats, difference: Floats, half: NDArray[np.intp]) -> Floats:
    """λ (2, height, width) for the pixels of each half, by those of the other, from a single round.

    Parameters
    ----------
    plain, difference : ndarray, (height, width, channels)
        A and D.
    half : ndarray of int, (height, width)
        A checkerboard, 0 and 1; the two halves' sample sets are independent.
    """
    if min(half.shape) < 3:  # no neighbours to learn from
        return np.zeros((2, *half.shape))
    share = Share(*half.shape)
    share.observe(plain, difference, from_neighbours(plain))
    return np.stack([share.map(half == 1), share.map(half == 0)])


def _tile_sums(image: Floats) -> Floats:
    """Sums over the tiles, those at the right and lower border being smaller."""
    height, width = image.shape
    rows = np.add.reduceat(image, np.arange(0, height, TILE), axis=0)
    return np.add.reduceat(rows, np.arange(0, width, TILE), axis=1)


def _surroundings(tiles: Floats) -> Floats:
    """Sums over all tiles, the nearer counting more."""
    by_row, by_column = (NEARBY ** np.abs(np.subtract.outer(np.arange(n), np.arange(n))) for n in tiles.shape)
    return by_row @ tiles @ by_column


def _spread(tiles: Floats, height: int, width: int) -> Floats:
    """Each pixel's value of its tile."""
    return tiles.repeat(TILE, axis=0)[:height].repeat(TILE, axis=1)[:, :width]
