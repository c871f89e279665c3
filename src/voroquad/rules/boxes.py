"""Reconstructions by a polynomial in each of many equal boxes, fitted to the samples nearest to the box's centre."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from .. import _core
from .._support.arrays import Array, Indices

#: Samples of a fit per polynomial term.
SAMPLES_PER_TERM = 2.4

#: Radius of a fit whose samples all lie at its centre.
_TINY = 1e-300


def samples_of_a_fit(degree: int, d: int) -> float:
    """Samples that a fit of a total degree should have.

    Examples
    --------
    >>> from voroquad.rules.boxes import samples_of_a_fit
    >>> samples_of_a_fit(2, 3)
    24.0
    """
    return math.comb(degree + d, d) * SAMPLES_PER_TERM


@dataclass(frozen=True)
class Boxes:
    """The unit box, cut into `per_axis` equal parts along each of d axes; boxes are numbered in C order."""

    per_axis: int
    d: int

    @classmethod
    def about(cls, n: int, d: int) -> Boxes:
        """At most n boxes, and about so many."""
        return cls(max(1, math.floor(n ** (1 / d) + 1e-9)), d)

    @cached_property
    def centres(self) -> Array:
        """Centres (boxes, d)."""
        return (np.indices((self.per_axis,) * self.d).reshape(self.d, -1).T + 0.5) / self.per_axis

    @property
    def half_width(self) -> Array:
        """Half the width of a box along each axis (d,)."""
        return np.full(self.d, 0.5 / self.per_axis)

    def numbers(self, points: Array) -> Indices:
        """The numbers (m,) of the boxes that hold points (m, d)."""
        cell = np.minimum((points * self.per_axis).astype(np.intp), self.per_axis - 1)
        return np.ravel_multi_index(tuple(cell.T), (self.per_axis,) * self.d)

    def nearest(self, samples: Array, k: int) -> tuple[Array, Indices]:
        """Distances and numbers (boxes, k) of the k samples nearest to each centre, the nearest first.

        Where there are fewer than k samples, the distances of the missing ones are infinite.
        """
        distance, neighbours = cKDTree(samples).query(self.centres, k=np.arange(1, k + 1))
        return np.asarray(distance), np.asarray(neighbours)


@dataclass(frozen=True)
class BoxFits:
    """Polynomials of a degree, each fitted to some of the samples around the centre of a box.

    Attributes
    ----------
    samples : ndarray, (n, d)
        All samples.
    centres : ndarray, (m, d)
        Centres of the boxes, of which several may be the same.
    half_width : ndarray, (d,)
        Half the width of each box.
    radius : ndarray, (m,)
        Where the weights of each fit end.
    neighbours : ndarray, (m, k)
        Numbers of the samples that each is fitted to.
    degree : int
        Total degree.
    threads : int
        Number of threads; results do not depend on it.
    """

    samples: Array
    centres: Array
    half_width: Array
    radius: Array
    neighbours: Indices
    degree: int
    threads: int

    def controls(self, points: Array, box: Indices) -> Array:
        """Weights (n,) of the samples' values in the mean of the fits over all boxes less their mean at points.

        `box` (m,) numbers the fit that is evaluated at each of the points (m, d). Without points only the mean over the
        boxes is left.
        """
        by_box = np.argsort(box, kind="stable")
        starts = np.searchsorted(box[by_box], np.arange(len(self.centres) + 1))
        return _core.cross_fit_controls(
            self.samples,
            self.centres,
            self.half_width,
            np.maximum(self.radius, _TINY),
            np.ascontiguousarray(self.neighbours, dtype=np.int64),
            self.degree,
            np.ascontiguousarray(points[by_box]),
            starts.astype(np.int64),
            self.threads,
        )

    @cached_property
    def mean(self) -> Array:
        """Weights (n,) of the samples' values in the mean of the fits over all boxes."""
        return self.controls(np.empty((0, self.samples.shape[1])), np.empty(0, dtype=np.intp))

    def sum_at(self, points: Array, box: Indices) -> Array:
        """Weights (n,) of the samples' values in the sum of the fits over points (m, d), of the fit `box` at each."""
        if len(points) == 0:
            return np.zeros(len(self.samples))
        return len(points) * (self.mean - self.controls(points, box))
