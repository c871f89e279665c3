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

from .. import _core
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
    u has the coefficients of docs/theory.md, (31) (include/voroquad/detail/fits/global_fits.hpp).
    """

    def __init__(self, points: Array, groups: Groups, axes: Sequence[Intervals], degrees: Sequence[int]):
        d = points.shape[1]
        self.names = tuple(f"degree {p}" for p in degrees)
        counts = [math.comb(p + d, d) for p in degrees]
        powers = powers_up_to(degrees[-1], d)
        terms, integrals = at_points(points, powers), over_boxes(axes, powers)
        self._fits = _core.GlobalFits(groups.in_core, terms, integrals, counts)
        if not self._fits.independent:
            self._fits = _core.GlobalFits(groups.in_core, *_orthonormal(terms, integrals), counts)

    def squares(self, pairs: Indices, values: Array) -> Array:
        """As :class:`voroquad.rules.model_choice.Candidates` has it.

        Where the other samples do not determine a polynomial, infinity.
        """
        return self._fits.squares(pairs, np.ascontiguousarray(values))

    def residuals(self, which: int, groups: Indices, values: Array) -> Array:
        """As :class:`voroquad.rules.model_choice.Candidates` has it."""
        return self._fits.residuals(which, groups, np.ascontiguousarray(values))

    def weights(self, which: int, groups: Indices) -> Array:
        """As :class:`voroquad.rules.model_choice.Candidates` has it."""
        return self._fits.weights(which, groups)


def _orthonormal(terms: Array, measures: Array) -> tuple[Array, Array]:
    """Terms (n, terms) in a basis that is orthonormal over the samples, lower degrees first; their integrals.

    With the factor R of QR, for terms whose products are singular to rounding.
    """
    root = np.linalg.qr(terms, mode="r")
    basis = dtrsm(1.0, root, np.concatenate([terms, measures]).T, side=0, lower=0, trans_a=1).T
    return np.ascontiguousarray(basis[: len(terms)]), np.ascontiguousarray(basis[len(terms) :])
