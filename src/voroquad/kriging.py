"""Kriging: the samples predict a random function, all of them or all but a group.

The integrand is modelled as a polynomial of degree p, the drift, plus a Gaussian process with the covariance
k(x, y) = Π_a M(|x_a − y_a|) and white noise of variance τ². The best linear prediction from the samples is
linear in the values, knows the positions only, and its integral over boxes is exact. The model decides how
good a prediction is, never whether the estimate is unbiased (docs/theory.md, (21) to (24)).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, solve_triangular
from scipy.linalg.lapack import dpotrf, dpotri

from . import _core

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

#: Correlation length of the random function: this part of the box, or as many sample spacings if that is less.
LENGTH, SPACINGS = 0.5, 8.0

#: Highest degree of the drift, and the fewest samples per term of it.
DRIFT, SAMPLES_PER_TERM = 8, 12


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
    """

    degree: int
    length: float
    noise: float


def model(n: int, d: int, spacing: float | None = None) -> Model:
    """The model for n samples in d dimensions, `spacing` apart; by default n^(−1/d), which fills the unit box.

    The variance of the noise, (spacing / length)⁷, is what the samples are too far apart to resolve.
    """
    spacing = spacing or n ** (-1 / d)
    length = min(LENGTH, SPACINGS * spacing)
    degree = next(p for p in range(DRIFT, -1, -1) if p == 0 or SAMPLES_PER_TERM * math.comb(p + d, d) <= n)
    return Model(degree, length, (spacing / length) ** 7)


@dataclass(frozen=True)
class Intervals:
    """Uniform distributions on intervals [low_i, high_i] of an axis (m,); those of a part are added up."""

    low: Array
    high: Array
    part: Indices
    parts: int


@dataclass(frozen=True)
class Measures:
    """The integrals of each k(·, x_j) and of each term of the drift with respect to several measures."""

    covariances: Array  # (measures, n)
    drift: Array  # (measures, terms)


class Kriging:
    """The prediction from values f at the samples: k(y, X) B f, plus the drift with the coefficients C f.

    Parameters
    ----------
    points : ndarray, (n, d)
        The samples.
    assumed : Model
        What is assumed; the degree of the drift is lowered if the samples do not determine it.
    box : tuple of ndarray, (d,)
        Lower and upper corner of a box around the samples, to which the drift's polynomials are scaled.
    threads : int
        Number of threads that fill the covariance matrix.

    Notes
    -----
    With the covariance K and the drift's values A (n, terms) at the samples, and Rᵀ R = Aᵀ K⁻¹ A:

        half = R^−ᵀ Aᵀ K⁻¹ ,   B = K⁻¹ − halfᵀ half ,   C = R⁻¹ half .
    """

    def __init__(self, points: Array, assumed: Model, box: tuple[Array, Array], threads: int = 1):
        self.points, self.length, self._box = points, assumed.length, box
        covariance = _core.matern_matrix(np.ascontiguousarray(points), assumed.length, threads).T
        covariance[np.diag_indices(len(points))] += assumed.noise
        self._factor, _ = dpotrf(covariance, lower=1, overwrite_a=1, clean=0)
        self._inverse, _ = dpotri(self._factor, lower=1)  # its lower triangle
        for degree in range(assumed.degree, -1, -1):
            self._powers = _powers(points.shape[1], degree)
            terms = self._terms(points)
            solved = cho_solve((self._factor, True), terms, check_finite=False)
            try:
                root = np.linalg.cholesky(terms.T @ solved)
            except np.linalg.LinAlgError:
                continue
            if np.linalg.cond(root) < 1e6:
                break
        self._half: Array = solve_triangular(root, solved.T, lower=True, check_finite=False)
        self._drift: Array = solve_triangular(root, self._half, lower=True, trans="T", check_finite=False)

    def apply(self, right: Array) -> Array:
        """B times the rows of `right` (m, n): the coefficients of the prediction from values (m, n)."""
        solved = np.asarray(cho_solve((self._factor, True), right.T, check_finite=False)).T
        return solved - (right @ self._half.T) @ self._half

    def over_boxes(self, axes: Sequence[Intervals]) -> Measures:
        """Of the measures that are products, over the axes, of one part of each; they come in C order of the parts."""
        covariances, drift = np.ones((1, len(self.points))), np.ones((1, len(self._powers)))
        for a, axis in enumerate(axes):
            share = (np.arange(axis.parts)[:, None] == axis.part).astype(np.float64)
            along = share @ _matern_means(self.points[:, a], axis.low, axis.high, self.length)
            terms = share @ _legendre_means(self._scaled(a, axis.low), self._scaled(a, axis.high), self._degree)
            covariances = (covariances[:, None] * along).reshape(-1, covariances.shape[1])
            drift = (drift[:, None] * terms[:, self._powers[:, a]]).reshape(-1, drift.shape[1])
        return Measures(covariances, drift)

    def at_points(self, points: Array) -> Measures:
        """Of the measure with mass 1 at each of the points (m, d)."""
        sums = _core.matern_sums(self.points, np.ascontiguousarray(points), self.length)
        return Measures(sums[None], self._terms(points).sum(axis=0)[None])

    def integrals(self, measures: Measures) -> Array:
        """What each value counts (measures, n) in the integrals of the prediction."""
        return self.apply(measures.covariances) + measures.drift @ self._drift

    def leave_out(self, group: Indices, right: Array) -> Array:
        """B_cc^−1 applied to the entries of each group c, in each row of `right` (m, n).

        The prediction f̂^(−c) from the samples of the other groups misses the values of c by
        B_cc^−1 (B f)_c: there is no other system to solve. Group numbers are (n,), from 0 on.
        """
        solved = np.empty_like(right)
        for members in _groups_of_equal_size(group):
            half = self._half[:, members].transpose(1, 0, 2)
            blocks = np.tril(self._inverse[members[:, :, None], members[:, None, :]])
            blocks += np.tril(blocks, -1).mT - half.mT @ half
            solution = np.linalg.solve(blocks, right[:, members].transpose(1, 2, 0))
            solved[:, members] = solution.transpose(2, 0, 1)
        return solved

    @property
    def _degree(self) -> int:
        return int(self._powers.max(initial=0))

    def _scaled(self, axis: int, x: Array) -> Array:
        low, high = self._box[0][axis], self._box[1][axis]
        return (2 * x - low - high) / (high - low)

    def _terms(self, points: Array) -> Array:
        """The drift's polynomials at points (m, d): (m, terms)."""
        factors = [_legendre(self._scaled(a, x), self._degree) for a, x in enumerate(points.T)]
        return reduce(np.multiply, (f[:, self._powers[:, a]] for a, f in enumerate(factors)))


def _groups_of_equal_size(group: Indices) -> Iterator[Indices]:
    """The members (groups, size) of all groups of one size, size by size."""
    order = np.argsort(group, kind="stable")
    _, starts, sizes = np.unique(group[order], return_index=True, return_counts=True)
    for size in np.unique(sizes):
        yield order[starts[sizes == size][:, None] + np.arange(size)]


def _matern_means(x: Array, low: Array, high: Array, length: float) -> Array:
    """The means (intervals, n) of M(|· − x_j|) over [low_i, high_i].

    The antiderivative of (1 + s + 2 s²/5 + s³/15) e^−s is 16/5 − (16/5 + 11/5 s + 3/5 s² + s³/15) e^−s.
    """

    def antiderivative(t: Array) -> Array:
        s = math.sqrt(7) / length * np.abs(t)
        tail = (16 / 5 + s * (11 / 5 + s * (3 / 5 + s / 15))) * np.exp(-s)
        return np.copysign(16 / 5 - tail, t) * length / math.sqrt(7)

    return (antiderivative(high[:, None] - x) - antiderivative(low[:, None] - x)) / (high - low)[:, None]


def _legendre(t: Array, degree: int) -> Array:
    """The Legendre polynomials (n, degree + 1), orthonormal in the mean over [−1, 1], by Bonnet's recursion."""
    values = [np.ones_like(t), t]
    for k in range(1, degree):
        values.append(((2 * k + 1) * t * values[k] - k * values[k - 1]) / (k + 1))
    return np.stack([math.sqrt(2 * k + 1) * p for k, p in enumerate(values[: degree + 1])], axis=-1)


def _legendre_means(low: Array, high: Array, degree: int) -> Array:
    """Their means over [low_i, high_i], from the antiderivatives (P_{k+1} − P_{k−1}) / (2k + 1)."""
    scale = np.sqrt(2.0 * np.arange(degree + 2) + 1)
    rise = (_legendre(high, degree + 1) - _legendre(low, degree + 1)) / scale
    means = np.ones((len(low), degree + 1))
    means[:, 1:] = (rise[:, 2:] - rise[:, :-2]) / scale[1:-1] / (high - low)[:, None]
    return means


@lru_cache(maxsize=64)
def _powers(d: int, degree: int) -> Indices:
    """The degrees (terms, d) along each axis of the products of total degree at most `degree`."""
    return np.array([p for p in itertools.product(range(degree + 1), repeat=d) if sum(p) <= degree], dtype=np.intp)
