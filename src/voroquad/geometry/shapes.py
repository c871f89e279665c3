"""Cells as polygons and polyhedra: sequences that make each cell when asked, from flat arrays."""

from __future__ import annotations

import itertools
import operator
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np

from .._support.arrays import Array, Integers


@dataclass(frozen=True, eq=False)
class Polygons(Sequence[Array]):
    """The cells in the plane as arrays (k, 2) of corners. Coinciding points each have the cell that they share.

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

    @overload
    def __getitem__(self, i: int) -> Array: ...
    @overload
    def __getitem__(self, i: slice) -> list[Array]: ...
    def __getitem__(self, i: int | slice) -> Array | list[Array]:
        """Corners (k, 2) of cell i, or a list of them for a slice."""
        if isinstance(i, slice):
            return [self[k] for k in range(*i.indices(len(self)))]
        return self.coordinates[range_of(self.offsets, i)]

    def __iter__(self) -> Iterator[Array]:
        """Corners (k, 2) of one cell after the other."""
        return _pieces(self.coordinates, self.offsets)

    def take(self, cells: Integers) -> Polygons:
        """Some of the cells (m,), in the order given."""
        entries, offsets = _taken(self.offsets, cells)
        return Polygons(self.coordinates[entries], offsets)


@dataclass(frozen=True, eq=False)
class Polyhedra(Sequence[list[Array]]):
    """The cells in space as lists of faces, each an array (k, 3) of corners.

    Coinciding points each have the cell that they share.

    Attributes
    ----------
    coordinates : ndarray, (c, 3)
        Corners of faces, counter-clockwise from outside, face after face.
    face_offsets : ndarray of int, (f + 1,)
        The corners of face k are ``coordinates[face_offsets[k]:face_offsets[k + 1]]``.
    offsets : ndarray of int, (n + 1,)
        The faces of cell i are ``range(offsets[i], offsets[i + 1])``.
    """

    coordinates: Array
    face_offsets: Integers
    offsets: Integers

    def __len__(self) -> int:
        """Number of cells."""
        return len(self.offsets) - 1

    @overload
    def __getitem__(self, i: int) -> list[Array]: ...
    @overload
    def __getitem__(self, i: slice) -> list[list[Array]]: ...
    def __getitem__(self, i: int | slice) -> list[Array] | list[list[Array]]:
        """Faces of cell i, each its corners (k, 3), or a list of them for a slice."""
        if isinstance(i, slice):
            return [self[k] for k in range(*i.indices(len(self)))]
        faces = range_of(self.offsets, i)
        ends = self.face_offsets[faces.start : faces.stop + 1]
        return list(_pieces(self.coordinates, ends))

    def __iter__(self) -> Iterator[list[Array]]:
        """Faces of one cell after the other."""
        faces = _pieces(self.coordinates, self.face_offsets)
        return (list(itertools.islice(faces, count)) for count in np.diff(self.offsets).tolist())

    def take(self, cells: Integers) -> Polyhedra:
        """Some of the cells (m,), in the order given."""
        faces, offsets = _taken(self.offsets, cells)
        corners, face_offsets = _taken(self.face_offsets, faces)
        return Polyhedra(self.coordinates[corners], face_offsets, offsets)


def _pieces(coordinates: Array, offsets: Integers) -> Iterator[Array]:
    """``coordinates[offsets[k]:offsets[k + 1]]`` for all k: views, made without a loop in Python."""
    ends = offsets.tolist()
    return map(coordinates.__getitem__, map(slice, ends, ends[1:]))


def range_of(offsets: Integers, i: int) -> slice:
    """The range of the entries of cell i; negative i count from the end."""
    n = len(offsets) - 1
    if not -n <= operator.index(i) < n:
        raise IndexError(f"cell {i} of {n}")
    i = operator.index(i) % n
    return slice(int(offsets[i]), int(offsets[i + 1]))


def _taken(offsets: Integers, rows: Integers) -> tuple[Integers, Integers]:
    """The entries of some rows, one after another, and where each of these rows then begins."""
    begin, size = offsets[rows], offsets[rows + 1] - offsets[rows]
    ends = np.concatenate([[0], np.cumsum(size)])
    return np.arange(ends[-1]) + np.repeat(begin - ends[:-1], size), ends
