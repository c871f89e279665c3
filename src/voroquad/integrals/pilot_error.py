"""The variance of the pilot rule, read off how nets of samples differ from their own halves."""

from __future__ import annotations

import numpy as np

from .._support.arrays import Array, Indices

#: Differences that make up a sum of squares, at least, for it to count where others are more, and at most.
FEWEST_DIFFERENCES, MOST_DIFFERENCES = 4.0, 32.0

#: Powers of the number of samples by which the variance of a net falls faster than that of independent samples: 2 for
#: smooth functions, 1/d at edges. The last factor makes up for powers that are found by chance.
STEEPEST, SHARE_OF_SLOPE = 2.0, 0.9

#: Fewest degrees of freedom that are told. With one or two, intervals of other levels would be far too wide or narrow.
FEWEST_DEGREES = 3.0


def variance(squares: Array, fourths: Array) -> tuple[Array, Array]:
    """Variances (fields,) of the sum over the cells of mean residuals, and their degrees of freedom.

    Parameters
    ----------
    squares, fourths : ndarray, (fields, levels, scales)
        Sums of squares and of fourth powers, of residuals at scale 0, and at scale s of the differences between the
        sums of the halves of each block of 2^s samples; by the level l of cells, which have 2^l samples.

    Notes
    -----
    Both halves lie in one cell and have the same mean. With V_s the variance of the sums over blocks of scale s, added
    up, a sum of squares has the mean 2 V_{s−1} − V_s, which is (2^(1+a) − 1) V_s where V falls by 2^−a from scale to
    scale. A line through the logarithms of the sums of squares tells a, and V at scale l: docs/theory.md, (29). Each
    sum of squares counts as much as equal differences that make it as certain, (Σ D²)² / Σ D⁴.
    """
    total, uncertainty = np.zeros(len(squares)), np.zeros(len(squares))
    for level in range(squares.shape[1]):
        scales = np.arange(min(level, 1), level + 1)
        of_level, freedom = _extrapolated(squares[:, level, scales], fourths[:, level, scales], scales, level)
        of_level *= 4.0**-level
        total += of_level
        uncertainty += np.square(of_level) / freedom
    total[~np.isfinite(squares).all(axis=(1, 2))] = np.nan
    freedom = np.divide(np.square(total), uncertainty, out=np.full(len(total), np.inf), where=uncertainty > 0)
    return total, np.maximum(freedom, FEWEST_DEGREES)


def _extrapolated(squares: Array, fourths: Array, scales: Indices, level: int) -> tuple[Array, Array]:
    """V at the scale `level` (fields,), and its degrees of freedom, from sums (fields, scales)."""
    # Where the fourth powers under- or overflow, a sum counts as one difference.
    usual = (fourths > 0) & np.isfinite(fourths)
    count = np.divide(np.square(squares), fourths, out=np.where(squares > 0, 1.0, 0.0), where=usual)
    least = np.minimum(FEWEST_DIFFERENCES, count.max(axis=1, keepdims=True))
    weights = np.where((count >= least) & (count > 0), np.minimum(count, MOST_DIFFERENCES), 0.0)
    known = weights.any(axis=1)
    whole = np.where(known, weights.sum(axis=1), 1.0)
    logarithms = np.log2(squares, out=np.zeros_like(squares), where=weights > 0)
    at, height = ((weights * x).sum(axis=1) / whole for x in (scales, logarithms))
    apart = scales - at[:, None]
    spread = (weights * np.square(apart)).sum(axis=1)
    falls = -(weights * apart * logarithms).sum(axis=1)
    slope = SHARE_OF_SLOPE * np.clip(np.divide(falls, spread, out=np.zeros_like(spread), where=spread > 0), 0, STEEPEST)
    distance = level - at
    of_halves = np.where(level > 0, 2.0 ** (1 + slope) - 1, 1.0)
    found = np.where(known, 2.0 ** (height - slope * distance) / of_halves, 0.0)
    beyond = np.divide(np.square(distance), spread, out=np.where(distance > 0, np.inf, 0.0), where=spread > 0)
    return found, np.maximum(1 / (1 / whole + beyond), 1.0)
