"""Polynomials of several degrees, each fitted to a whole set by least squares, with groups of samples left out.

With the terms in the order of their total degree, A = Q R, a lower degree has the first columns of Q and the leading
block of the Cholesky factor of 1 − Q_uᵀ Q_u, which leaves out the samples u: one factorisation serves all degrees.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.linalg.lapack import dpotrf, dtrtrs

from .._support.arrays import Array, Indices
from .polynomials import Intervals, at_points, over_boxes, powers_up_to

#: Samples per term of the degrees that are tried.
SAMPLES_PER_TERM = (32, 16, 10, 7, 5, 3.7)


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
    group : ndarray, (n,)
        Their groups, from 0 on.
    axes : sequence of Intervals
        Whose parts make up the distributions of the samples, by group.
    degrees : sequence of int
        Of the fits, ascending.

    Notes
    -----
    With B = 1 − Q Qᵀ the residuals of the fit to all samples are B f, and without the samples u, as for kriging
    (docs/theory.md, (19) and (31)), those at u are

        B_uu⁻¹ (B f)_u = b + Q_u (1 − Q_uᵀ Q_u)⁻¹ Q_uᵀ b ,   b = (B f)_u .
    """

    def __init__(self, points: Array, group: Indices, axes: Sequence[Intervals], degrees: Sequence[int]):
        d = points.shape[1]
        self.names = tuple(f"degree {p}" for p in degrees)
        powers = powers_up_to(degrees[-1], d)
        counts = np.array([math.comb(p + d, d) for p in degrees])
        # Which terms (terms, degrees, 1) each degree has
        self._has = (np.arange(len(powers))[:, None] < counts).astype(np.float64)[..., None]
        self._q, r = np.linalg.qr(at_points(points, powers))
        measures = over_boxes(axes, powers)
        self._over_groups = dtrtrs(r, measures.T, lower=0, trans=1)[0].T  # (groups, terms)
        self._members = [np.flatnonzero(group == c) for c in range(len(measures))]
        self._grams = np.stack([self._q[m].T @ self._q[m] for m in self._members])
        self._values, self._missed = np.empty((0, len(points))), np.empty((len(points), len(degrees), 0))

    def left_out(self, groups: tuple[int, ...], values: Array) -> Array:
        """What predictions without these groups miss of their values (fields, n), (degrees, fields, samples).

        The samples come in the order of the set. Where the others do not determine a polynomial, infinity.
        """
        if values is not self._values:
            self._values, self._missed = values, self._apply(values.T[:, None])
        out = self._samples(groups)
        missed = self._solve(groups, out, self._missed[out])
        return np.moveaxis(missed, 0, -1)

    def weights(self, group: int) -> Array:
        """v + B y with y_c = B_cc⁻¹ (1 − v_c), as those of kriging, (21): (degrees, n)."""
        out = self._members[group]
        v = _product(self._q, self._over_groups[group][:, None, None] * self._has)
        y = np.zeros_like(v)
        y[out] = self._solve((group,), out, 1 - v[out])
        return (v + self._apply(y))[..., 0].T

    def _apply(self, right: Array) -> Array:
        """B times right-hand sides (n, degrees or 1, fields): (n, degrees, fields)."""
        return right - _product(self._q, _product(self._q.T, right) * self._has)

    def _solve(self, groups: tuple[int, ...], out: Indices, b: Array) -> Array:
        """B_uu⁻¹ b for right-hand sides (samples u, degrees, fields)."""
        q = self._q[out]
        left = np.eye(q.shape[1]) - self._grams[list(groups)].sum(axis=0)
        factor, failed = dpotrf(left, lower=1)
        known = len(left)
        if failed:  # the rest of the rows is cut off from those that are known
            known = failed - 1
            factor[known:], factor[np.arange(known, len(left)), np.arange(known, len(left))] = 0, 1
        right = _product(q.T, b) * self._has
        z = _triangular(factor, right, 0) * self._has  # the leading block of L solves a lower degree
        solved = b + _product(q, _triangular(factor, z, 1))
        solved[:, self._has[:, :, 0].sum(axis=0) > known] = np.inf
        return solved

    def _samples(self, groups: tuple[int, ...]) -> Indices:
        return np.sort(np.concatenate([self._members[c] for c in groups]))


def _product(matrix: Array, right: Array) -> Array:
    """The product with right-hand sides (m, degrees, fields)."""
    return (matrix @ right.reshape(len(right), -1)).reshape(-1, *right.shape[1:])


def _triangular(factor: Array, right: Array, transposed: int) -> Array:
    """L⁻¹ or L^−ᵀ times right-hand sides (terms, degrees, fields)."""
    solved, _ = dtrtrs(factor, right.reshape(len(right), -1), lower=1, trans=transposed)
    return np.asarray(solved).reshape(right.shape)
