"""Pairs of cells that share a face, in compressed sparse rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._support.arrays import Array, Integers
from .shapes import range_of


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Neighbours of the cells of n points in d dimensions; made by :meth:`Cells.neighbours`.

    The entries of point i are ``slice(indptr[i], indptr[i + 1])``, in ascending order of `indices`, then of `shifts`.
    Each face is listed twice, once for each of its cells, with the same measure and distance.

    Attributes
    ----------
    indptr : ndarray of int, (n + 1,)
        Where the entries of each point begin.
    indices : ndarray of int, (m,)
        Index of the neighbour.
    measures : ndarray, (m,)
        Length (d = 2) or area (d = 3) of the shared face; 1 for d = 1.
    distances : ndarray, (m,)
        Distance between the two points, or between the point and the neighbour's image.
    shifts : ndarray of int, (m, d)
        Number of periods by which the neighbour's image is shifted along each axis; 0 on axes that are not periodic. A
        neighbour with several shared faces has an entry with a different shift for each. A point may be its own
        neighbour.
    border : ndarray, (n,)
        The part of each cell's surface that lies on the border of the domain: a length, an area, or for d = 1 a number
        of ends.
    """

    indptr: Integers
    indices: Integers
    measures: Array
    distances: Array
    shifts: Integers
    border: Array

    def __len__(self) -> int:
        """Number of points."""
        return len(self.border)

    def __getitem__(self, i: int) -> Integers:
        """Indices of the neighbours of point i."""
        return self.indices[range_of(self.indptr, i)]

    @property
    def rows(self) -> Integers:
        """Index (m,) of the point that each entry belongs to."""
        return np.repeat(np.arange(len(self)), np.diff(self.indptr))

    @property
    def surfaces(self) -> Array:
        """Perimeter or surface area (n,) of each cell; number of ends for d = 1."""
        return np.bincount(self.rows, self.measures, len(self)) + self.border
