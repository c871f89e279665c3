"""Kriging: the samples predict a random function, all of them or all but a group.

The integrand is modelled as a polynomial of degree p, the drift, plus a Gaussian process with the covariance
k(x, y) = Π_a M(|x_a − y_a|) and white noise of variance τ². The best linear prediction from the samples is
linear in the values, knows the positions only, and its integral over boxes is exact. The model decides how
good a prediction is, never whether the estimate is unbiased (docs/theory.md, (18) to (21)).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotri, dpotrs

from .._support.arrays import Array, Indices
from . import polynomials
from .covariances import GAUSSIAN, MATERN_7, MATERN_9, Covariance
from .polynomials import Intervals

#: Correlation length: in sample spacings, but at most this part of the box.
SPACINGS, PART = 5.0, 0.5

#: Noise by dimension, in units of what the samples are too far apart to resolve. It keeps weights tame, above all near
#: the border: Σ|w| ≤ 1.1 in every multi-jittered set of a hundred samples or more. Stratified sets leave wider gaps; of
#: those in the plane a few of 20 000 exceed that, most on grids twice as long as wide (benchmarks/weight_bounds.py).
#: Noise costs smooth integrands some of their digits; edges and kinks gain from it.
NOISE = {1: 12, 2: 12}
NOISE_ELSEWHERE = 3

#: Highest degree of the drift, and the fewest samples per term of it.
DRIFT, SAMPLES_PER_TERM = 9, 12

#: Largest condition number of the factor L at which a degree is kept. That of random or stratified samples is at
#: most 650. Clusters have far larger ones, with which weights would be wild and their sum 1 to a few digits only.
LARGEST_CONDITION = 2e3

#: Rows of a matrix that are mirrored at a time.
_SIDE = 64


@dataclass(frozen=True)
class Model:
    """What is assumed of the integrand. The variance of the process is 1.

    Parameters
    ----------
    degree : int
        Of the drift: polynomials up to it are predicted exactly.
    length : float
        Correlation length of the process along each axis.
    noise : float
        Variance τ² of the noise.
    covariance : Covariance
        Of the process.
    """

    degree: int
    length: float
    noise: float
    covariance: Covariance = MATERN_7


#: What is assumed of smooth functions: length, degree of the drift, and noise for a process with four derivatives. An
#: analytic one gets so many times n as makes up for the rounding of its covariances.
SMOOTH_LENGTH, SMOOTH_DRIFT, SMOOTH_NOISE, ANALYTIC_NOISE = 0.5, 2, 1e-10, 1e-14


@lru_cache(maxsize=64)
def model(n: int, d: int, per_term: int = SAMPLES_PER_TERM) -> Model:
    """The model for n samples in d dimensions, with at least so many samples per term of the drift.

    With n^(−1/d) between samples, a variance of (n^(−1/d) / length)⁷ is what they are too far apart to resolve; that of
    the noise is :data:`NOISE` times as much.
    """
    spacing = n ** (-1 / d)
    length = min(PART, SPACINGS * spacing)
    degree = next(p for p in range(DRIFT, -1, -1) if p == 0 or per_term * math.comb(p + d, d) <= n)
    return Model(degree, length, NOISE.get(d, NOISE_ELSEWHERE) * (spacing / length) ** 7)


def smooth_models(n: int) -> dict[str, Model]:
    """Models for n samples of smooth functions, by name: with little noise and, for many derivatives, more at stake."""
    return {
        "smooth kriging": Model(SMOOTH_DRIFT, SMOOTH_LENGTH, SMOOTH_NOISE, MATERN_9),
        "analytic kriging": Model(SMOOTH_DRIFT, SMOOTH_LENGTH, ANALYTIC_NOISE * n, GAUSSIAN),
    }


@dataclass(frozen=True)
class Measures:
    """The integrals of each k(·, x_j) and of each term of the drift with respect to several measures."""

    covariances: Array  # (measures, n)
    drift: Array  # (measures, terms)

    def take_away(self, which: int, others: Measures) -> None:
        """Subtract the sum of others from one of these."""
        self.covariances[which] -= others.covariances.sum(axis=0)
        self.drift[which] -= others.drift.sum(axis=0)


class Kriging:
    """The prediction from values f at the samples: k(y, X) B f, plus the drift with the coefficients C f.

    Parameters
    ----------
    points : ndarray, (n, d) or (sets, n, d)
        The samples; of several sets, each predicts from its own. All results then have one axis more, the first.
    assumed : Model
        What is assumed. The degree of the drift is lowered for all sets if the samples of one of them do not determine
        it, as where most of them coincide; `lowered` tells. A dozen samples per term, drawn by any design, do.
    threads : int
        Number of threads that fill matrices of covariances.

    Notes
    -----
    With the covariance K and the drift's values A (n, terms) at the samples, and L Lᵀ = Aᵀ K⁻¹ A:

        half = L⁻¹ Aᵀ K⁻¹ ,   C = L^−ᵀ half ,   B = K⁻¹ − halfᵀ half = K⁻¹ (1 − A C) .
    """

    def __init__(self, points: Array, assumed: Model, threads: int = 1):
        self.points, self._assumed, self._threads = points, assumed, threads
        n, d = points.shape[-2:]
        inverse = np.empty((points.size // (n * d), n, n))
        self._factors = [_factor(x, assumed, threads) for x in points.reshape(-1, n, d)]
        for one, factor in zip(inverse, self._factors, strict=True):
            _invert(factor, one)
        self._inverse = inverse.reshape(*points.shape[:-1], n)
        for degree in range(assumed.degree, -1, -1):
            self._powers = polynomials.powers_up_to(degree, d)
            self._at_samples = polynomials.at_points(points, self._powers)
            solved = self._solve(np.broadcast_to(self._at_samples, (*points.shape[:-1], len(self._powers))).mT)
            try:
                root = np.linalg.cholesky(solved @ self._at_samples)
            except np.linalg.LinAlgError:
                continue
            if np.linalg.cond(root).max() < LARGEST_CONDITION:
                break
        self.lowered = self._degree < assumed.degree
        root = np.linalg.inv(root)
        self._half: Array = root @ solved
        self._drift: Array = root.mT @ self._half

    def apply(self, right: Array) -> Array:
        """B times the rows of `right` (m, n): the coefficients of the prediction from values (m, n)."""
        solved = self._solve(right)
        return solved - (solved @ self._at_samples) @ self._drift

    def _solve(self, right: Array) -> Array:
        """K⁻¹ times the rows of `right` (m, n).

        By the factors of K: a product with K⁻¹ would have errors of the size of ε K⁻¹, and with little noise that is
        larger than what is predicted.
        """
        n = self.points.shape[-2]
        rows = np.broadcast_to(right, (*self.points.shape[:-2], *right.shape[-2:])).reshape(len(self._factors), -1, n)
        solved = [dpotrs(factor, one.T, lower=1)[0].T for factor, one in zip(self._factors, rows, strict=True)]
        return np.stack(solved).reshape(*self.points.shape[:-2], -1, n)

    def over_boxes(self, axes: Sequence[Intervals]) -> Measures:
        """Of the measures that are products, over the axes, of one part of each; they come in C order of the parts."""
        *sets, n, _ = self.points.shape
        assumed = self._assumed
        covariances = np.ones((*sets, 1, n))
        for a, axis in enumerate(axes):
            along = axis.share @ assumed.covariance.means(
                self.points[..., None, :, a], axis.low, axis.high, assumed.length
            )
            covariances = (covariances[..., :, None, :] * along[..., None, :, :]).reshape(*sets, -1, n)
        return Measures(covariances, polynomials.over_boxes(axes, self._powers))

    def at_points(self, points: Array) -> Measures:
        """Of the measures with mass 1 at one of the points (m, d); of one set only."""
        covariances = self._assumed.covariance.between(
            np.ascontiguousarray(points), self.points, self._assumed.length, self._threads
        )
        return Measures(covariances, polynomials.at_points(points, self._powers))

    def integrals(self, measures: Measures) -> Array:
        """What each value counts (measures, n) in the integrals of the prediction."""
        return self.apply(measures.covariances) + measures.drift @ self._drift

    def integrate(self, measures: Measures, values: Array) -> Array:
        """The integrals (fields, measures) of the predictions from values (fields, n)."""
        return self.apply(values) @ measures.covariances.mT + values @ self._drift.mT @ measures.drift.mT

    def leave_out(self, group: Indices, right: Array) -> Array:
        """B_cc^−1 applied to the entries of each group c, in each row of `right` (m, n).

        The prediction f̂^(−c) from the samples of the other groups misses the values of c by
        B_cc^−1 (B f)_c: there is no other system to solve. Group numbers are (n,), from 0 on.
        """
        solved = np.empty_like(right)
        for members in _groups_of_equal_size(group):
            solution = np.linalg.solve(self.blocks(members), np.moveaxis(right[..., members], -3, -1))
            solved[..., members] = np.moveaxis(solution, -1, -3)
        return solved

    def blocks(self, members: Indices) -> Array:
        """The blocks B_cc (..., groups, size, size) of groups c with these members (groups, size)."""
        half = np.moveaxis(self._half[..., members], -3, -2)
        inverse: Array = self._inverse[..., members[:, :, None], members[:, None, :]]
        return inverse - half.mT @ half

    @property
    def _degree(self) -> int:
        return int(self._powers.max(initial=0))


def _factor(points: Array, assumed: Model, threads: int) -> Array:
    """The Cholesky factor of K of one set (n, d), below the diagonal of (n, n).

    Where K is singular to rounding, as with little noise and samples that coincide, with as much noise as it takes.
    """
    covariance = assumed.covariance.matrix(np.ascontiguousarray(points), assumed.length, threads).T
    covariance[np.diag_indices(len(points))] += assumed.noise
    factor, failed = dpotrf(covariance, lower=1, overwrite_a=1)
    return _factor(points, replace(assumed, noise=10 * assumed.noise), threads) if failed else np.asarray(factor)


def _invert(factor: Array, inverse: Array) -> None:
    """Write K⁻¹ into `inverse` (n, n), from the Cholesky factor of K."""
    lower, _ = dpotri(factor, lower=1)
    n = len(factor)
    for first in range(0, n, _SIDE):  # in parts, as a whole transpose would miss the cache
        rows = slice(first, first + _SIDE)
        inverse[rows, :first] = lower[rows, :first]
        inverse[:first, rows] = lower[rows, :first].T
        block = lower[rows, rows]  # 0 above the diagonal
        inverse[rows, rows] = block + block.T
        inverse.flat[first * (n + 1) : rows.stop * (n + 1) : n + 1] = block.diagonal()


def _groups_of_equal_size(group: Indices) -> Iterator[Indices]:
    """The members (groups, size) of all groups of one size, size by size."""
    order = np.argsort(group, kind="stable")
    _, starts, sizes = np.unique(group[order], return_index=True, return_counts=True)
    for size in np.unique(sizes):
        yield order[starts[sizes == size][:, None] + np.arange(size)]
