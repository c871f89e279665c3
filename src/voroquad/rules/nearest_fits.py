"""Leave-one-out of independent samples: each corrects a reconstruction box by box from its nearest others."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .. import _core
from .._support.arrays import Array
from ..designs.sampling import SampleSet
from .cross_fit import SAMPLES_PER_TERM
from .fit import Fit
from .method import Method


def leave_one_out(points: Array, order: int, threads: int) -> Array:
    """Weights (n,) of independent uniform samples (n, d).

    Parameters
    ----------
    points : ndarray, (n, d)
        Of the unit box.
    order : int
        Order of the local fits; lowered where there are too few samples.
    threads : int
        Number of threads; the result does not depend on it.

    Notes
    -----
    With f̂^(−i) the reconstruction from all samples but x_i,

        Î = 1/n Σ_i [ f(x_i) − f̂^(−i)(x_i) + ∫ f̂^(−i) ]

    is unbiased (docs/theory.md, (17)). f̂ is a polynomial in each of about n equal boxes, fitted to the k samples
    nearest to the box's centre, with weights that end at the next one. So f̂^(−i) differs from f̂ in those
    boxes alone that have x_i among their k + 1 nearest, where the (k + 2)nd stands in for it.
    """
    n, d = points.shape
    order = next((p for p in range(order, 0, -1) if _neighbours(p, d) + 2 <= n), 0)
    k = min(_neighbours(order, d), n - 2)
    if k < 1:
        return np.full(n, 1 / n)
    per_axis = max(1, math.floor(n ** (1 / d) + 1e-9))
    boxes = (np.indices((per_axis,) * d).reshape(d, -1).T + 0.5) / per_axis
    found = cKDTree(points).query(boxes, k=np.arange(1, k + 3))
    distance, nearest = np.asarray(found[0]), np.asarray(found[1])
    home = np.ravel_multi_index(tuple(np.minimum((points * per_axis).astype(np.intp), per_axis - 1).T), (per_axis,) * d)

    def integral_and_sum(
        centres: Array, radius: Array, neighbours: NDArray[np.intp], box: NDArray[np.intp], at: NDArray[np.intp]
    ) -> tuple[Array, Array]:
        """Weights in the mean of the fits over the boxes, and in the sum of their values at samples in them."""
        by_box = np.argsort(box, kind="stable")
        starts = np.searchsorted(box[by_box], np.arange(len(centres) + 1))

        def controls(test: Array, starts: NDArray[np.intp]) -> Array:
            return _core.cross_fit_controls(
                points, centres, np.full(d, 0.5 / per_axis), np.maximum(radius, 1e-300),
                np.ascontiguousarray(neighbours, dtype=np.int64), order, test, starts.astype(np.int64), threads,
            )  # fmt: skip

        mean = controls(np.empty((0, d)), np.zeros_like(starts))
        if len(at) == 0:
            return mean, np.zeros(n)
        return mean, len(at) * (mean - controls(np.ascontiguousarray(points[at[by_box]]), starts))

    # A sample is one of the k + 1 nearest to its box's centre, which then go on without it, or none of them
    own = nearest[home, : k + 1] == np.arange(n)[:, None]  # (n, k + 1)
    outside = np.flatnonzero(~own.any(axis=1))
    inside, rank = np.nonzero(own)
    kept = np.array([[r for r in range(k + 1) if r != left_out] for left_out in range(k + 1)])  # (k + 1, k)
    mean, values = integral_and_sum(boxes, distance[:, k], nearest[:, :k], home[outside], outside)
    mean_without, values_without = integral_and_sum(
        np.repeat(boxes, k + 1, axis=0),
        np.repeat(distance[:, k + 1], k + 1),
        nearest[:, kept].reshape(-1, k),
        home[inside] * (k + 1) + rank,
        inside,
    )
    return (1 + (n - k - 1) * mean + (k + 1) * mean_without - values - values_without) / n


def fit_uniform(samples: SampleSet, method: Method, threads: int, values: Array | None = None) -> Fit:
    """Leave-one-out of each set by itself (:func:`leave_one_out`)."""
    assert method.degree is not None
    return Fit(np.stack([leave_one_out(points, method.degree, threads) for points in samples.batch]))


def _neighbours(order: int, d: int) -> int:
    """Samples of a fit: two for a mean, for which one is enough; else 2.4 per polynomial term."""
    return 2 if order == 0 else math.ceil(math.comb(order + d, d) * SAMPLES_PER_TERM)
