"""Cross-fit: each replicate corrects a reconstruction from all the other replicates."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial import cKDTree

from .. import _core
from .._support.arrays import Array
from ..designs.sampling import SampleSet
from . import kriging_rules
from .fit import CrossFit
from .method import Method

#: Samples of a fit per polynomial term.
SAMPLES_PER_TERM = 2.4

#: What the standard error of the mean of the Î_r, as independent ones would have it, is multiplied by: they share
#: samples, and four of them rarely meet a peak. Chosen as :data:`voroquad.rules.strata_fits.ERROR_SCALE`.
ERROR_SCALE = 1.55


def replicate_shares(points: Array, method: Method, threads: int) -> Array:
    """What the values of each replicate count in the estimate of each replicate.

    Parameters
    ----------
    points : ndarray, (sets, n, d)
        Independent replicates, two or more, each of whose points is uniform in the unit box.
    method : Method
        Local polynomials, of a degree that is lowered where the other replicates hold too few points; or kriging.
    threads : int
        Number of threads; the result does not depend on it.

    Returns
    -------
    ndarray, (sets, sets, n)
        w[r, s, j] is the weight of f(x_sj) in Î_r; Σ_sj w[r, s, j] = 1.

    Notes
    -----
    With f̂_(r) the reconstruction from the points of all replicates but r,

        Î_r = ∫ f̂_(r) + (1/n) Σ_i [ f(x_ri) − f̂_(r)(x_ri) ].

    f̂_(r) is independent of replicate r, hence no bias (docs/theory.md, (22)). Where it is not by
    kriging, it is a polynomial in each of about as many equal boxes as it has samples, fitted to those nearest to the
    box's centre; so ∫ f̂_(r) is exact.
    """
    if method.degree is None:
        return kriging_rules.krige_replicates(points, threads)
    sets, n, d = points.shape
    m = (sets - 1) * n
    order = next((p for p in range(method.degree, 0, -1) if m > math.comb(p + d, d) * SAMPLES_PER_TERM), 0)
    k = min(math.ceil(math.comb(order + d, d) * SAMPLES_PER_TERM), m)
    per_axis = max(1, math.floor(m ** (1 / d) + 1e-9))
    boxes = (np.indices((per_axis,) * d).reshape(d, -1).T + 0.5) / per_axis

    weights = np.empty((sets, sets, n))
    for r in range(sets):
        others = np.ascontiguousarray(np.delete(points, r, axis=0).reshape(m, d))
        found = cKDTree(others).query(boxes, k=np.arange(1, k + 2))
        distance, neighbours = np.asarray(found[0]), np.asarray(found[1])
        radius = distance[:, k] if m > k else distance[:, k - 1] * (1 + 1 / k)
        home = np.minimum((points[r] * per_axis).astype(np.intp), per_axis - 1)
        box_of = np.ravel_multi_index(tuple(home.T), (per_axis,) * d)
        by_box = np.argsort(box_of, kind="stable")
        starts = np.searchsorted(box_of[by_box], np.arange(len(boxes) + 1))
        controls = _core.cross_fit_controls(
            others,
            boxes,
            np.full(d, 0.5 / per_axis),
            np.maximum(radius, 1e-300),
            np.ascontiguousarray(neighbours[:, :k], dtype=np.int64),
            order,
            np.ascontiguousarray(points[r][by_box]),
            starts.astype(np.int64),
            threads,
        )
        weights[r] = np.insert(controls.reshape(sets - 1, n), r, 1 / n, axis=0)
    return weights


def fit_replicates(samples: SampleSet, method: Method, threads: int, values: Array | None = None) -> CrossFit:
    """Cross-fit of replicates; the mean over the sets of Σ_i w f is the mean of the Î_r."""
    shares = replicate_shares(samples.points, method, threads)
    return CrossFit(shares.sum(axis=0), shares, ERROR_SCALE)
