"""Trajectories in k-space: their units, and the domain that they fill."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._support.arrays import Array, Indices
from .._support.checks import one_of, positive_int, real_numbers

ROUNDING = 1e-6  # how far a position of a trajectory in float32 may miss the face it is on
DISC = 1.2  # largest |k| over the largest coordinate: 1 where a trajectory fills a disc, √2 where it fills a square
FEWEST_IN_PLANE = 16  # samples in a plane of a stack, on average
FILLED = 0.8  # radius of the outermost planes of a stack over the largest
GAP = 0.1  # of the axis of a cylinder: what may be left out at its ends, beside three times the distance of planes

#: Units of positions: how many make a cycle per voxel, given the shape of the image.
UNITS: dict[str, Callable[[tuple[int, ...]], ArrayLike]] = {
    "cycles/voxel": lambda shape: 1.0,
    "radians/voxel": lambda shape: 2 * math.pi,
    "cycles/fov": lambda shape: shape,
}


@dataclass(frozen=True)
class Trajectory:
    """Positions (n, d) in cycles per voxel; `per_unit` (d,) of the unit they were given in make one."""

    positions: Array
    per_unit: Array
    units: str

    @property
    def d(self) -> int:
        """Number of axes."""
        return int(self.positions.shape[1])

    def on_axes(self, axes: Indices) -> Trajectory:
        """The coordinates on some of the axes."""
        return Trajectory(self.positions[:, axes], self.per_unit[axes], self.units)

    def in_plane(self) -> Trajectory:
        """The two coordinates of a plane across an axis of space; itself if the samples lie in none."""
        return self.on_axes(spanned_axes(self.positions))

    def refuse_outside(self, sides: Array, remedy: str) -> None:
        """Raise ValueError unless all positions lie in a box (d, 2), in cycles per voxel, but for their rounding."""
        low, high = sides.T
        outside = ~((self.positions >= low - ROUNDING) & (self.positions <= high + ROUNDING)).all(axis=1)
        if outside.any():
            first = int(np.argmax(outside))
            ends = [f"[{a:.6g}, {b:.6g}]" for a, b in sides * self.per_unit[:, None]]
            box = f"{ends[0]}^{self.d}" if len(set(ends)) == 1 else " × ".join(ends)
            position = ", ".join(f"{x:.6g}" for x in self.positions[first] * self.per_unit)
            raise ValueError(
                f"sample {first} of the trajectory is [{position}], not inside {box} {self.units}; {remedy}"
            )


def read_trajectory(trajectory: ArrayLike, shape: tuple[int, ...] | None, units: str) -> Trajectory:
    """The positions of a trajectory (shots, samples, d) or (n, d); ValueError for what is none."""
    one_of("units", units, UNITS)
    array = real_numbers("trajectory", trajectory)
    if array.ndim not in (2, 3) or array.shape[-1] not in (2, 3) or array.size == 0:
        raise ValueError(f"trajectory must have shape (shots, samples, d) or (n, d) with d = 2 or 3, got {array.shape}")
    given = array.reshape(-1, array.shape[-1])
    d = given.shape[1]
    if shape is not None and np.ndim(shape) != 1:
        raise ValueError(f"shape must have a number for each axis, such as (64,) * {d}, got {shape!r}")
    sizes = () if shape is None else tuple(positive_int("shape", n) for n in shape)
    if len(sizes) == 2 and len(spanned_axes(given)) == 2 < d:  # a plane in space, and the image of a plane
        sizes = tuple(np.insert(sizes, int(np.argmin(np.ptp(given, axis=0))), 1).tolist())
    if shape is not None and len(sizes) != d:
        raise ValueError(f"shape {tuple(shape)} must have as many axes as the trajectory has: {d}")
    if units == "cycles/fov" and shape is None:
        raise ValueError(
            "units='cycles/fov' needs the shape of the image: density_compensation(trajectory, shape, ...)"
        )
    per_unit = np.array(np.broadcast_to(np.asarray(UNITS[units](sizes), dtype=np.float64), (d,)))
    # Positions that differ by less than the rounding of 0.5 count as one: those of spokes that cross at the centre
    return Trajectory(given / per_unit + 0.5 - 0.5, per_unit, units)


def spanned_axes(positions: Array) -> Indices:
    """All axes; or, if all samples have the same value of one of three coordinates, the other two axes."""
    axes = np.flatnonzero(~(np.ptp(positions, axis=0) <= ROUNDING))  # of NaN too, which is refused
    return axes if len(axes) == 2 else np.arange(positions.shape[1])


def rim_of(positions: Array) -> str:
    """The domain that a trajectory fills, in cycles per voxel: "ball", "cylinder" or "box"."""
    size = np.abs(positions).max(axis=0)
    if not size.any():
        return "box"
    d = positions.shape[1]
    round_ = radius_of(positions) <= DISC * size.max()
    if d == 2:
        return "ball" if round_ else "box"
    _refuse_flat(positions)
    axis = cylinder_axis(positions)
    if round_:
        return "cylinder" if _is_stack_of_discs(positions, axis) else "ball"
    plane = np.delete(positions, axis, axis=1)
    return "cylinder" if radius_of(plane) <= DISC * np.abs(plane).max() else "box"


def radius_of(positions: Array) -> float:
    """The largest distance from the origin."""
    largest = float(np.abs(positions).max())
    return largest * float(np.linalg.norm(positions / (largest or 1.0), axis=1).max())  # no square underflows


def cylinder_axis(positions: Array) -> int:
    """The axis about which samples in space fill a cylinder best; if several do, the last of them."""
    corner = _reach_into_corners(positions)
    return int(np.flatnonzero(corner <= corner.min() + 0.05)[-1])


def refuse_uncovered(positions: Array, axis: int) -> None:
    """Raise ValueError where a cylinder's axis is covered in part only, so that its outermost cells would be huge."""
    heights = np.unique(np.round(positions[:, axis] / ROUNDING)) * ROUNDING
    left_out = 1.0 - (heights[-1] - heights[0])
    if left_out > GAP + 3 * np.diff(heights).max(initial=0.0):
        raise ValueError(
            f"the trajectory covers [{heights[0]:.3g}, {heights[-1]:.3g}] of axis {axis} only, not [-0.5, 0.5] "
            "cycles/voxel; give the ends of k-space as bounds=[(low, high), ...], or another rim="
        )


def _reach_into_corners(positions: Array) -> Array:
    """For each axis (3,) how far samples reach into corners of the other two: 1 if they fill an ellipse, 2 a square."""
    size = np.abs(positions).max(axis=0)
    squares = (positions / np.where(size > 0, size, 1.0)) ** 2
    return np.array([np.delete(squares, axis, axis=1).sum(axis=1).max() for axis in range(3)])


def _is_stack_of_discs(positions: Array, axis: int) -> bool:
    """Whether samples lie in a few planes across an axis, the outermost of which are filled like the others."""
    height, planes = np.unique(np.round(positions[:, axis] / ROUNDING), return_inverse=True)
    across = np.linalg.norm(np.delete(positions, axis, axis=1), axis=1)
    if not 2 <= len(height) <= len(positions) / FEWEST_IN_PLANE or _reach_into_corners(positions)[axis] > DISC**2:
        return False
    planes = planes.reshape(-1)
    return min(across[planes == 0].max(), across[planes == len(height) - 1].max()) > FILLED * across.max()


def _refuse_flat(positions: Array) -> None:
    """Raise ValueError for samples of a tilted plane or a line in space, whose domain is not known."""
    thickness = np.linalg.svd(np.linalg.qr(positions - positions.mean(axis=0), mode="r"), compute_uv=False)
    if len(positions) > 1 and thickness[-1] <= ROUNDING * thickness[0] > 0:
        raise ValueError(
            "the trajectory lies in one plane or on a line of space; pass its two coordinates in the plane, "
            "or say rim='ball', 'cylinder' or 'box' to treat the samples as three-dimensional"
        )
