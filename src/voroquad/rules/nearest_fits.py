"""Leave-one-out for independent samples: each corrects a piecewise polynomial fitted to the others."""

from __future__ import annotations

import math

import numpy as np

from .._support.arrays import Array
from ..designs.sampling import SampleSet
from .boxes import Boxes, BoxFits, samples_of_a_fit
from .fit import Fit
from .method import Method


def leave_one_out(points: Array, degree: int, threads: int) -> Array:
    """Weights (n,) of independent uniform samples (n, d).

    Parameters
    ----------
    points : ndarray, (n, d)
        Of the unit box.
    degree : int
        Total degree of the local fits; lowered where there are too few samples.
    threads : int
        Number of threads; the result does not depend on it.

    Notes
    -----
    With f̂^(−i) the reconstruction from all samples but x_i,

        Î = 1/n Σ_i [ f(x_i) − f̂^(−i)(x_i) + ∫ f̂^(−i) ]

    is unbiased (docs/theory.md, (17)). f̂ is a polynomial in each of about n equal boxes, fitted to the k samples
    nearest to the box's centre, with weights that vanish at the (k + 1)st. So f̂^(−i) differs from f̂ only in the
    boxes that have x_i among their k + 1 nearest samples; there the (k + 2)nd replaces it.
    """
    n, d = points.shape
    degree = next((p for p in range(degree, 0, -1) if _neighbours(p, d) + 2 <= n), 0)
    k = min(_neighbours(degree, d), n - 2)
    if k < 1:
        return np.full(n, 1 / n)
    boxes = Boxes.about(n, d)
    distance, nearest = boxes.nearest(points, k + 2)
    home = boxes.numbers(points)

    # If a sample is among the k + 1 nearest to the centre of its box, the fit of the box is made without it
    own = nearest[home, : k + 1] == np.arange(n)[:, None]  # (n, k + 1)
    outside = np.flatnonzero(~own.any(axis=1))
    inside, rank = np.nonzero(own)
    kept = np.array([[r for r in range(k + 1) if r != left_out] for left_out in range(k + 1)])  # (k + 1, k)
    fits = BoxFits(points, boxes.centres, boxes.half_width, distance[:, k], nearest[:, :k], degree, threads)
    fits_without = BoxFits(
        points,
        np.repeat(boxes.centres, k + 1, axis=0),
        boxes.half_width,
        np.repeat(distance[:, k + 1], k + 1),
        nearest[:, kept].reshape(-1, k),
        degree,
        threads,
    )
    values = fits.sum_at(points[outside], home[outside])
    values_without = fits_without.sum_at(points[inside], home[inside] * (k + 1) + rank)
    return (1 + (n - k - 1) * fits.mean + (k + 1) * fits_without.mean - values - values_without) / n


def fit_uniform(samples: SampleSet, method: Method, threads: int, values: Array | None = None) -> Fit:
    """Leave-one-out of each set by itself (:func:`leave_one_out`)."""
    assert method.degree is not None
    return Fit(np.stack([leave_one_out(points, method.degree, threads) for points in samples.batch]))


def _neighbours(degree: int, d: int) -> int:
    """Samples of a fit; two for a mean, for which one is enough."""
    return 2 if degree == 0 else math.ceil(samples_of_a_fit(degree, d))
