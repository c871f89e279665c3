"""Convex domains: intersections of half-spaces with a box."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from .._support.arrays import Array
from .._support.checks import real_numbers, refuse_outside
from .bounds import Bounds

#: How far a vertex may lie inside the hull of the others, relative to their extent, and still count as on its border
FLAT = 1e-12
#: How many roundings of the largest coordinate a point may lie outside
ROUNDINGS = 16
#: How far outside, relative to the largest coordinate, a point may stay: measures do not depend on it to 1e-15
UNSEEN = 1e-15
#: Exponents of two up to which offsets need no other unit: linear programs have tolerances and an infinity of their own
ORDINARY = 20
#: The largest coordinate of a vertex: sums stay finite
LARGEST = 1e300


class ConvexDomain(Bounds):
    """A convex polygon or polytope in the box around it.

    Parameters
    ----------
    vertices : ndarray, (k, d), d = 2 or 3
        Points on the border of the domain, in any order, which is their convex hull.
    half_spaces : ndarray, (m, d + 1), optional
        What the domain was given by: unit normals and offsets. Points are then held against these. Where walls
        meet at a small angle, rounding moves a vertex, and the box around all, by many roundings of its coordinates.
    """

    def __init__(self, vertices: Array, half_spaces: Array | None = None):
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        super().__init__(vertices.shape[1], np.stack([low, high], axis=-1))
        middle, extent = (low + high) / 2, (high - low).max()
        hull = ConvexHull((vertices - middle) / extent)
        self.volume = float(hull.volume) * extent**self.d
        normals = hull.equations[:, :-1]
        self._middle = vertices.mean(axis=0)
        # An offset by which no vertex lies outside, whatever Qhull has rounded
        self._walls = np.column_stack([normals, (vertices @ normals.T).max(axis=0)])
        self._extent = float(extent)
        self._half_spaces = half_spaces

    @property
    def region(self) -> tuple[Array, NDArray[np.bool_], Array]:
        """The sides, the axes and the walls (m, d + 1) as the core takes them, without those that are sides."""
        walls = self._walls[np.sort(np.abs(self._walls[:, :-1]))[:, -2] > FLAT]
        normals, offsets = walls[:, :-1], walls[:, -1]
        offsets = np.ldexp(offsets - normals @ self._offset, -self._exponent)
        return *self.in_core, np.column_stack([normals, offsets])

    def depth(self, places: Array) -> Array:
        """Distance (...,) of places (..., d) from the border, where that is less than from any corner."""
        return _depth(self._walls, places)

    def _copied_inside(self, points: Array, threads: int) -> Array | None:
        return None  # walls are held against the points as well

    def _drawn_in(self, points: Array) -> Array:
        outside = self.depth(points) < -UNSEEN * np.abs(self.sides).max()
        if not outside.any():
            return points
        points, moved = points.copy(), points[outside]
        for _ in range(4 * self.d):  # each time out of the wall that is farthest behind
            gaps = self._walls[:, -1] - moved @ self._walls[:, :-1].T
            worst = gaps.argmin(axis=-1)
            gap = np.minimum(np.take_along_axis(gaps, worst[:, None], axis=-1), 0)
            if not gap.any():
                break
            moved = moved + gap * self._walls[worst, :-1]
        # Out of one wall and another the way into a sharp edge is long: what is left goes towards the middle
        gaps = np.minimum(self._walls[:, -1] - moved @ self._walls[:, :-1].T, 0)
        room = self._walls[:, -1] - self._walls[:, :-1] @ self._middle
        moved = moved + (gaps / (gaps - room)).max(axis=-1, keepdims=True) * (self._middle - moved)
        points[outside] = np.clip(moved, *self.sides.T)
        return points

    def _refuse_outside(self, points: Array, dtype: np.dtype[Any], name: str) -> None:
        slack = ROUNDINGS * np.finfo(dtype).eps * np.abs(self.sides).max()
        if self._half_spaces is None:
            low, high = self.sides.T
            refuse_outside(name, points, low, high, self._remedy(), slack=slack)
        walls = self._walls if self._half_spaces is None else self._half_spaces
        with np.errstate(over="ignore", invalid="ignore"):
            outside = np.argwhere(~(_depth(walls, points) >= -slack))
        if len(outside):
            first = tuple(outside[0].tolist())
            index = first[0] if len(first) == 1 else first
            raise ValueError(f"{name}[{index}] = {points[first].tolist()} is outside the domain; {self._remedy()}")

    def _remedy(self) -> str:
        return "drop the point or give a larger domain"


def _depth(half_spaces: Array, places: Array) -> Array:
    return np.asarray((half_spaces[:, -1] - places @ half_spaces[:, :-1].T).min(axis=-1))


def from_vertices(vertices: ArrayLike, d: int) -> ConvexDomain:
    """The convex polygon or polytope with vertices (k, d); each must be on its border."""
    given = real_numbers("domain", vertices)
    if given.ndim != 2 or given.shape[1] != d or d not in (2, 3):
        raise ValueError(f"domain has vertices of shape {given.shape}, the points need (k, {d}) with d = 2 or 3")
    _refuse_flat(given)
    domain = ConvexDomain(given)
    depth = domain.depth(given)
    inner = int(depth.argmax())
    if depth[inner] > FLAT * np.ptp(given, axis=0).max():
        raise ValueError(
            f"domain[{inner}] = {given[inner].tolist()} is inside the convex hull of the others; drop it, or for a "
            "polygon that is not convex pass shapely.Polygon(vertices)"
        )
    return domain


def from_half_spaces(normals: ArrayLike, offsets: ArrayLike, d: int) -> ConvexDomain:
    """The convex polygon or polytope of all x with normals (m, d) @ x ≤ offsets (m,)."""
    a, b = real_numbers("domain[0]", normals), real_numbers("domain[1]", offsets)
    if a.ndim != 2 or a.shape[1] != d or b.shape != a.shape[:1] or d not in (2, 3):
        raise ValueError(
            f"domain=(A, b) has shapes {a.shape} and {b.shape}; the half-spaces A x <= b need (m, {d}) and (m,), "
            "with d = 2 or 3"
        )
    if not (np.isfinite(a).all() and np.isfinite(b).all() and a.any(axis=1).all()):
        raise ValueError("domain=(A, b): each half-space needs a finite normal that is not 0, and a finite offset")
    exponent = np.frexp(np.abs(a).max(axis=1))[1]
    a = np.ldexp(a, -exponent[:, None])
    length = np.linalg.norm(a, axis=1)
    with np.errstate(over="ignore", under="ignore"):
        a, b = a / length[:, None], np.ldexp(b, -exponent) / length
    if not np.isfinite(b).all():
        raise ValueError("domain=(A, b): the distance of a half-space from the origin is not finite; change the unit")
    unit = math.frexp(float(np.abs(b).max(initial=0.0)))[1]
    if abs(unit) <= ORDINARY:
        unit = 0
    b = np.ldexp(b, -unit)
    # The middle of the largest ball that fits in
    widest = linprog([0.0] * d + [-1.0], A_ub=np.column_stack([a, np.ones(len(a))]), b_ub=b, bounds=(None, None))
    if widest.status == 3:
        raise ValueError("domain=(A, b) is not bounded; add half-spaces")
    if widest.x is None or widest.x[-1] <= 0:
        raise ValueError("domain=(A, b) is empty; check the signs: the domain is all x with A x <= b")
    try:
        with np.errstate(divide="ignore", invalid="ignore"):  # corners at infinity
            corners = HalfspaceIntersection(np.column_stack([a, -b]), widest.x[:-1]).intersections
    except QhullError:  # too few for a bounded domain
        corners = np.full((1, d), np.inf)
    if not np.isfinite(corners).all():
        raise ValueError("domain=(A, b) is not bounded; add half-spaces")
    _refuse_flat(corners)
    return ConvexDomain(np.ldexp(corners, unit), np.column_stack([a, np.ldexp(b, unit)]))


def _refuse_flat(vertices: Array) -> None:
    d = vertices.shape[1]
    if not np.isfinite(vertices).all():
        raise ValueError("domain has vertices that are not finite; drop them")
    if np.abs(vertices).max() > LARGEST:
        raise ValueError(f"domain has coordinates beyond {LARGEST:g}; change the unit")
    try:
        extent = np.ptp(vertices, axis=0).max()
        flat = len(vertices) <= d or ConvexHull((vertices - vertices.mean(axis=0)) / extent).volume < FLAT
    except (QhullError, ZeroDivisionError):
        flat = True
    if flat:
        what = "area; give three vertices" if d == 2 else "volume; give four vertices"
        raise ValueError(f"domain has no {what} or more, not all on one line or plane")
