"""Weights where they help: per tile of the image, the share λ of the weighted estimate that has least variance.

With A the plain mean of a pixel's samples and D the weighted mean less the plain one, A + λ D has the same
expectation for every λ that does not depend on the samples in A and D, since D has mean zero. Its variance is least at
λ = −Cov(A, D) / Var(D): 1 where the sampled domain makes the noise, 0 where other dimensions do (docs/theory.md,
section 4).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

#: Side of a tile in pixels, even
TILE = 16
#: Of A: a D that is smaller is what rounding of sums in single precision leaves
ROUNDING = 2.0**-20
#: How many rows or columns away the pixels are that a pixel is compared with, at most
REACH = 2
#: Least and greatest standard deviation of λ between tiles that is expected
SPREAD = (0.25, 0.5)
#: What a tile's neighbour counts in its surroundings, less than 1; the next one counts the square, and so on
NEARBY = 0.7


def checkerboard(height: int, width: int, start: int = 0) -> NDArray[np.intp]:
    """The half, 0 or 1, of each pixel (height, width); `start` is that of the first."""
    return (np.arange(start, start + height)[:, None] + np.arange(width)) & 1


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
    around it are weighted means of l and of (l − m)² − v over the other tiles, the nearer the more, and over one where
    it is 0; cut to [0, 1].
    """

    def __init__(self, height: int, width: int) -> None:
        self.products = np.zeros((height, width))  # Σ (A − c) D
        self.squares = np.zeros((height, width))  # Σ D²

    def observe(self, plain: Floats, difference: Floats, centre: Floats | None = None) -> None:
        """Add a round: A, D and c, each (height, width, channels); without c, it is what neighbours say."""
        if centre is None and min(plain.shape[:2]) <= REACH:  # no neighbours to learn from
            return
        for channel in range(plain.shape[-1]):
            values, change = plain[..., channel], difference[..., channel]
            if centre is None:
                around = np.pad(values, REACH, mode="reflect")
            for rows in strips(len(plain), tiles=4):
                if centre is None:
                    expected = from_neighbours(around[rows.start : rows.stop + 2 * REACH])
                else:
                    expected = centre[rows, :, channel]
                own = np.where(np.abs(change[rows]) > ROUNDING * np.abs(values[rows]), change[rows], 0)
                deviation = values[rows] - expected
                deviation *= own
                self.products[rows] += deviation
                self.squares[rows] += own * own

    def map(self) -> Floats:
        """λ (height, width) of each pixel's tile."""
        return self._of_pixels(least_variance(self._moments().sum(1)))

    def halves(self) -> Floats:
        """λ (2, height, width) for the pixels of each half of a checkerboard, by those of the other."""
        moments = self._moments()
        return self._of_pixels(np.stack([least_variance(moments[:, half]) for half in (1, 0)]))

    def _moments(self) -> Floats:
        """Sums (5, 2, rows, columns) of p, s, p², p s and s² over the pixels of each half of each tile."""
        height, width = self.products.shape
        rows, columns = -(-height // TILE), -(-width // TILE)
        by_row = np.zeros((5, rows, 2, columns * TILE))  # over the even rows of a tile, and the odd ones
        terms = np.zeros((5, TILE, width))
        for row, pixels in enumerate(strips(height)):
            p, s = self.products[pixels], self.squares[pixels]
            terms[:, len(p) :] = 0
            factors: list[tuple[Floats, Floats | float]] = [(p, 1.0), (s, 1.0), (p, p), (p, s), (s, s)]
            for term, (a, b) in zip(terms[:, : len(p)], factors, strict=True):
                np.multiply(a, b, out=term)
            by_row[:, row, :, :width] = terms.reshape(5, TILE // 2, 2, width).sum(1)
        pairs = by_row.reshape(5, rows, 2, columns, TILE // 2, 2)
        even, odd = pairs[..., 0].sum(-1), pairs[..., 1].sum(-1)  # columns of a tile
        return np.stack([even[:, :, 0] + odd[:, :, 1], odd[:, :, 0] + even[:, :, 1]], 1)

    def _of_pixels(self, tiles: Floats) -> Floats:
        """Each pixel's value (…, height, width) of its tile, float32."""
        height, width = self.products.shape
        columns = tiles.astype(np.float32).repeat(TILE, axis=-1)[..., :width]
        return columns.repeat(TILE, axis=-2)[..., :height, :]


def of_own_half(halves: Floats) -> Floats:
    """Each pixel's value (height, width) of those (2, height, width) for the halves of a checkerboard."""
    own = halves[0].copy()
    for row in (0, 1):
        own[row::2, 1 - row :: 2] = halves[1, row::2, 1 - row :: 2]
    return own


def least_variance(moments: Floats) -> Floats:
    """λ of tiles from sums (5, rows, columns) over their pixels: of p = (A − c) D, s = D², p², p s and s²."""
    p, s, pp, ps, ss = moments
    some = s > 0
    denominator = np.where(some, s, 1)
    estimate = -p / denominator
    residual = np.maximum(pp + 2 * estimate * ps + estimate**2 * ss, 0)
    # Degrees of freedom: of n equal pixels, 1 − 1/n
    free = 1 - ss / denominator**2
    known = some & (free > 1e-9)
    if not known.any():
        return np.zeros_like(s)
    variance = np.full_like(free, np.inf)
    np.divide(residual, denominator**2 * free, where=known, out=variance)

    # What surrounding tiles say; far outliers count as near ones
    weight = 1 / (variance + SPREAD[0] ** 2)
    bounded = np.clip(estimate, -0.5, 1.5)
    near = _surroundings(weight)
    # … and one tile more, without weights: where λ cannot be known it is near 0
    prior = np.clip(_surroundings(weight * bounded) / (near + SPREAD[1] ** -2), 0, 1)
    deviation = np.where(known, (bounded - prior) ** 2 - np.where(known, variance, 0), 0)
    between = np.clip(_surroundings(weight * deviation) / near, SPREAD[0] ** 2, SPREAD[1] ** 2)

    trust = between / (variance + between)  # 1 where the tile's own estimate is certain, 0 where it is worthless
    return np.clip(trust * estimate + (1 - trust) * prior, 0, 1)


def strips(height: int, tiles: int = 1) -> list[slice]:
    """The rows of so many rows of tiles: what is done to one strip at a time stays in the processor's cache."""
    return [slice(top, min(top + tiles * TILE, height)) for top in range(0, height, tiles * TILE)]


def from_neighbours(image: Floats) -> Floats:
    """What the pixels' neighbours in their halves of a checkerboard say they should be.

    Parameters
    ----------
    image : ndarray, (height + 2 REACH, width + 2 REACH, channels)
        With neighbours of the pixels at its border.

    Returns
    -------
    ndarray, (height, width, channels)
        Half the sum of the four diagonal neighbours less a quarter of the sum of the four at distance 2 along the
        axes: right for what varies quadratically, or along one diagonal only.
    """
    height, width = image.shape[0] - 2 * REACH, image.shape[1] - 2 * REACH
    rows = image[1 : height + 1] + image[3 : height + 3]
    near = rows[:, 1 : width + 1] + rows[:, 3 : width + 3]
    far = image[:height, 2 : width + 2] + image[4:, 2 : width + 2]
    far += image[2 : height + 2, :width]
    far += image[2 : height + 2, 4:]
    near *= 1 / 2
    far *= 1 / 4
    near -= far
    return near


def _surroundings(tiles: Floats) -> Floats:
    """Sums over all tiles, the nearer counting more."""
    by_row, by_column = (NEARBY ** np.abs(np.subtract.outer(np.arange(n), np.arange(n))) for n in tiles.shape)
    return by_row @ tiles @ by_column
