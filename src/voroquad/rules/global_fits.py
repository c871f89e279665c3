"""Polynomials of several degrees, each fitted to a whole set by least squares, with groups of samples left out.

With the terms in the order of their total degree, a lower degree has the first columns of a basis and the leading block
of a Cholesky factor: one factorisation without some samples serves all degrees.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from scipy.linalg.blas import dtrsm
from scipy.linalg.lapack import dpotrf, dtrtrs

from .._support.arrays import Array, Indices
from .groups import Groups
from .polynomials import Intervals, at_points, over_boxes, powers_up_to

#: Samples per term of the degrees that are tried.
SAMPLES_PER_TERM = (32, 16, 10, 7, 5, 3.7)


@lru_cache(maxsize=64)
def degrees(n: int, d: int) -> tuple[int, ...]:
    """The degrees to try with n samples in d dimensions: those with at least so many samples per term.

    Examples
    --------
    >>> from voroquad.rules.global_fits import degrees
    >>> degrees(1024, 2), degrees(512, 3), degrees(8, 2)
    ((6, 9, 12, 15, 18, 22), (2, 3, 4, 5, 6, 7), ())
    """
    tried = set()
    for share in SAMPLES_PER_TERM:
        degree = 0
        while math.comb(degree + 1 + d, d) * share <= n:
            degree += 1
        tried.add(degree)
    return tuple(sorted(tried - {0}))


class GlobalFits:
    """Fits of one set, without the samples of some groups.

    Parameters
    ----------
    points : ndarray, (n, d)
        The samples.
    groups : Groups
        Of the samples.
    axes : sequence of Intervals
        Whose parts make up the distributions of the samples, by group.
    degrees : sequence of int
        Of the fits, ascending.

    Notes
    -----
    In a basis Q (n, terms) of the polynomials that is nearly orthonormal over all samples, the fit without the samples
    u has the coefficients

        β = S⁻¹ (Qᵀ f − Q_uᵀ f_u) ,   S = Qᵀ Q − Q_uᵀ Q_u ,

    where QᵀQ is the sum of the Q_cᵀ Q_c of the groups, which are computed once (docs/theory.md, (31)).
    """

    def __init__(self, points: Array, groups: Groups, axes: Sequence[Intervals], degrees: Sequence[int]):
        d = points.shape[1]
        self.names = tuple(f"degree {p}" for p in degrees)
        powers = powers_up_to(degrees[-1], d)
        self._counts = np.array([math.comb(p + d, d) for p in degrees])
        # Which terms (terms, degrees, 1) each degree has
        self._has = (np.arange(len(powers))[:, None] < self._counts).astype(np.float64)[..., None]
        self._basis, self._over_groups = _orthonormal(at_points(points, powers), over_boxes(axes, powers))
        self._groups, self._by_group = groups, groups.pick(self._basis)
        self._grams = self._by_group.mT @ self._by_group
        self._whole = self._grams.sum(axis=0)
        self._alone: dict[tuple[int, int], Array] = {}

    def squares(self, pairs: Indices, values: Array) -> Array:
        """As :class:`voroquad.rules.model_choice.Candidates` has it.

        Where the other samples do not determine a polynomial, infinity.
        """
        by_group = self._groups.pick(values.T)
        sums = self._by_group.mT @ by_group
        right = sums.sum(axis=0) - sums[pairs].sum(axis=1)
        lefts = (self._whole - self._grams[pairs[:, 0]]) - self._grams[pairs[:, 1]]
        shape = (len(self._counts), len(values))
        squares = np.empty((*pairs.shape, *shape))
        for one, pair in enumerate(pairs):
            factor, known = _factor(lefts[one])
            fits = _solve(factor, right[one], self._has)
            for side, c in enumerate(pair):
                missed = by_group[c][:, None] - (self._by_group[c] @ fits).reshape(-1, *shape)
                np.add.reduce(np.square(missed, out=missed), axis=0, out=squares[one, side])
            if known < self._counts[-1]:
                squares[one][:, self._counts > known] = np.inf
        return np.moveaxis(squares, (2, 3), (0, 1))

    def residuals(self, which: int, groups: Indices, values: Array) -> Array:
        """As :class:`voroquad.rules.model_choice.Candidates` has it."""
        terms, residuals = self._counts[which], np.zeros_like(values)
        basis = self._basis[:, :terms]
        total = basis.T @ values.T
        for c in groups:
            out = self._groups.members[c][self._groups.real[c] > 0]
            right = total - basis[out].T @ values[:, out].T
            residuals[:, out] = values[:, out] - (basis[out] @ self._fit_alone(c, terms, right)).T
        return residuals

    def weights(self, which: int, groups: Indices) -> Array:
        """As :class:`voroquad.rules.model_choice.Candidates` has it: 1 for a group, Q S⁻¹ (∫Q − Σ Q_c) elsewhere."""
        terms = self._counts[which]
        right = self._over_groups[groups, :terms] - self._by_group[groups, :, :terms].sum(axis=1)
        solved = np.array([self._fit_alone(c, terms, r[:, None])[:, 0] for c, r in zip(groups, right, strict=True)])
        weights = solved @ self._basis[:, :terms].T
        real = self._groups.real[groups] > 0
        weights[np.nonzero(real)[0], self._groups.members[groups][real]] = 1
        return weights

    def _fit_alone(self, group: int, terms: int, right: Array) -> Array:
        """S⁻¹ times right-hand sides (terms, fields), without one group."""
        if (group, terms) not in self._alone:
            self._alone[group, terms] = _factor(self._whole[:terms, :terms] - self._grams[group, :terms, :terms])[0]
        return _solve(self._alone[group, terms], right)


def _factor(left: Array) -> tuple[Array, int]:
    """The Cholesky factor of S, which is overwritten, and how many of the terms it determines."""
    factor, failed = dpotrf(left.T, lower=1, overwrite_a=1)
    if not failed:
        return factor, len(left)
    known = failed - 1  # the other rows are not used
    factor[known:], factor[np.arange(known, len(left)), np.arange(known, len(left))] = 0, 1
    return factor, known


def _solve(factor: Array, right: Array, has: Array | None = None) -> Array:
    """S⁻¹ times right-hand sides (terms, fields), for each degree that has some terms: (terms, degrees · fields)."""
    solved: Array
    z, _ = dtrtrs(factor, right, lower=1)
    if has is not None:
        z = (z[:, None] * has).reshape(len(z), -1)  # the leading block of the factor solves a lower degree
    solved, _ = dtrtrs(factor, z, lower=1, trans=1)
    return solved


def _orthonormal(terms: Array, measures: Array) -> tuple[Array, Array]:
    """Terms (n, terms) in a basis that is nearly orthonormal over the samples, lower degrees first; their integrals.

    With the Cholesky factor of the terms' products, or the factor R of QR where these are singular to rounding.
    """
    root, failed = dpotrf((terms.T @ terms).T, lower=0, overwrite_a=1)
    if failed:
        root = np.linalg.qr(terms, mode="r")
    both = np.concatenate([terms, measures])
    basis = dtrsm(1.0, root, both.T, side=0, lower=0, trans_a=1).T
    return basis[: len(terms)], basis[len(terms) :]
