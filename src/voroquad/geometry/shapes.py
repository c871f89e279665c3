"""Cells as polygons and polyhedra: sequences that make each cell when asked, from flat arrays."""

from __future__ import annotations

import itertools
import operator
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, NoReturn, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike

from .._support.arrays import Array, Integers

Cell = TypeVar("Cell", Array, list[Array])


@dataclass(frozen=True, eq=False)
class _Shapes(Sequence[Cell]):
    """What polygons and polyhedra have in common: fields are arrays that nobody can write to."""

    def __post_init__(self) -> None:
        for field in fields(self):
            array = getattr(self, field.name).view()
            array.flags.writeable = False
            object.__setattr__(self, field.name, array)

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles are made anew, since arrays do not keep that they are read-only."""
        return type(self), tuple(getattr(self, field.name) for field in fields(self))

    def __contains__(self, value: object) -> NoReturn:
        self._refuse_to_compare()

    def index(self, value: Any, start: int = 0, stop: int | None = None) -> NoReturn:
        """Raise TypeError: cells are not compared."""
        self._refuse_to_compare()

    def count(self, value: Any) -> NoReturn:
        """Raise TypeError: cells are not compared."""
        self._refuse_to_compare()

    def _refuse_to_compare(self) -> NoReturn:
        raise TypeError(
            f"{type(self).__name__} cannot look for a cell, as cells are arrays; compare their arrays by np.array_equal"
        )


@dataclass(frozen=True, eq=False)
class Polygons(_Shapes[Array]):
    """The cells in the plane as arrays (k, 2) of corners. Coinciding points each have the cell that they share.

    All arrays are read-only. Cells are views of `coordinates`: ``cells[i].copy()`` may be changed. A sequence is equal
    to itself only, as ``==`` does not compare cells; ``in``, ``index`` and ``count`` raise TypeError.

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

    def take(self, cells: ArrayLike) -> Polygons:
        """Some of the cells (m,), in the order given; negative numbers count from the end.

        Raises
        ------
        IndexError
            There is no cell of that number.
        TypeError
            `cells` is not a list or array (m,) of whole numbers.
        """
        entries, offsets = _taken(self.offsets, _rows(cells, len(self)))
        return Polygons(self.coordinates[entries], offsets)


@dataclass(frozen=True, eq=False)
class Polyhedra(_Shapes[list[Array]]):
    """The cells in space as lists of faces, each an array (k, 3) of corners.

    Coinciding points each have the cell that they share. All arrays are read-only, and faces are views of
    `coordinates`. A sequence is equal to itself only, as ``==`` does not compare cells; ``in``, ``index`` and ``count``
    raise TypeError.

    Attributes
    ----------
    coordinates : ndarray, (c, 3)
        Corners of faces, counter-clockwise from outside, face after face.
    face_offsets : ndarray of int, (f + 1,)
        The corners of face k are ``coordinates[face_offsets[k]:face_offsets[k + 1]]``.
    offsets : ndarray of int, (n + 1,)
        The faces of cell i are ``range(offsets[i], offsets[i + 1])``, and the corners of all of them are
        ``coordinates[face_offsets[offsets[i]]:face_offsets[offsets[i + 1]]]``.
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

    def take(self, cells: ArrayLike) -> Polyhedra:
        """Some of the cells (m,), in the order given; negative numbers count from the end.

        Raises
        ------
        IndexError
            There is no cell of that number.
        TypeError
            `cells` is not a list or array (m,) of whole numbers.
        """
        faces, offsets = _taken(self.offsets, _rows(cells, len(self)))
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


def _rows(cells: ArrayLike, n: int) -> Integers:
    """Numbers (m,) of cells as those from 0 to n − 1."""
    rows = np.asarray(cells)
    if rows.ndim != 1 or (rows.size and rows.dtype.kind not in "iu"):
        raise TypeError(f"cells must be whole numbers (m,), got {rows.dtype} {rows.shape}; of a mask np.flatnonzero")
    wrong = (rows < -n) | (rows >= n)
    if wrong.any():
        raise IndexError(f"cell {rows[wrong][0]} of {n}")
    return rows.astype(np.int64) % max(n, 1)


def _taken(offsets: Integers, rows: Integers) -> tuple[Integers, Integers]:
    """The entries of some rows, one after another, and where each of these rows then begins."""
    begin, size = offsets[rows], offsets[rows + 1] - offsets[rows]
    ends = np.concatenate([[0], np.cumsum(size)])
    return np.arange(ends[-1]) + np.repeat(begin - ends[:-1], size), ends
