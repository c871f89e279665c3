"""Leave-one-out rules: each sample corrects a fit in which it is not used, so the estimate is unbiased for any fit."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from .. import _core
from .._support.arrays import Array
from ..designs.design import design_of
from ..designs.grids import stratum_index
from ..designs.sampling import SampleSet
from . import kriging_rules
from .error_bars import of_corrections
from .fit import ResidualFit
from .method import HIGHEST_DIMENSION, Method

#: Fewest samples of a fit per polynomial term. With fewer, on a small grid, the order is lowered.
FEWEST_PER_TERM = 1.5

#: What (Σ (|S_i| r_i)²)^½ is multiplied by to give the standard error, by dimension and default order, each
#: from a least number of strata on: the largest finite factor of these grids in benchmarks/results/error_scale.csv
#: (benchmarks/calibrate_errors.py), rounded up to a multiple of 0.05.
ERROR_SCALE: dict[tuple[int, int | str], tuple[tuple[int, float], ...]] = {
    (1, 1): ((1, 1.4),), (1, 2): ((1, 0.55),), (1, 4): ((1, 0.55),), (1, 6): ((1, 0.7),),
    (1, 8): ((256, 0.55), (1, 0.7)),
    (2, "kriging"): ((36, 1.05), (1, 1.4)), (2, 8): ((1, 1.2),),
    (3, "kriging"): ((36, 1.05), (1, 1.2)),
    (4, "kriging"): ((200, 1.0), (100, 1.1), (1, 1.3)),
}  # fmt: skip


@dataclass(frozen=True)
class Stencil:
    """Order of the polynomial of a stratum, and the strata along each axis of the block that it is fitted to."""

    order: int
    width: tuple[int, ...]


def stencil(order: int, strata: tuple[int, ...]) -> Stencil:
    """The smallest robust block of (2m+1)^d strata for an order.

    On a grid with fewer strata along an axis the block is as wide as the grid; where too few
    samples are left, the order is the highest that they support.

    Examples
    --------
    >>> from voroquad.rules.strata_fits import stencil
    >>> stencil(6, (32, 32))
    Stencil(order=6, width=(9, 9))
    >>> stencil(6, (5, 5))
    Stencil(order=4, width=(5, 5))
    """
    d = len(strata)
    for p in range(order, 0, -1):
        terms = math.comb(p + d, d)
        wanted = terms * _samples_per_term(p, d)
        m = next(m for m in itertools.count(1) if (2 * m + 1) ** d - 1 >= wanted)
        width = tuple(min(2 * m + 1, k) for k in strata)
        if math.prod(width) - 1 >= FEWEST_PER_TERM * terms:
            return Stencil(p, width)
    return Stencil(0, tuple(min(3, k) for k in strata))


def _samples_per_term(order: int, d: int) -> float:
    """Samples that a fit should have per polynomial term. With fewer, weights are occasionally huge."""
    if d <= 2 and order >= 7:
        return 3.0
    return 2.4 if d == 1 else 2.2


def error_scale(method: Method, strata: tuple[int, ...]) -> float:
    """The factor between (Σ (|S_i| r_i)²)^½ and the standard error of a set (:data:`ERROR_SCALE`).

    Of a method that is no default of the dimension, the largest. It is at least 1: if an integrand behaves as a power
    at an end, few corrections make up the error, and a smaller factor would be wrong.
    """
    d, n = min(len(strata), 4), math.prod(strata)
    fitted = method.order if method.degree is None else stencil(method.degree, strata).order
    of_dimension = [scales for (dimension, _), scales in ERROR_SCALE.items() if dimension == d]
    scales = [ERROR_SCALE[d, fitted]] if (d, fitted) in ERROR_SCALE else of_dimension
    return max(1.0, *(next(factor for least, factor in s if n >= least) for s in scales))


def _plain(values: Array) -> tuple[Array, Array]:
    """Equal weights (sets, n), and how far values (sets, fields, n) are from the mean of all others of their set."""
    sets, _, n = values.shape
    weights = np.full((sets, n), 1 / n)
    if n == 1:
        return weights, values
    return weights, (values - values.mean(axis=-1, keepdims=True)) * (n / (n - 1))


def fit_strata(samples: SampleSet, method: Method, threads: int, values: Array | None = None) -> ResidualFit:
    """Leave-one-out with one sample per stratum.

    Parameters
    ----------
    samples : SampleSet
        Stratified or multi-jittered: (n, d) or (sets, n, d).
    method : Method
        Local polynomials, or kriging.
    threads : int
        Number of threads; the result does not depend on it.
    values : ndarray, (sets, fields, n), optional
        Values of integrands at the samples.

    Returns
    -------
    ResidualFit
        The weights of a set sum to 1.

    Notes
    -----
    P_i is the polynomial fitted by least squares to the samples of the block of
    strata around S_i without x_i, or the prediction by kriging, and

        Î = Σ_i [ ∫_{S_i} P_i + |S_i| (f(x_i) − P_i(x_i)) ].

    P_i does not depend on x_i, which is uniform in S_i, so each term has mean ∫_{S_i} f: the rule is
    unbiased for every integrand. Above eight dimensions degree 0 predicts the mean of all other samples, in place of
    those around S_i; either way the weights are equal. Of multi-jittered sets, all samples of the colour of x_i are
    left out. docs/theory.md, (10) and (11).
    """
    points = samples.batch
    assert samples.strata is not None
    sets, n, _ = points.shape
    if values is None:
        values = np.empty((sets, 0, n))
    period = design_of(samples.design).period(samples.d)
    index = stratum_index(points, samples.strata)
    shuffled = bool((index != np.arange(n)).any())
    order_of = np.argsort(index, axis=-1)
    if shuffled:
        points = np.take_along_axis(points, order_of[..., None], axis=1)
        values = np.take_along_axis(values, order_of[:, None], axis=2)
    points, values = np.ascontiguousarray(points), np.ascontiguousarray(values)
    if method.degree is None:
        weights, residuals = kriging_rules.krige_strata(points, samples.strata, period, values, threads)
    elif samples.d > HIGHEST_DIMENSION:
        weights, residuals = _plain(values)
    else:
        block = stencil(method.degree, samples.strata)
        weights, residuals, _ = _core.leave_one_out_strata(
            points, samples.strata, block.width, period, block.order, values, threads
        )
    if shuffled:
        back = np.argsort(order_of, axis=-1)
        weights = np.take_along_axis(weights, back, axis=-1)
        residuals = np.take_along_axis(residuals, back[:, None], axis=2)
    return ResidualFit(weights, residuals, partial(of_corrections, scale=error_scale(method, samples.strata)))
