"""A drawn sample set whose points can be moved, added and removed by hand."""

from __future__ import annotations

import numpy as np

from .._support.arrays import Array, Indices
from ..designs.sampling import SampleSet, as_sample_set

_BELOW_ONE = np.nextafter(1.0, 0.0)
#: The `origin` of an added point.
ADDED = -1


class EditedSet:
    """A drawn set with all edits since.

    Parameters
    ----------
    drawn : SampleSet
        One set (n, d).

    Attributes
    ----------
    points : ndarray, (m, d)
        The points now; those added come last.
    origin : ndarray, (m,)
        The point's row in the drawn set, or ``ADDED``.
    """

    def __init__(self, drawn: SampleSet):
        self.drawn = drawn
        self.points: Array = drawn.points.copy()
        self.origin: Indices = np.arange(drawn.n)

    def __len__(self) -> int:
        return len(self.points)

    @property
    def edited(self) -> bool:
        """Whether anything was edited."""
        return bool(len(self) != self.drawn.n or (self.points != self.drawn.points).any())

    def nearest(self, place: Array, within: float) -> int | None:
        """The point nearest to a place (d,), if it is within that distance."""
        squares = ((self.points - place) ** 2).sum(axis=-1)
        nearest = int(np.argmin(squares))
        return nearest if squares[nearest] <= within**2 else None

    def move(self, index: int, place: Array) -> None:
        """Move a point; places (d,) beyond the box are moved to its border."""
        self.points[index] = np.clip(place, 0.0, _BELOW_ONE)

    def add(self, place: Array) -> int:
        """Add a point; its index."""
        self.points = np.append(self.points, np.clip(place, 0.0, _BELOW_ONE)[None], axis=0)
        self.origin = np.append(self.origin, ADDED)
        return len(self) - 1

    def remove(self, index: int) -> None:
        """Remove a point. The last one cannot be removed."""
        if len(self) == 1:
            raise ValueError("a sample set needs a point: add one before you remove the last")
        self.points = np.delete(self.points, index, axis=0)
        self.origin = np.delete(self.origin, index)

    def samples(self, design: str | None) -> SampleSet:
        """The points as a set that claims a design, or (None) claims nothing.

        Raises
        ------
        ValueError
            The points are no longer such a set, for example because a stratum lost its point.
        """
        if not self.edited:
            return self.drawn
        return as_sample_set(self.points, design)
