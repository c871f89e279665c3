"""Polynomials of rising total degree by least squares, for as long as they promise to pay.

The terms are products of Legendre polynomials, orthonormal in the mean over the unit box
(include/voroquad/detail/fits/legendre_terms.hpp). No matrix is made: conjugate gradients start from the polynomial of
the degree before. So the memory is that of the samples, and the time that of a few passes over them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np

from .. import _core
from .._support.arrays import Array, Indices

#: Samples per term of a fit.
SAMPLES_PER_TERM = 8

#: The gradient at which conjugate gradients end, in the mean square, over that of noise; and the most steps.
TOLERANCE, MOST_STEPS = 0.3, 30

#: Mean squared residuals over those of 0 that are no more than rounding.
ROUNDING_SQUARE = 1e-26

#: Part of the terms of the highest degree: with fewer, residuals do not tell what the highest degree will leave.
TELLING = 1 / 8

#: Degrees below the highest that are candidates too, beside the plain mean.
DEGREES_BELOW = 2

#: Components that are fitted in one pass over the points.
FIELDS_AT_ONCE = 8

#: So many samples or a few more: their points (d, n) and values (fields, n).
Samples = Callable[[int], tuple[Array, Array]]


@lru_cache(maxsize=64)
def terms_of(d: int, degree: int) -> _core.LegendreTerms:
    """The terms, once for all calls."""
    return _core.LegendreTerms(d, degree)


def highest_degree(d: int, most: float) -> int:
    """The highest total degree with at most so many terms.

    Examples
    --------
    >>> from voroquad.rules.nested_fits import highest_degree
    >>> highest_degree(4, 500), highest_degree(8, 500)
    (8, 4)
    """
    degree = 0
    while math.comb(degree + 1 + d, d) <= most:
        degree += 1
    return degree


def embedded(coefficients: Array, d: int, degree: int, to: int) -> Array:
    """Coefficients (fields, terms) of a degree as those of a higher one."""
    out = np.zeros((len(coefficients), len(terms_of(d, to))))
    out[:, _positions(d, degree, to)] = coefficients
    return out


def truncated(coefficients: Array, d: int, degree: int, to: int) -> Array:
    """Those coefficients (fields, terms) of a degree that a lower one has."""
    return coefficients[:, _positions(d, to, degree)]


@lru_cache(maxsize=256)
def _positions(d: int, degree: int, to: int) -> Indices:
    """Where the terms of a degree are among those of a higher one."""
    small, large = terms_of(d, degree), terms_of(d, to)
    first, runs = (x.astype(np.intp) for x in (small.starts(), small.runs()))
    shift = large.starts()[: len(first)].astype(np.intp) - first
    found: Indices = np.repeat(shift, runs) + np.arange(len(small))
    return found


@dataclass(frozen=True)
class NestedFits:
    """Of each component: the highest degree fitted, 0 where no degree promised to pay, and coefficients by degree.

    ``coefficients`` maps a degree to an array (fields, terms); rows of components that were given up before are 0.
    """

    degrees: Indices
    coefficients: dict[int, Array]

    @classmethod
    def of(cls, samples: Samples, d: int, fields: int, highest: int, worth: Array) -> NestedFits:
        """Of rising degree, up to the highest.

        A component is given up where the mean squared residual that its last degrees lead to expect at the highest is
        above ``worth`` (fields,).
        """
        parts = []
        for i in range(0, fields, FIELDS_AT_ONCE):
            rows = slice(i, i + FIELDS_AT_ONCE)
            parts.append(_fitted(partial(_rows, samples, rows), d, highest, worth[rows]))
        degrees = np.concatenate([p.degrees for p in parts])
        coefficients = {}
        for degree in sorted({degree for p in parts for degree in p.coefficients}):
            missing = np.zeros((FIELDS_AT_ONCE, len(terms_of(d, degree))))
            coefficients[degree] = np.concatenate(
                [p.coefficients.get(degree, missing[: len(p.degrees)]) for p in parts]
            )
        return cls(degrees, coefficients)


def _rows(samples: Samples, rows: slice, n: int) -> tuple[Array, Array]:
    points, values = samples(n)
    return points, values[rows]


def _fitted(samples: Samples, d: int, highest: int, worth: Array) -> NestedFits:
    fields = len(worth)
    rising = np.arange(fields)
    degrees = np.zeros(fields, dtype=np.intp)
    coefficients: dict[int, Array] = {}
    squares: list[Array] = []  # mean squared residuals (fields,) by degree, as of samples that are not fitted
    for degree in range(1, highest + 1):
        terms = terms_of(d, degree)
        points, values = samples(SAMPLES_PER_TERM * len(terms))
        values = np.ascontiguousarray(values[rising])
        if degree == 1:
            squares.append(values.var(axis=1))
            start = values.mean(axis=1, keepdims=True)
        c = embedded(start, d, degree - 1, degree)
        n = points.shape[1]
        square = np.full(fields, np.inf)
        square[rising] = terms.fit(points, values, c, TOLERANCE, MOST_STEPS) * (n / (n - len(terms)))
        squares.append(square)
        coefficients[degree] = np.zeros((fields, len(terms)))
        coefficients[degree][rising] = c
        exact = square[rising] <= ROUNDING_SQUARE * np.square(values).mean(axis=1)
        telling = len(terms) >= TELLING * math.comb(highest + d, d)
        pays = (_expected(squares, highest) <= worth)[rising] | (not telling)
        degrees[rising[exact & pays]] = degree
        if degree == highest:
            degrees[rising[pays]] = degree
        rising, start = rising[pays & ~exact], c[pays & ~exact]
        if not len(rising):
            break
    return NestedFits(degrees, coefficients)


def _expected(squares: list[Array], highest: int) -> Array:
    """What the last degrees lead to expect of the mean squared residuals at the highest.

    Functions that are even or odd along an axis gain at every second degree only.
    """
    degree = len(squares) - 1
    now, before = squares[-1], squares[max(degree - 2, 0)]
    ratio = np.divide(now, before, out=np.ones_like(now), where=(before > 0) & np.isfinite(before))
    expected: Array = now * np.minimum(ratio, 1) ** ((highest - degree) / 2)
    return expected
