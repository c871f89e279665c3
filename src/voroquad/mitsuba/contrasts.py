"""The noise that does not depend on the coordinates of a sample set, estimated from neighbouring samples of the set.

A pixel's samples are f_i = g(x_i) + ε_i: g depends on what the sets sample, such as a point of the lens, and ε_i on all
else. Weights that are not equal add to the noise of the ε: Var(Σ w_i ε_i) − Var(Σ ε_i / N) = Var(N w) σ² / N, with σ²
the variance of the ε. The plain sum E = Σ c_i f_i with the coefficients made here has that variance: it is a sum of
contrasts, each the difference of a sample from the line through its neighbours on either side, with random signs, so
that g cancels where it is smooth and the ε add up. Where g is rough E is too large, and the weights are trusted less.

No Mitsuba here: coefficients depend on positions and weights only, so a table has them made once.
"""

from __future__ import annotations

import numpy as np

from .._support.arrays import Array
from ..designs.grids import grid_shape, largest_grid, stratum_index


def noise_contrasts(points: Array, weights: Array, seed: int = 0) -> Array:
    """Coefficients c of the sums E = Σ c_i f_i, whose variance is what the weights add to independent noise.

    Parameters
    ----------
    points : ndarray, (sets, n, d)
        Sample sets in the unit box.
    weights : ndarray, (sets, n)
        Their weights.
    seed : int
        Of the signs.

    Returns
    -------
    ndarray, (sets, n)
        Their sum over a set is 0. For independent noise of variance σ², E[E²] is Var(N w) σ² / n, with the mean square
        of N w − 1 over all sets for Var(N w). Where no two samples of a set are neighbours, c is w − 1/n.

    Notes
    -----
    A box grid of as many cells as samples has rows along the last axis. Of the samples in a row, ordered by the last
    coordinate t, each inner one is compared with the line through its neighbours,

        f_i − a f_{i−1} − (1 − a) f_{i+1},   a = (t_{i+1} − t_i) / (t_{i+1} − t_{i−1}) ;

    two samples alone in a row are compared with each other. A contrast is scaled to unit norm, for its variance to be
    σ², and m contrasts to √(Var(N w) / (n m)).
    """
    sets, n, d = points.shape
    rows = np.zeros((sets, n))
    if d > 1:
        rows += stratum_index(points[..., :-1], _grid(n, d)[:-1])
    order = np.argsort(rows + points[..., -1], axis=-1)  # the last coordinate is below 1
    rows, t = np.take_along_axis(rows, order, -1), np.take_along_axis(points[..., -1], order, -1)
    sign = np.random.default_rng(seed).integers(0, 2, (sets, n)) * 2.0 - 1
    c = np.zeros((sets, n))

    together = rows[:, 1:] == rows[:, :-1]
    alone = np.pad(~together, ((0, 0), (1, 1)), constant_values=True)
    pair = together & alone[:, :-2] & alone[:, 2:]
    of_pair = np.where(pair, sign[:, 1:] / np.sqrt(2), 0)
    c[:, 1:] += of_pair
    c[:, :-1] -= of_pair

    inner = together[:, 1:] & together[:, :-1]
    across = t[:, 2:] - t[:, :-2]
    a = np.divide(t[:, 2:] - t[:, 1:-1], across, out=np.full(across.shape, 0.5), where=inner & (across > 0))
    of_line = np.where(inner, sign[:, 1:-1] / np.sqrt(1 + a**2 + (1 - a) ** 2), 0)
    c[:, 1:-1] += of_line
    c[:, :-2] -= a * of_line
    c[:, 2:] -= (1 - a) * of_line

    number = pair.sum(-1) + inner.sum(-1)
    spread = np.mean((n * weights - 1) ** 2)
    c *= np.sqrt(spread / (n * np.maximum(number, 1)))[:, None]
    in_place = np.empty_like(c)
    np.put_along_axis(in_place, order, c, axis=-1)
    return np.where((number > 0)[:, None], in_place, weights - 1 / n)


def _grid(n: int, d: int) -> tuple[int, ...]:
    """A near-cubic grid of n boxes, or of fewer where n has none."""
    try:
        return grid_shape(n, d)
    except ValueError:
        return largest_grid(n, d)
