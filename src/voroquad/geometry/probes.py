"""Measures of Voronoi cells in many dimensions, by counting the probes that fall into each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .._support.arrays import Array

#: Probes per sample.
PROBES = 256

_SEED = 20
_BLOCK = 2**16  # probes in memory at a time


def probed_measures(
    points: Array, threads: int, sides: Array | None = None, periodic: NDArray[np.bool_] | None = None
) -> Array:
    """The share of probes nearest to each point.

    Parameters
    ----------
    points : ndarray, (n, d) or (sets, n, d)
        Points of the box. Points that coincide share their cell equally.
    threads : int
        Number of threads; the result does not depend on it.
    sides : ndarray, (d, 2), optional
        Lower and upper end of the box's sides; by default 0 and 1.
    periodic : ndarray of bool, (d,), optional
        Which axes are periodic; by default none. Points lie below their upper ends.

    Returns
    -------
    ndarray, (n,) or (sets, n)
        They sum to 1.

    Notes
    -----
    The probes are M ≥ 256 n scrambled Sobol' points, always the same. As independent ones they would count a
    cell of measure v with a standard error of (v (1 − v) / M)^½, 6 % of a cell of measure 1/n, and add
    1/256 of the variance of the plain mean to an estimate; Sobol' points do no worse to speak of.
    """
    from scipy.stats import qmc

    if points.ndim == 3:
        return np.stack([probed_measures(one, threads, sides, periodic) for one in points])
    n, d = points.shape
    low, high = np.zeros(d) if sides is None else sides[:, 0], np.ones(d) if sides is None else sides[:, 1]
    # SciPy's tree takes 0 for an axis that is not periodic, and starts periodic ones at 0
    periods = None if periodic is None else np.where(periodic, high - low, 0.0)
    start = 0.0 if periods is None else np.where(periods > 0, low, 0.0)
    distinct, place, copies = np.unique(points, axis=0, return_inverse=True, return_counts=True)
    tree, counts = _tree(distinct - start, periods), np.zeros(len(distinct))
    probes = qmc.Sobol(d, rng=_SEED)
    total = 1 << (PROBES * n - 1).bit_length()
    block = min(total, _BLOCK)
    for _ in range(total // block):
        _, nearest = tree.query((low - start) + (high - low) * probes.random(block), workers=threads)
        counts += np.bincount(nearest, minlength=len(distinct))
    place = place.reshape(-1)
    return (counts / copies / total)[place]


def _tree(points: Array, periods: Array | None) -> cKDTree:
    if periods is None:
        return cKDTree(points)
    wrapped = np.where((periods > 0) & (points >= periods), 0.0, points)  # if rounding has put them at the end
    return cKDTree(wrapped, boxsize=periods)
