"""Gaussian measures in many dimensions, rotated such that the coordinates that matter most, learned from a pilot, come
first."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import make_lsq_spline
from scipy.special import ndtri

from .._support.arrays import Array
from .._support.products import rows_times
from ..designs.sampling import sample
from .estimates import Estimate
from .integrand import Integrand
from .measures import ProductMeasure
from .pieces import Part
from .regions import Region, within
from .units import scaled

#: Fewest dimensions in which coordinates are turned; below, strata do without.
FEWEST_DIMENSIONS = 5

#: Evaluations of a pilot for each coordinate, of which fewer are of no use.
FEWEST_PER_DIMENSION = 4

#: Gauss-Newton steps at most; inner knots of splines at most, and points for each; bins of the gradients.
STEPS, KNOTS, PER_KNOT, BINS = 8, 8, 16, 8

#: Parts of the evaluations, each the size of a replicate at least; the pilot takes half of one. Kinks and jumps along
#: the first directions gain more from large nets than from many.
PARTS = 4


class RotatedGaussian:
    """Independent normal coordinates, as a map from the unit box whose first axis is the direction `q[0]`, and so on.

    x = mean + sd · qᵀ Φ⁻¹(u). The Gaussian is invariant under every rotation.

    Parameters
    ----------
    mean, sd : ndarray, (d,)
        Of the coordinates.
    q : ndarray, (d, d)
        Orthogonal.
    """

    empty = False

    def __init__(self, mean: Array, sd: Array, q: Array):
        self.mean, self.sd, self.q = mean, sd, q

    @property
    def d(self) -> int:
        """Dimension."""
        return len(self.mean)

    def pull_back(self, u: Array) -> tuple[Array, Array]:
        """Points x (d, n) and their mass element, 1, at u (d, n)."""
        z = rows_times(ndtri(within(u)).T, self.q).T
        return self.mean[:, None] + self.sd[:, None] * z, np.ones(u.shape[1])


@dataclass(frozen=True)
class RotatingEstimator:
    """Learns the rotation from a pilot and estimates with fresh samples, so that the estimate stays unbiased.

    Attributes
    ----------
    gaussian : RotatedGaussian
        Of no rotation yet.
    integrand : callable
        Makes the integrand of a region.
    estimator : callable
        Takes a region and the number of replicates, and returns what estimates from at most so many samples of each.
    sets : int
        Replicates that are asked for; the pilot of several is beside them. A single one is split into 3 to 7.
    rng : numpy.random.Generator
        Of the pilot.
    """

    gaussian: RotatedGaussian
    integrand: Callable[[Region], Integrand]
    estimator: Callable[[Region, int], Callable[[int], Estimate]]
    sets: int
    rng: np.random.Generator

    def __call__(self, n: int) -> Estimate:
        """An estimate from at most n evaluations of each set."""
        d = self.gaussian.d
        size = 1 << max(0, (n // PARTS).bit_length() - 1)
        pilot = size // 2
        if pilot < FEWEST_PER_DIMENSION * d:
            return self.estimator(self.gaussian, self.sets)(n)
        sets, each = (self.sets, n) if self.sets > 1 else ((n - pilot) // size, size)
        u = sample("sobol", pilot, d, rng=self.rng).points
        values = self.integrand(self.gaussian)(u)
        q = directions(ndtri(within(u)), values)
        found = self.estimator(RotatedGaussian(self.gaussian.mean, self.gaussian.sd, q), sets)(each)
        return replace(found, n=found.n + pilot)


def rotating(
    parts: list[Part],
    integrand: Callable[[Region], Integrand],
    estimator: Callable[[Region, int], Callable[[int], Estimate]],
    sets: int,
    rng: np.random.Generator,
) -> RotatingEstimator | None:
    """What estimates an expectation over a Gaussian of many dimensions; None for all else."""
    measure = parts[0].region
    if not isinstance(measure, ProductMeasure) or measure.d < FEWEST_DIMENSIONS:
        return None
    moments = [_moments(t) for t in measure.distributions]
    known = [m for m in moments if m is not None]
    if len(known) < len(moments):
        return None
    mean, sd = np.array(known).T
    return RotatingEstimator(RotatedGaussian(mean, sd, np.eye(measure.d)), integrand, estimator, sets, rng)


def _moments(distribution: Any) -> tuple[float, float] | None:
    """Mean and standard deviation of a normal distribution of either kind that SciPy has; None for others."""
    import scipy.stats

    if isinstance(distribution, scipy.stats.Normal):
        return float(distribution.mean()), float(distribution.standard_deviation())
    if getattr(getattr(distribution, "dist", None), "name", None) == "norm":
        return float(distribution.mean()), float(distribution.std())
    return None


def directions(z: Array, values: Array) -> Array:
    """Orthogonal q (d, d): along its first rows values (fields, m) at points z (m, d) vary most.

    Several fields count with their variances set to 1.

    Notes
    -----
    The first row is the index of the single-index model f ≈ g(q₀·z) (Ichimura 1993), g a cubic spline: from the slope
    of the linear regression on, Gauss-Newton steps. What the model leaves, r, tells the others, the eigenvectors of an
    estimate of E[∇r ∇rᵀ] in the space across the first (active subspaces, Liu and Owen 2023, without gradients). By
    Stein's identity the mean gradient of r among points of like q₀·z is there the mean of r z, and the mean Hessian of
    r the mean of r z zᵀ.
    """
    values = scaled(values, axis=1)
    centred = values - values.mean(axis=1, keepdims=True)
    size = centred.std(axis=1)
    known = np.isfinite(size) & (size > 0)
    if not known.any():
        return np.eye(z.shape[1])
    centred = centred[known] / size[known, None]
    first = _index(z, centred)
    rest = centred - _curve(z @ first, centred)[0]
    across = z - np.outer(z @ first, first)
    squares = sum(_gradients(z @ first, across, r) for r in rest)
    vectors = np.linalg.eigh(squares)[1][:, ::-1]
    return np.linalg.qr(np.column_stack([first, vectors]))[0].T[: z.shape[1]]


def _index(z: Array, values: Array) -> Array:
    """The direction (d,) of which values (fields, m) are most nearly functions."""
    slopes = np.linalg.lstsq(z, values.T, rcond=None)[0].T
    best = first = np.linalg.svd(slopes)[2][0]
    least = np.inf
    for _ in range(STEPS):
        s = z @ first
        curve, slope = _curve(s, values)
        missed = float(np.square(values - curve).sum())
        if missed >= least:
            break
        best, least = first, missed
        across = z - np.outer(s, first)
        design = (slope[:, :, None] * across).reshape(-1, len(first))
        first = first + np.linalg.lstsq(design, (values - curve).ravel(), rcond=None)[0]
        first /= np.linalg.norm(first)
    return best


def _curve(s: Array, values: Array) -> tuple[Array, Array]:
    """Cubic splines of s (m,) that fit values (fields, m) by least squares, and their slopes, (fields, m) each."""
    order = np.argsort(s)
    inner = np.quantile(s, np.linspace(0, 1, min(KNOTS, len(s) // PER_KNOT) + 2)[1:-1])
    ends = s[order[[0] * 4]], s[order[[-1] * 4]]
    spline = make_lsq_spline(s[order], values[:, order].T, np.concatenate([ends[0], inner, ends[1]]))
    return spline(s).T, spline.derivative()(s).T


def _gradients(s: Array, across: Array, r: Array) -> Array:
    """Σ p g gᵀ of the mean gradients g of r (m,) in bins of s of probability p, and the mean Hessian squared."""
    m = len(s)
    hessian = (across.T * r) @ across / m
    found: Array = hessian @ hessian
    for bin_ in np.array_split(np.argsort(s), BINS):
        mean = r[bin_] @ across[bin_]
        found += np.outer(mean, mean) / (m * len(bin_))
    return found
