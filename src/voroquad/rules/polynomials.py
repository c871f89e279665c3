"""Products of Legendre polynomials at points and over boxes, ordered by total degree."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from .. import _core
from .._support.arrays import Array, Indices


@dataclass(frozen=True, eq=False)
class Intervals:
    """Uniform distributions on intervals [low_i, high_i] of an axis (m,); those of a part are added up.

    They compare by identity, so that what depends on them alone can be remembered.
    """

    low: Array
    high: Array
    part: Indices
    parts: int

    @cached_property
    def share(self) -> Array:
        """1 where an interval belongs to a part (parts, m), else 0."""
        return (np.arange(self.parts)[:, None] == self.part).astype(np.float64)


@lru_cache(maxsize=64)
def powers_up_to(degree: int, d: int) -> Indices:
    """The degrees (terms, d) along each axis of the products of total degree at most `degree`, in ascending order."""
    of_degree = (itertools.combinations_with_replacement(range(d), p) for p in range(degree + 1))
    return np.array([[axes.count(a) for a in range(d)] for axes in itertools.chain.from_iterable(of_degree)], np.intp)


def at_points(points: Array, powers: Indices) -> Array:
    """The products (..., terms) at points (..., d) of the unit box."""
    rows = np.ascontiguousarray(points).reshape(-1, points.shape[-1])
    return _core.legendre_products(rows, powers).reshape(*points.shape[:-1], len(powers))


def over_boxes(axes: Sequence[Intervals], powers: Indices) -> Array:
    """Their integrals (measures, terms) over all products of one part of each axis, in C order of the parts."""
    # In the order in memory of what is remembered, on which the bits of products depend
    return _over_boxes(tuple(axes), int(powers.max(initial=0))).copy(order="K")


@lru_cache(maxsize=16)
def _over_boxes(axes: tuple[Intervals, ...], degree: int) -> Array:
    powers = powers_up_to(degree, len(axes))
    integrals = np.ones((1, len(powers)))
    for a, axis in enumerate(axes):
        along = axis.share @ legendre_means(2 * axis.low - 1, 2 * axis.high - 1, degree)
        integrals = (integrals[:, None] * along[:, powers[:, a]]).reshape(-1, len(powers))
    return integrals


def legendre(t: Array, degree: int) -> Array:
    """The Legendre polynomials (..., degree + 1), orthonormal in the mean over [−1, 1], by Bonnet's recursion."""
    values = [np.ones_like(t), t]
    for k in range(1, degree):
        values.append(((2 * k + 1) * t * values[k] - k * values[k - 1]) / (k + 1))
    found = np.empty((*t.shape, degree + 1))
    for k, p in enumerate(values[: degree + 1]):
        np.multiply(math.sqrt(2.0 * k + 1), p, out=found[..., k])
    return found


def legendre_means(low: Array, high: Array, degree: int) -> Array:
    """Their means over [low_i, high_i], from the antiderivatives (P_{k+1} − P_{k−1}) / (2k + 1)."""
    scale = np.sqrt(2.0 * np.arange(degree + 2) + 1)
    rise = (legendre(high, degree + 1) - legendre(low, degree + 1)) / scale
    means = np.ones((len(low), degree + 1))
    means[:, 1:] = (rise[:, 2:] - rise[:, :-2]) / scale[1:-1] / (high - low)[:, None]
    return means
