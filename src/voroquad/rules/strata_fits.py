"""Leave-one-out rules: each sample corrects a fit that it had no part in, so any fit is unbiased."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..designs.design import design_of
from ..designs.grids import stratum_index
from ..designs.sampling import SampleSet
from . import kriging_rules

Array = NDArray[np.float64]

#: Highest order of a fit by dimension; above three a fit needs too many samples.
HIGHEST_ORDER = {1: 8, 2: 8, 3: 8} | dict.fromkeys(range(4, 9), 3)

#: Fewest samples of a fit per polynomial term: with less, even on a small grid, the order is lowered.
FEWEST_PER_TERM = 1.5

#: Default order on a line and in the plane: the first entry whose least number of strata along an axis is
#: reached. All else is left to kriging.
DEFAULT_ORDERS = {
    1: ((96, 8), (48, 6), (16, 4), (8, 2), (4, 1), (1, 0)),
    2: ((34, 8),),
}


#: What (Σ (|S_i| r_i)²)^½ is multiplied by to give the standard error, by dimension and default order, each
#: from a least number of strata on: benchmarks/calibrate_errors.py, benchmarks/results/error_scale.csv.
ERROR_SCALE: dict[tuple[int, int | str], tuple[tuple[int, float], ...]] = {
    (1, 1): ((1, 1.38),), (1, 2): ((1, 0.55),), (1, 4): ((1, 0.55),), (1, 6): ((1, 0.65),),
    (1, 8): ((256, 0.5), (1, 0.65)),
    (2, "kriging"): ((36, 1.0), (1, 1.4)), (2, 8): ((1, 0.95),),
    (3, "kriging"): ((36, 1.0), (1, 1.2)),
    (4, "kriging"): ((200, 1.0), (100, 1.1), (1, 1.3)),
}  # fmt: skip


def check_order(order: object, d: int) -> None:
    """Raise ValueError for an order that no rule of :func:`voroquad.quad` has in d dimensions."""
    highest = HIGHEST_ORDER.get(d, 0)
    if order in ("kriging", "auto"):
        return
    if not isinstance(order, int) or isinstance(order, bool) or not 0 <= order <= highest:
        numbers = f"a whole number from 0 to {highest}" if highest else "0"
        raise ValueError(f"order must be {numbers} for d = {d}, 'kriging' or 'auto', got {order!r}")


@dataclass(frozen=True)
class Stencil:
    """What a stratum's polynomial is fitted to: its order, and the strata of its block along each axis."""

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
    """Samples that a fit should have per polynomial term. Tighter fits have rare, huge weights."""
    if d <= 2 and order >= 7:
        return 3.0
    return 2.4 if d == 1 else 2.2


def default_order(strata: tuple[int, ...]) -> int | str:
    """The order that :func:`voroquad.quad` takes for one sample in each stratum of a grid.

    It depends on the dimension and on the least number of strata along an axis
    (:data:`DEFAULT_ORDERS`), never on the integrand.
    """
    for least, order in DEFAULT_ORDERS.get(len(strata), ()):
        if min(strata) >= least:
            return order
    return "kriging"


def error_scale(order: int | str, strata: tuple[int, ...]) -> float:
    """The factor between (Σ (|S_i| r_i)²)^½ and the standard error of a set (:data:`ERROR_SCALE`).

    Of an order that is no default of the dimension, the largest.
    """
    d, n = min(len(strata), 4), math.prod(strata)
    fitted = order if isinstance(order, str) else stencil(order, strata).order
    of_dimension = [scales for (dimension, _), scales in ERROR_SCALE.items() if dimension == d]
    scales = [ERROR_SCALE[d, fitted]] if (d, fitted) in ERROR_SCALE else of_dimension
    return max(next(factor for least, factor in s if n >= least) for s in scales)


def fit_strata(samples: SampleSet, order: int | str, threads: int, values: Array | None = None) -> tuple[Array, Array]:
    """Leave-one-out with one sample per stratum.

    Parameters
    ----------
    samples : SampleSet
        Stratified or multi-jittered: (n, d) or (sets, n, d).
    order : int or "kriging"
        Order of the fits.
    threads : int
        Number of threads; the result does not depend on it.
    values : ndarray, (sets, fields, n), optional
        Values of integrands at the samples.

    Returns
    -------
    weights : ndarray, (sets, n)
        They sum to 1.
    residuals : ndarray, (sets, fields, n)
        f(x_i) − P_i(x_i), what each sample corrects.

    Notes
    -----
    P_i is the polynomial of total degree `order` fitted by least squares to the samples of the block of
    strata around S_i without x_i, or the prediction by kriging, and

        Î = Σ_i [ ∫_{S_i} P_i + |S_i| (f(x_i) − P_i(x_i)) ].

    P_i does not depend on x_i, which is uniform in S_i, so each term has mean ∫_{S_i} f: the rule is
    unbiased for every integrand. Of multi-jittered sets, all samples of the colour of x_i are left out.
    docs/theory.md, (10) and (11).
    """
    points = samples.points if samples.points.ndim == 3 else samples.points[None]
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
    if isinstance(order, str):
        weights, residuals = kriging_rules.krige_strata(points, samples.strata, period, values, threads)
    else:
        block = stencil(order, samples.strata)
        weights, residuals, _ = _core.leave_one_out_strata(
            points, samples.strata, block.width, period, block.order, values, threads
        )
    if shuffled:
        back = np.argsort(order_of, axis=-1)
        weights = np.take_along_axis(weights, back, axis=-1)
        residuals = np.take_along_axis(residuals, back[:, None], axis=2)
    return weights, residuals


def weigh_strata(samples: SampleSet, order: int | str, threads: int) -> Array:
    """The weights (n,) or (sets, n) of :func:`fit_strata`."""
    weights, _ = fit_strata(samples, order, threads)
    return weights if samples.points.ndim == 3 else weights[0]


def weigh_independent(samples: SampleSet, order: str, threads: int) -> Array:
    """Weights (n,) or (sets, n) of independent uniform samples by kriging."""
    sets = np.reshape(samples.points, (-1, samples.n, samples.d))
    return kriging_rules.krige_independent(sets, threads).reshape(samples.points.shape[:-1])
