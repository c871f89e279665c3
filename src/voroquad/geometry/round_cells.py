"""Voronoi cells in a disc, ball or cylinder: their measures."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._support.arrays import Array
from .._support.checks import point_array
from .bounds import Bounds, type_of
from .diagram import Cells
from .neighbours import Neighbours
from .shapes import Polygons, Polyhedra
from .triangulation import Triangulation

#: By how much the sides of the box around a circle may differ, relatively
ROUND = 1e-12
#: The same where that is their rounding, far from the origin
FAR_ROUND = 1e-8


class RoundCells(Cells):
    """The parts of cells inside a ball, or inside a cylinder about the third axis, that touches the sides of its box.

    Such pieces have curved borders: they have measures, and no corners. Those in a disc can be drawn.
    """

    def __init__(self, points: ArrayLike, box: Bounds, shape: str, threads: int):
        axes = box.d if shape == "ball" else 2
        sides = box.sides[:axes]
        length = sides[:, 1] - sides[:, 0]
        if shape == "cylinder" and box.d != 3:
            raise ValueError(f"domain='cylinder' needs points in d = 3, got d = {box.d}; a disc is domain='ball'")
        if box.d == 1:
            raise ValueError("domain='ball' needs points in d = 2 or 3; on a line give bounds=")
        rounding = 4 * float(np.finfo(np.float64).eps) * np.abs(sides).max()  # of the ends, and of their distance
        if np.ptp(length) > max(ROUND * length.max(), min(rounding, FAR_ROUND * length.max())):
            raise ValueError(f"bounds {sides.tolist()}: a {shape} touches its box, so that these sides must be equal")
        if box.periodic[:axes].any():
            raise ValueError(f"periodic {box.periodic.tolist()}: axes across a {shape} are not periodic")
        self._shape, self._axes = shape, axes
        self._centre, self._radius = sides.mean(axis=1), float(length.max() / 2)
        super().__init__(box.to_core(self._inside("points", points, sides)), box, threads)

    def _inside(self, name: str, places: ArrayLike, sides: Array) -> NDArray[Any]:
        """Places in their own type, those that rounding has put outside the box in it; ValueError for others."""
        given = point_array(places, name=name)
        distance = np.linalg.norm(given[..., : self._axes] - self._centre, axis=-1)
        slack = max(ROUND * self._radius, 2 * float(np.finfo(type_of(places)).eps * np.abs(sides).max()))
        outside = np.argwhere(~(distance <= self._radius + slack))
        if len(outside):
            first = tuple(outside[0].tolist())
            index = first[0] if len(first) == 1 else first
            raise ValueError(f"{name}[{index}] = {given[first].tolist()} is outside the {self._shape}; drop it")
        inside = np.array(places, copy=True)
        inside[..., : self._axes] = np.clip(inside[..., : self._axes], *sides.T)
        return inside

    def _measure(self) -> Array:
        batch = self._points if self._points.ndim == 3 else self._points[None]
        one = self._in_ball if self._shape == "ball" else self._in_cylinder
        measures = np.array([one(points) for points in batch])
        return measures if self._points.ndim == 3 else measures[0]

    def _in_ball(self, points: Array) -> Array:
        return self._bounds.measures_from_core(_core.measures_in_ball(points[None], *self._in_core, self._threads))

    def _in_cylinder(self, points: Array) -> Array:
        return self._bounds.measures_from_core(_core.measures_in_cylinder(points[None], *self._in_core, self._threads))

    @property
    def _in_core(self) -> tuple[Array, NDArray[np.bool_], Array, float]:
        """Sides, periodic axes, centre and radius as the core takes them, so that no digit of a point is lost."""
        sides, periodic = self._bounds.in_core
        return sides, periodic, sides.mean(axis=1), self._bounds.length_in_core(self._radius)

    def _outlines(self) -> Iterable[list[Array]]:
        arrays = Cells._cut_polygons(self)  # of the box; the picture ends at the rim
        return ([arrays[i]] for i in range(len(arrays)))

    def _rim(self) -> tuple[Array, float]:
        return self._centre, self._radius

    def _locate(self, places: NDArray[Any]) -> NDArray[Any]:
        return super()._locate(self._inside("x", places, self._bounds.sides[: self._axes]))

    def geometries(self) -> NDArray[np.object_]:
        """Raises ValueError, since curved borders have no corners."""
        self._refuse("geometries, since their borders are curved and have no corners")

    def triangulation(self) -> Triangulation:
        """Raises ValueError, since the corners of cells are not known."""
        self._refuse("triangulation")

    def _find_centroids(self) -> Array:
        self._refuse("centroids")

    def _cut_polygons(self) -> Polygons:
        self._refuse("polygons")

    def _cut_polyhedra(self) -> Polyhedra:
        self._refuse("polyhedra")

    def _find_neighbours(self) -> Neighbours:
        self._refuse("neighbours")

    def _refuse(self, what: str) -> NoReturn:
        raise ValueError(
            f"cells in a {self._shape} have measures but no {what}; leave out domain= for the cells of the box"
        )
