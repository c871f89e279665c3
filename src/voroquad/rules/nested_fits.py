"""Polynomials of several sizes by least squares, from sums over samples that come block by block.

The terms are products of Legendre polynomials, orthonormal in the mean over the unit box. Each family has an order of
the terms, in which the candidates are the first so many: by total degree, and by hyperbolic crosses, the products
Π (a_i + 1) of the degrees a_i. One Cholesky factor of a family's matrix serves all of its candidates.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.linalg.blas import dsyrk

from .._support.arrays import Array, Indices
from .._support.blas import one_blas_thread
from .polynomials import legendre, powers_up_to

#: What is added to the matrix of the normal equations, over its diagonal: fits of nearly as many terms as samples.
RIDGE = 1e-10

#: Samples whose terms are in memory at a time.
SAMPLES_AT_ONCE = 4096


@dataclass(frozen=True)
class NestedTerms:
    """Candidates: the first `sizes` of the terms in `order`, ascending; 1, the constant, is one of them."""

    order: Indices
    sizes: tuple[int, ...]


class Terms:
    """The terms of the families in d dimensions with at most so many terms each."""

    def __init__(self, d: int, most: int):
        by_degree, by_cross = _by_total_degree(d, most), _by_hyperbolic_cross(d, most)
        powers = {term: i for i, term in enumerate(dict.fromkeys((*by_degree[0], *by_cross[0])))}
        self.families = tuple(
            NestedTerms(np.array([powers[term] for term in terms], dtype=np.intp), sizes)
            for terms, sizes in (by_degree, by_cross)
        )
        self.powers = np.array(list(powers), dtype=np.intp)
        # A term is one with its last factor left out, times that factor
        last = [max((a for a in range(d) if term[a]), default=0) for term in powers]
        self._axis = last
        self._parent = [powers[(*term[:a], 0, *term[a + 1 :])] for term, a in zip(powers, last, strict=True)]

    def __len__(self) -> int:
        return len(self.powers)

    def at(self, points: Array) -> Array:
        """The terms (terms, n) at points (n, d) of the unit box."""
        degree = int(self.powers.max(initial=0))
        factors = [np.ascontiguousarray(legendre(2 * x - 1, degree).T) for x in points.T]
        out = np.ones((len(self), len(points)))
        for i, (axis, parent) in enumerate(zip(self._axis, self._parent, strict=True)):
            if power := self.powers[i, axis]:
                np.multiply(out[parent], factors[axis][power], out=out[i])
        return out


Nested = tuple[list[tuple[int, ...]], tuple[int, ...]]


def _by_total_degree(d: int, most: int) -> Nested:
    degree = 0
    while math.comb(degree + 1 + d, d) <= most:
        degree += 1
    terms = [tuple(int(a) for a in term) for term in powers_up_to(degree, d)]
    return terms, tuple(math.comb(p + d, d) for p in range(degree + 1))


def _by_hyperbolic_cross(d: int, most: int) -> Nested:
    terms: list[tuple[int, ...]] = []
    sizes: list[int] = []
    product = 1
    while True:
        for term in _with_product(product, d):
            terms.append(term)
            if len(terms) > most:
                return terms[: sizes[-1]], tuple(sizes)
        sizes.append(len(terms))
        product += 1


def _with_product(product: int, d: int) -> Iterator[tuple[int, ...]]:
    """All degrees (d,) with Π (a_i + 1) = product."""
    if d == 1:
        yield (product - 1,)
        return
    for factor in range(1, product + 1):
        if product % factor == 0:
            yield from ((factor - 1, *rest) for rest in _with_product(product // factor, d - 1))


@lru_cache(maxsize=16)
def terms_of(d: int, most: int) -> Terms:
    """The terms, once for all calls."""
    return Terms(d, most)


@dataclass(frozen=True)
class NormalEquations:
    """Σ φ φᵀ (terms, terms), its upper half, and Σ φ f (terms, fields) over n samples."""

    gram: Array
    product: Array
    n: int

    @classmethod
    @one_blas_thread
    def of(cls, terms: Terms, points: Array, values: Array) -> NormalEquations:
        """Those of values (fields, n) at points (n, d)."""
        gram = np.zeros((len(terms), len(terms)), order="F")
        product = np.zeros((len(terms), len(values)))
        for i in range(0, len(points), SAMPLES_AT_ONCE):
            phi = terms.at(points[i : i + SAMPLES_AT_ONCE])
            gram = dsyrk(1.0, phi.T, beta=1.0, c=gram, trans=1, overwrite_c=1)
            product += phi @ values[:, i : i + SAMPLES_AT_ONCE].T
        return cls(gram, product, len(points))

    def __add__(self, other: NormalEquations) -> NormalEquations:
        return NormalEquations(self.gram + other.gram, self.product + other.product, self.n + other.n)

    def __sub__(self, other: NormalEquations) -> NormalEquations:
        return NormalEquations(self.gram - other.gram, self.product - other.product, self.n - other.n)


@one_blas_thread
def fits(moments: NormalEquations, terms: Terms) -> Array:
    """Coefficients (candidates, terms, fields) of least squares, family by family."""
    found = []
    for family in terms.families:
        order = family.order
        gram = np.triu(moments.gram) + np.triu(moments.gram, 1).T
        gram = gram[np.ix_(order, order)] + RIDGE * moments.n * np.eye(len(order))
        factor = cholesky(gram, lower=True, overwrite_a=True, check_finite=False)
        half = solve_triangular(factor, moments.product[order], lower=True, check_finite=False)
        for size in family.sizes:
            c = np.zeros_like(moments.product)
            c[order[:size]] = solve_triangular(
                factor[:size, :size], half[:size], lower=True, trans=1, check_finite=False
            )
            found.append(c)
    return np.stack(found)


@one_blas_thread
def predicted(terms: Terms, coefficients: Array, points: Array) -> Array:
    """The polynomials (..., fields, n) with coefficients (..., terms, fields) at points (n, d)."""
    parts = [
        np.swapaxes(coefficients, -1, -2) @ terms.at(points[i : i + SAMPLES_AT_ONCE])
        for i in range(0, len(points), SAMPLES_AT_ONCE)
    ]
    return np.concatenate(parts, axis=-1)
