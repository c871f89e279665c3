"""Cells as polygons and polyhedra in flat arrays."""

from __future__ import annotations

import itertools
import operator
from dataclasses import dataclass

from .._support.arrays import Array, Integers


@dataclass(frozen=True, eq=False)
class Polygons:
    """Cells in the plane; those of points that coincide are listed for each of them.

    Attributes
    ----------
    coordinates : ndarray, (v, 2)
        Corners, counter-clockwise, cell after cell. The first corner of a cell is not repeated as its last.
    offsets : ndarray of int, (n + 1,)
        The corners of cell i are ``coordinates[offsets[i]:offsets[i + 1]]``.
    """

    coordinates: Array
    offsets: Integers

    def __len__(self) -> int:
        """Number of cells."""
        return len(self.offsets) - 1

    def __getitem__(self, i: int) -> Array:
        """Corners (k, 2) of cell i."""
        return self.coordinates[range_of(self.offsets, i)]


@dataclass(frozen=True, eq=False)
class Polyhedra:
    """Cells in space; those of points that coincide are listed for each of them.

    Attributes
    ----------
    coordinates : ndarray, (c, 3)
        Corners of faces, counter-clockwise from outside, face after face.
    face_offsets : ndarray of int, (f + 1,)
        The corners of face k are ``coordinates[face_offsets[k]:face_offsets[k + 1]]``.
    offsets : ndarray of int, (n + 1,)
        The faces of cell i are those from ``offsets[i]`` to before ``offsets[i + 1]``.
    """

    coordinates: Array
    face_offsets: Integers
    offsets: Integers

    def __len__(self) -> int:
        """Number of cells."""
        return len(self.offsets) - 1

    def __getitem__(self, i: int) -> list[Array]:
        """Faces of cell i, each its corners (k, 3)."""
        faces = range_of(self.offsets, i)
        ends = self.face_offsets[faces.start : faces.stop + 1]
        return [self.coordinates[first:last] for first, last in itertools.pairwise(ends.tolist())]


def range_of(offsets: Integers, i: int) -> slice:
    """Where the entries of cell i stand; negative i count from the end."""
    n = len(offsets) - 1
    if not -n <= operator.index(i) < n:
        raise IndexError(f"cell {i} of {n}")
    i = operator.index(i) % n
    return slice(int(offsets[i]), int(offsets[i + 1]))
