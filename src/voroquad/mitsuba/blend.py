"""The blend: for each tile of the image, the share λ of the weights that leaves the least noise.

With A the plain mean of a pixel's samples and D the weighted mean minus the plain one, A + λ D has the same
expectation for every λ that does not depend on the samples in A and D, since D has mean zero. Its variance is least at
λ = −Cov(A, D) / Var(D): 1 where the sampled domain makes the noise, 0 where other dimensions do (docs/theory.md,
section 8).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.arrays import Indices

Floats = NDArray[np.floating[Any]]

#: Side of a tile in pixels, even
TILE = 16
#: Below this fraction of |A|, D is the rounding error of sums in single precision
ROUNDING = 2.0**-20
#: Least and greatest standard deviation of λ between tiles that is assumed
SPREAD = (0.25, 0.5)
#: Weight of a tile's neighbour in its surroundings, less than 1; that of the next one is the square, and so on
NEARBY = 0.7


def checkerboard(height: int, width: int, start: int = 0) -> Indices:
    """The half, 0 or 1, of each pixel (height, width); `start` is that of the first."""
    return (np.arange(start, start + height)[:, None] + np.arange(width)) & 1


class Share:
    """Estimates λ from the pixels and rounds observed so far.

    Parameters
    ----------
    height, width : int
        Size of the image in pixels.

    Attributes
    ----------
    moments : ndarray, (6, 2, rows, columns)
        Sums of p, s, p², p s, s² and s³ over the rounds and over the pixels of each tile, separately for each half of a
        checkerboard of pixels.

    Notes
    -----
    Every pixel of every round gives a p with the expectation Cov(A, D), and s = D² with the expectation Var(D), both
    summed over the colour channels, so that −Σ p / Σ s estimates λ.

    * In the first round (`observe_noise`) p = E² − D², where E is an estimate of the noise that the weights add,
      because they multiply what they do not know (`voroquad.mitsuba.contrasts`): the weighted mean A + D has little
      else in common with D, hence −Cov(A, D) ≈ Var(D) − Var(E).
    * In later rounds (`observe_deviation`) p = (A − c) D with c the pixel's mean over the rounds before. As D has mean
      zero and c does not depend on it, p has exactly that expectation.

    A tile's estimate l has a variance v, from the spread of p + l s over pixels and rounds. Tiles resemble those around
    them: λ is the mean of l and of a prior m, weighted by 1/v and 1/t², where m and the variance t² around it are
    weighted means of l and of (l − m)² − v over all tiles, the nearer the more, and, for m, over one further tile with
    λ = 0. The result is clipped to [0, 1]. Pixels with a value that is not finite are left out.
    """

    def __init__(self, height: int, width: int) -> None:
        self._size = height, width
        self.moments = np.zeros((6, 2, -(-height // TILE), -(-width // TILE)))

    def observe_noise(self, plain: Floats, difference: Floats, noise: Floats) -> None:
        """Add a round by A, D and E, each (height, width, channels)."""
        self._observe(plain, difference, lambda rows, d: noise[rows].astype(np.float64) ** 2 - d * d)

    def observe_deviation(self, plain: Floats, difference: Floats, centre: Floats) -> None:
        """Add a round by A, D and c, each (height, width, channels)."""
        self._observe(plain, difference, lambda rows, d: (plain[rows] - centre[rows]) * d)

    def _observe(self, plain: Floats, difference: Floats, product: Callable[[slice, Floats], Floats]) -> None:
        """Add p (of some rows, from their D) and s = D² to the moments."""
        for row, rows in enumerate(strips(len(plain))):
            d = difference[rows].astype(np.float64)
            with np.errstate(invalid="ignore", over="ignore"):
                seen = np.abs(d) > ROUNDING * np.abs(plain[rows])  # false for NaN
                p = np.where(seen, product(rows, d), 0).sum(-1)
                s = np.where(seen, d * d, 0).sum(-1)
            finite = np.isfinite(p) & np.isfinite(s) & np.isfinite(plain[rows]).all(-1)
            self.moments[:, :, row] += _by_half(np.where(finite, p, 0), np.where(finite, s, 0))

    def map(self) -> Floats:
        """λ (height, width) of each pixel's tile."""
        return self._of_pixels(least_variance(self.moments.sum(1)))

    def halves(self) -> Floats:
        """λ (2, height, width) for the pixels of each half of a checkerboard, by those of the other."""
        return self._of_pixels(np.stack([least_variance(self.moments[:, half]) for half in (1, 0)]))

    def _of_pixels(self, tiles: Floats) -> Floats:
        """Each pixel's value (…, height, width) of its tile, float32."""
        height, width = self._size
        columns = tiles.astype(np.float32).repeat(TILE, axis=-1)[..., :width]
        return columns.repeat(TILE, axis=-2)[..., :height, :]


def _by_half(p: Floats, s: Floats) -> Floats:
    """Sums (6, 2, columns) of p, s, p², p s, s² and s³ over the pixels of each half of the tiles in a row of tiles."""
    width = p.shape[1]
    columns = -(-width // TILE)
    rows = np.zeros((6, 2, columns * TILE))  # over even rows, and over odd ones
    factors: list[tuple[Floats, Floats | float]] = [(p, 1.0), (s, 1.0), (p, p), (p, s), (s, s), (s * s, s)]
    for sums, (a, b) in zip(rows, factors, strict=True):
        product = a * b
        sums[0, :width], sums[1, :width] = product[::2].sum(0), product[1::2].sum(0)
    pairs = rows.reshape(6, 2, columns, TILE // 2, 2)
    even, odd = pairs[..., 0].sum(-1), pairs[..., 1].sum(-1)  # columns of a tile
    return np.stack([even[:, 0] + odd[:, 1], odd[:, 0] + even[:, 1]], 1)


def of_own_half(halves: Floats) -> Floats:
    """Each pixel's value (height, width) of those (2, height, width) for the halves of a checkerboard."""
    own = halves[0].copy()
    for row in (0, 1):
        own[row::2, 1 - row :: 2] = halves[1, row::2, 1 - row :: 2]
    return own


def least_variance(moments: Floats) -> Floats:
    """λ of tiles from sums (6, rows, columns) over pixels and rounds of p, s, p², p s, s² and s³, see `Share`.

    With standard deviations t s of the p about −λ s, the variance of l = −Σ p / Σ s is t² Σ s² / (Σ s)², and
    Σ (p + l s)² has the mean t² (Σ s² − 2 Σ s³ / Σ s + (Σ s²)² / (Σ s)²): t² (n − 1) s² for n equal s, 0 for one pixel.
    """
    p, s, pp, ps, ss, sss = moments
    some = s > 0
    denominator = np.where(some, s, 1)
    estimate = -p / denominator
    residual = np.maximum(pp + 2 * estimate * ps + estimate**2 * ss, 0)
    free = ss - 2 * sss / denominator + ss**2 / denominator**2
    known = some & (free > 1e-9 * ss)
    if not known.any():
        return np.zeros_like(s)
    variance = np.full_like(free, np.inf)
    np.divide(residual * ss, denominator**2 * free, where=known, out=variance)

    # The prior: a mean over the surrounding tiles, with outliers clipped
    weight = 1 / (variance + SPREAD[0] ** 2)
    bounded = np.clip(estimate, -0.5, 1.5)
    near = _surroundings(weight)
    # … and one further tile with λ = 0: where λ cannot be known it is near 0
    prior = np.clip(_surroundings(weight * bounded) / (near + SPREAD[1] ** -2), 0, 1)
    deviation = np.where(known, (bounded - prior) ** 2 - np.where(known, variance, 0), 0)
    between = np.clip(_surroundings(weight * deviation) / near, SPREAD[0] ** 2, SPREAD[1] ** 2)

    trust = between / (variance + between)  # 1 where the tile's own estimate is certain, 0 where it is worthless
    return np.clip(trust * estimate + (1 - trust) * prior, 0, 1)


def strips(height: int, tiles: int = 1) -> list[slice]:
    """The rows of so many rows of tiles: what is done to one strip at a time stays in the processor's cache."""
    return [slice(top, min(top + tiles * TILE, height)) for top in range(0, height, tiles * TILE)]


def _surroundings(tiles: Floats) -> Floats:
    """Sums over all tiles, the nearer counting more."""
    by_row, by_column = (NEARBY ** np.abs(np.subtract.outer(np.arange(n), np.arange(n))) for n in tiles.shape)
    return by_row @ tiles @ by_column
