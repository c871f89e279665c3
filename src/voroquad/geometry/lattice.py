"""Triclinic lattices: their reduced vectors, and the images of points around one of their cells."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._support.arrays import Array, Integers
from .._support.checks import point_array, real_numbers
from .._support.products import rows_times
from .bounds import type_of

#: The longest reduced vector over the smallest distance of opposite faces, at most: beyond, images are too many
MOST_SLENDER = 1e3
#: The largest coordinate of a vector is at most this, and at least its inverse, so that volumes stay in range
LARGEST = 1e90
#: How many periods from the origin a place may lie, times the epsilon of its type: about three digits are left there
FARTHEST = 2.0**-10


@dataclass(frozen=True, eq=False)
class Images:
    """Points of a lattice and their images up to some distance around its cell, by index of the point.

    Attributes
    ----------
    places : ndarray, (N, d)
        Points and images.
    point : ndarray of int, (N,)
        Index of the point that each is an image of, ascending.
    shift : ndarray of int, (N, d)
        How many reduced vectors it lies away.
    home : ndarray of int, (n,)
        Which of them are the points themselves.
    """

    places: Array
    point: Integers
    shift: Integers
    home: Integers


class Lattice:
    """All sums of whole multiples of d vectors.

    Parameters
    ----------
    vectors : array_like, (d, d), d = 2 or 3
        One vector in each row, in the coordinates of the points.

    Attributes
    ----------
    vectors : ndarray, (d, d)
        As given.
    reduced : ndarray, (d, d)
        Minkowski-reduced vectors of the same lattice: the shortest, the shortest of those that complete it, … They and
        all places are multiples of about 2⁻⁴⁹ of the longest, so that sums are exact and all images of two points have
        the same difference.
    steps : ndarray of int, (d, d)
        ``reduced = steps @ vectors``.
    """

    def __init__(self, vectors: ArrayLike):
        given = real_numbers("cell", vectors)
        if given.shape not in ((1, 1), (2, 2), (3, 3)):
            raise ValueError(
                f"cell has shape {given.shape}; give d = 1, 2 or 3 lattice vectors, one in each row (d, d)"
            )
        largest = np.abs(given).max(axis=1)
        if np.isfinite(largest).all() and largest.all() and not (np.abs(np.log(largest)) <= np.log(LARGEST)).all():
            raise ValueError(
                f"cell {given.tolist()}: the largest coordinate of each vector must be between {1 / LARGEST:g} and "
                f"{LARGEST:g}; change the unit"
            )
        length = np.linalg.norm(given, axis=1)
        if not (np.isfinite(given).all() and length.all() and abs(np.linalg.det(given / length[:, None])) > 1e-12):
            raise ValueError(f"cell {given.tolist()}: the rows must be finite vectors, not all in one line or plane")
        self.vectors = given
        self.steps = _reducing_steps(given)
        reduced = self.steps @ given
        self._grain = math.ldexp(1.0, math.frexp(float(np.linalg.norm(reduced, axis=1).max()))[1] - 49)
        self.reduced = self._snapped(reduced)
        self.volume = float(abs(np.linalg.det(self.reduced)))
        self._inverse: Array = np.asarray(np.linalg.inv(self.reduced), dtype=np.float64)
        # The distance of opposite faces
        self._heights = 1 / np.linalg.norm(self._inverse, axis=0)
        if np.linalg.norm(self.reduced, axis=1).max() > MOST_SLENDER * self._heights.min():
            raise ValueError(
                f"cell {given.tolist()}: the longest reduced vector must be at most {MOST_SLENDER:g} times the least "
                "distance of opposite faces; for boxes take bounds= and periodic=True"
            )

    @property
    def d(self) -> int:
        """Dimension."""
        return len(self.vectors)

    @property
    def covering_radius(self) -> float:
        """A bound on the distance of any place from the lattice: half the diagonal of the orthogonalised cell.

        L. Babai, On Lovász' lattice reduction and the nearest lattice point problem, Combinatorica 6 (1986).
        """
        return float(0.5 * np.linalg.norm(np.diag(np.linalg.qr(self.reduced.T)[1])))

    def read(self, name: str, places: ArrayLike) -> Array:
        """Places (n, d) or (sets, n, d); ValueError for those not finite or too far away to have digits in a period."""
        given = point_array(places, name=name)
        with np.errstate(over="ignore", invalid="ignore"):
            periods = np.abs(rows_times(given, self._inverse)).max(axis=-1)
        most = FARTHEST / float(np.finfo(type_of(places)).eps)
        wrong = np.argwhere(~(periods <= most))
        if not len(wrong):
            return given
        first = tuple(wrong[0].tolist())
        it = f"{name}[{first[0] if len(first) == 1 else first}]"
        if not np.isfinite(given[first]).all():
            raise ValueError(f"{it} is not finite; drop it")
        raise ValueError(
            f"{it} = {given[first].tolist()} is more than {most:.3g} periods of the lattice from the origin, where "
            "rounding leaves less than three digits; give an image nearer to the origin"
        )

    def wrapped(self, places: Array) -> Array:
        """The images (m, d) of places (m, d) in the cell of the reduced vectors at the origin."""
        snapped = self._snapped(places)
        return snapped - rows_times(np.floor(rows_times(snapped, self._inverse)), self.reduced)

    def _snapped(self, places: Array) -> Array:
        return np.asarray(np.round(places / self._grain) * self._grain)

    def images(self, points: Array, distance: float) -> Images:
        """Points (n, d) of the cell, and all their images that are nearer to it than some distance."""
        periods = rows_times(points, self._inverse)
        margin = distance / self._heights
        far = np.ceil(margin).astype(np.int64)
        kept, shifts = [], []
        for shift in itertools.product(*(range(-k, k + 1) for k in far.tolist())):
            at = periods + shift
            near = np.flatnonzero(((at >= -margin) & (at <= 1 + margin)).all(axis=1) | (not any(shift)))
            kept.append(near)
            shifts.append(np.tile(np.array(shift, dtype=np.int64), (len(near), 1)))
        point, shift_of = np.concatenate(kept), np.concatenate(shifts)
        order = np.argsort(point, kind="stable")
        point, shift_of = point[order], shift_of[order]
        places = points[point] + rows_times(shift_of, self.reduced)
        return Images(places, point, shift_of, np.flatnonzero(~shift_of.any(axis=1)))


def _reducing_steps(vectors: Array) -> Integers:
    """The unimodular matrix that makes Minkowski-reduced vectors of given ones.

    In up to three dimensions vectors are reduced if none gets shorter by adding or subtracting others once: P. Q.
    Nguyen and D. Stehlé, Low-dimensional lattice basis reduction revisited, ACM Trans. Algorithms 5 (2009).
    """
    d = len(vectors)
    steps = np.eye(d, dtype=np.int64)
    while True:
        reduced = steps @ vectors
        length2 = (reduced**2).sum(axis=1)
        best = 1 - 1e-12
        change: tuple[int, Integers] | None = None
        for i in range(d):
            others = [k for k in range(d) if k != i]
            near = -np.round(reduced @ reduced[i] / length2).astype(np.int64)  # of each other vector alone
            pairs = [[near[k] * (k == other) for k in others] for other in others]
            for counts in [*itertools.product((-1, 0, 1), repeat=d - 1), *pairs]:
                row = np.zeros(d, dtype=np.int64)
                row[others] = counts
                shorter = ((reduced[i] + row @ reduced) ** 2).sum() / length2[i]
                if shorter < best:
                    best, change = shorter, (i, row)
        if change is None:
            return steps[np.argsort(length2, kind="stable")]
        steps[change[0]] += change[1] @ steps
