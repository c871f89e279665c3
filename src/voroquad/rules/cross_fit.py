"""Cross-fit: each replicate corrects a reconstruction from all the other replicates."""

from __future__ import annotations

import math

import numpy as np

from .._support.arrays import Array
from ..designs.sampling import SampleSet
from . import kriging_rules
from .boxes import Boxes, BoxFits, samples_of_a_fit
from .faces import of_replicates
from .fit import CrossFit
from .method import Method
from .steps import of_steps

#: Factor of the standard error of the mean of the Î_r. They are not independent, since they share samples, and four of
#: them rarely meet a peak. Chosen like :data:`voroquad.rules.strata_fits.ERROR_SCALE`, by
#: benchmarks/calibrate_errors.py.
ERROR_SCALE = 1.55


def replicate_shares(points: Array, method: Method, threads: int) -> Array:
    """Weights of the values of all replicates in the estimate of each replicate.

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
    degree = next((p for p in range(method.degree, 0, -1) if m > samples_of_a_fit(p, d)), 0)
    k = min(math.ceil(samples_of_a_fit(degree, d)), m)
    boxes = Boxes.about(m, d)

    weights = np.empty((sets, sets, n))
    for r in range(sets):
        others = np.ascontiguousarray(np.delete(points, r, axis=0).reshape(m, d))
        distance, nearest = boxes.nearest(others, k + 1)
        radius = distance[:, k] if m > k else distance[:, k - 1] * (1 + 1 / k)
        fits = BoxFits(others, boxes.centres, boxes.half_width, radius, nearest[:, :k], degree, threads)
        controls = fits.controls(points[r], boxes.numbers(points[r]))
        weights[r] = np.insert(controls.reshape(sets - 1, n), r, 1 / n, axis=0)
    return weights


def fit_replicates(samples: SampleSet, method: Method, threads: int, values: Array | None = None) -> CrossFit:
    """Cross-fit of replicates; the mean over the sets of Σ_i w f is the mean of the Î_r."""
    shares = replicate_shares(samples.points, method, threads)
    if values is None:
        return CrossFit(shares.sum(axis=0), shares, ERROR_SCALE)
    powers, steps = (np.sqrt(of(samples.points, values)) for of in (of_replicates, of_steps))
    return CrossFit(shares.sum(axis=0), shares, ERROR_SCALE, powers, steps)
