"""Boxes that hold points: sides of any length, each axis bounded or periodic."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._support.arrays import Array
from .._support.checks import extent, point_array, refuse_outside

#: Values of `periodic=`: one for all axes, or one for each.
Periodic: TypeAlias = bool | Sequence[bool] | NDArray[np.bool_]

#: The longest side over the shortest, at most: below it products of two sides keep their digits.
MOST_SLENDER = 1e100
#: Up to this exponent a power of two and its inverse are normal numbers
_EXACT_SCALES = 1000


class Bounds:
    """A box in the coordinates of its points, and the same box as the compiled core takes it.

    The core wants coordinates of the order of 1. It gets (x − offset) / 2^exponent, with an offset that is 0 or, for
    boxes far from the origin, the box's lower end, so that no digit of any point is lost.

    Parameters
    ----------
    d : int
        Dimension.
    bounds : array_like, (d, 2) or (2,), optional
        Lower and upper end of each axis, or one pair for all; by default 0 and 1.
    periodic : bool or sequence of bool, (d,)
        Whether the two ends of an axis are the same place; one answer for all axes, or one for each.
    """

    def __init__(self, d: int, bounds: ArrayLike | None = None, periodic: Periodic = False):
        self.sides = _sides(d, bounds)
        self.periodic = _periodic(d, periodic)
        low, high = self.sides.T
        with np.errstate(over="ignore", under="ignore"):
            length = high - low
            self.volume = float(np.prod(length))
        if not (np.isfinite(length).all() and np.finfo(float).tiny <= self.volume < math.inf):
            raise ValueError(f"bounds {self.sides.tolist()}: the volume is not a normal number; change the unit")
        if length.max() / MOST_SLENDER > length.min():
            raise ValueError(
                f"bounds {self.sides.tolist()}: the longest side must be at most {MOST_SLENDER:g} times the shortest"
            )
        with np.errstate(over="ignore"):
            far = ((low > 0) & (high <= 2 * low)) | ((high < 0) & (low >= 2 * high))  # where x − low is exact
        self._offset = np.where(far, low, 0.0)
        self._exponent = math.frexp(length.max())[1] - 1
        self._core_sides = np.ascontiguousarray(self._scaled(self.sides.T).T)

    @property
    def d(self) -> int:
        """Dimension."""
        return len(self.sides)

    @property
    def in_core(self) -> tuple[Array, NDArray[np.bool_]]:
        """The sides (d, 2) as the core takes them, and for each axis whether it is periodic (d,)."""
        return self._core_sides, self.periodic

    @property
    def region(self) -> tuple[Array, NDArray[np.bool_], Array]:
        """The sides and periodic axes of `in_core`, and no walls (0, d + 1)."""
        return *self.in_core, np.empty((0, self.d + 1))

    def length_in_core(self, length: float) -> float:
        """A length in the unit of the core's coordinates."""
        return math.ldexp(length, -self._exponent)

    def to_core(self, points: ArrayLike, name: str = "points") -> Array:
        """Points (n, d) or (sets, n, d) as the core takes them: in the box, on periodic axes below its upper end.

        The array itself where nothing has to change, else a new one, in float64. Points that lie outside by no more
        than the rounding of their own type are put on the face, or across the seam; others raise ValueError.
        """
        array = point_array(points, name=name)
        self._refuse_outside(array, type_of(points), name)
        array = self._scaled(self._drawn_in(array))
        low, high = self._core_sides.T
        below_high = self._greatest_in_core()
        least, most = extent(array)
        if (least >= low).all() and (most <= below_high).all():
            return array
        array = np.where(self.periodic & (array >= high), array - (high - low), array)
        array = np.where(self.periodic & (array < low), array + (high - low), array)
        return np.clip(array, low, below_high)

    def copied_to_core(self, points: ArrayLike, threads: int) -> Array:
        """The same as an array of its own: what is checked here is what the core gets, whatever the caller does."""
        array = point_array(points)
        copy = self._copied_inside(array, threads)
        if copy is not None:
            return copy
        inside = self.to_core(points)
        return inside.copy() if np.may_share_memory(inside, array) else inside

    def to_unit(self, points: ArrayLike, name: str = "points") -> Array:
        """Points (n, d) or (sets, n, d) as those of [0, 1)^d, each axis scaled by itself; refused as in `to_core`."""
        low, high = self._core_sides.T
        return np.clip((self.to_core(points, name) - low) / (high - low), 0.0, np.nextafter(1.0, 0.0))

    def from_core(self, points: Array, *, in_place: bool = False) -> Array:
        """Points (..., d) of the core in the box's own coordinates; a new array unless they may be changed in place."""
        target = points if in_place else None
        scaled = np.ldexp(points, self._exponent, out=target) if self._exponent else points
        # Adding 0 makes 0 of −0; one number is added in less time than an array
        offset = self._offset if self._offset.any() else 0.0
        return np.add(scaled, offset, out=target if scaled is points else scaled)

    def measures_from_core(self, measures: Array, d: int | None = None) -> Array:
        """Lengths, areas or volumes that the core gave, in the box's own unit; those of `d` dimensions if given."""
        power = self.d if d is None else d
        return np.ldexp(measures, self._exponent * power) if self._exponent else measures

    def depth(self, places: Array) -> Array:
        """Distance (...,) of places (..., d) from the border; negative outside, infinite on a torus."""
        low, high = self.sides.T
        return np.where(self.periodic, np.inf, np.minimum(places - low, high - places)).min(axis=-1)

    def _copied_inside(self, points: Array, threads: int) -> Array | None:
        """Points as the core takes them, copied, scaled and checked in one pass; None if one is outside or on a seam.

        In passes of their own these would take a fifth of the time that two threads need for the cells.
        """
        if abs(self._exponent) > _EXACT_SCALES:
            return None
        in_core = np.column_stack([self._core_sides[:, 0], self._greatest_in_core()])
        batch = np.require(points if points.ndim == 3 else points[None], requirements="A")
        scale = math.ldexp(1.0, -self._exponent)
        copy = _core.copy_inside(batch, self.sides, self._offset, scale, in_core, threads)
        return copy if copy is None or points.ndim == 3 else copy[0]

    def _greatest_in_core(self) -> Array:
        """The greatest coordinate (d,) of a point in the core: on periodic axes below the upper end."""
        low, high = self._core_sides.T
        return np.where(self.periodic, np.nextafter(high, low), high)

    def _scaled(self, points: Array) -> Array:
        if self._offset.any():
            points = points - self._offset
        return np.ldexp(points, -self._exponent) if self._exponent else points

    def _drawn_in(self, points: Array) -> Array:
        """The same points; those that rounding has put outside a wall on that wall."""
        return points

    def _refuse_outside(self, points: Array, dtype: np.dtype[Any], name: str) -> None:
        # A bounded axis ends at a number of the points' type; computing x mod period rounds as well
        with np.errstate(over="ignore", under="ignore"):  # beyond the range of the type all its numbers are inside
            rounding = np.abs(self.sides.astype(dtype).astype(np.float64) - self.sides).max(axis=1)
        slack = np.where(self.periodic, np.finfo(dtype).eps * np.abs(self.sides).max(axis=1), rounding)
        low, high = self.sides.T
        refuse_outside(name, points, low, high, self._remedy(), slack=slack)

    def _remedy(self) -> str:
        if self.periodic.any():
            return "give the box as bounds=[(low, high), ...], or wrap what is periodic: low + (x - low) % (high - low)"
        return "give the box as bounds=[(low, high), ...] or drop the point"


def _sides(d: int, bounds: ArrayLike | None) -> Array:
    if bounds is None:
        return np.tile([0.0, 1.0], (d, 1))
    try:
        sides = np.array(bounds, dtype=np.float64)
    except (TypeError, ValueError):
        sides = np.empty(0)
    if sides.shape == (2,):
        sides = np.tile(sides, (d, 1))
    if sides.ndim != 2 or sides.shape[1] != 2:
        raise ValueError(f"bounds must be pairs (low, high), one for each axis or one for all, got {bounds!r}")
    if len(sides) != d:
        raise ValueError(
            f"bounds has {len(sides)} pairs (low, high), the points (n, d) have d = {d}; "
            "pass points.T if they are given as (d, n)"
        )
    wrong = ~(np.isfinite(sides).all(axis=1) & (sides[:, 0] < sides[:, 1]))
    if wrong.any():
        axis = int(np.argmax(wrong))
        raise ValueError(f"bounds[{axis}] = {tuple(sides[axis].tolist())} must be two finite numbers low < high")
    return sides


def _periodic(d: int, periodic: Periodic) -> NDArray[np.bool_]:
    axes = np.asarray(periodic)
    if axes.dtype != np.bool_ or axes.shape not in ((), (d,)):
        raise ValueError(f"periodic must be True, False or one of them for each of d = {d} axes, got {periodic!r}")
    return np.array(np.broadcast_to(axes, (d,)))


def type_of(points: Any) -> np.dtype[Any]:
    """The floating-point type that points came in: that of their rounding."""
    dtype = points.dtype if hasattr(points, "dtype") else np.asarray(points).dtype
    floating = isinstance(dtype, np.dtype) and dtype.kind == "f" and dtype.itemsize < 8
    return dtype if floating else np.dtype(np.float64)
