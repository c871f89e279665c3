"""Voronoi cells of points that a triclinic lattice repeats."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._support.arrays import Array, Integers
from .bounds import Bounds
from .diagram import Cells
from .lattice import Images, Lattice
from .neighbours import Neighbours
from .shapes import Polygons, Polyhedra
from .triangulation import Triangulation, triangulate


class LatticeCells(Cells):
    """Cells of one set of points and their images, d = 2 or 3; of a batch the measures.

    They are those of a box that holds the points and so many images that no cell can change: all that are nearer than
    twice the radius of the largest cell, the distance from its point to its farthest corner.

    Parameters
    ----------
    home : ndarray, (n, d) or (sets, n, d)
        Points as :meth:`Lattice.wrapped` returns them. Wrapped twice they would move by roundings.
    """

    def __init__(self, home: Array, lattice: Lattice, threads: int):
        low, high = home.reshape(-1, lattice.d).min(axis=0), home.reshape(-1, lattice.d).max(axis=0)
        margin = np.linalg.norm(lattice.reduced, axis=1).sum()
        super().__init__(home, Bounds(lattice.d, np.stack([low - margin, high + margin], axis=-1)), threads)
        self._lattice = lattice
        self._found: tuple[float, Images, Cells] | None = None

    @property
    def points(self) -> Array:
        """The images (n, d) of the points in the cell of the reduced lattice vectors at the origin."""
        return self._points

    @property
    def bounds(self) -> Array:
        """Raises ValueError, since a lattice has vectors and no sides."""
        raise ValueError("cells of a lattice have no bounds; lattice has its vectors")

    @property
    def lattice(self) -> Array:
        """The lattice vectors (d, d) as given, one in each row."""
        return self._lattice.vectors.copy()

    @property
    def periodic(self) -> bool:
        """True."""
        return True

    def _extent_row(self) -> tuple[str, str]:
        return "lattice", _shown(self.lattice)

    def _measure(self) -> Array:
        if self._points.ndim == 3:
            each = [LatticeCells(home, self._lattice, self._threads).measures for home in self._points]
            return np.array(each)
        images, cells = self._around
        return cells.measures[images.home]

    def _find_centroids(self) -> Array:
        images, cells = self._around
        return cells.centroids[images.home]

    def _cut_polygons(self) -> Polygons:
        images, cells = self._around
        return cells.polygons().take(images.home)

    def _cut_polyhedra(self) -> Polyhedra:
        images, cells = self._around
        return cells.polyhedra().take(images.home)

    def _locate(self, places: NDArray[Any]) -> NDArray[Any]:
        given = self._lattice.read("x", places)
        images, cells = self._around
        return images.point[cells.locate(self._lattice.wrapped(given))]

    def _find_neighbours(self) -> Neighbours:
        # Twice as far, so that the cells of neighbours are correct as well
        reach = self._found[0] if self._found else self._enough_images()[0]
        images = self._lattice.images(self._points, 2 * reach)
        near = self._cells_of(images).neighbours()
        rows = near.rows
        i, j, shift = images.point[rows], images.point[near.indices], images.shift[near.indices]
        # From each face seen from home one direction, so that both have the same numbers
        ahead = (i < j) | ((i == j) & (_leading(shift) > 0))
        kept = np.flatnonzero((images.shift[rows] == 0).all(axis=1) & ahead)
        both = np.concatenate([kept, kept])
        point = np.concatenate([i[kept], j[kept]])
        other = np.concatenate([j[kept], i[kept]])
        shifts = np.concatenate([shift[kept], -shift[kept]]) @ self._lattice.steps
        order = np.lexsort([*shifts.T[::-1], other, point])
        indptr = np.concatenate([[0], np.cumsum(np.bincount(point, minlength=len(self._points)))])
        measures, distances = near.measures[both][order], near.distances[both][order]
        return Neighbours(indptr, other[order], measures, distances, shifts[order], np.zeros(len(self._points)))

    def _triangulate(self, corners: Array, owners: Integers) -> Triangulation:
        lattice, periodic = self._lattice, np.ones(self._lattice.d, dtype=np.bool_)
        found = triangulate(self.points, corners, owners, np.zeros(lattice.d), lattice.reduced, periodic)
        return Triangulation(found.simplices, found.shifts @ lattice.steps)

    @property
    def _around(self) -> tuple[Images, Cells]:
        if self._found is None:
            reach, images = self._enough_images()
            self._found = reach, images, self._cells_of(images)
        return self._found[1:]

    def _enough_images(self) -> tuple[float, Images]:
        """The distance up to which images are needed for correct cells, and these images."""
        lattice, n = self._lattice, len(self._points)
        most = 2 * lattice.covering_radius * (1 + 1e-12)
        reach = min(most, 6 * (lattice.volume / n) ** (1 / lattice.d))
        while True:
            images = lattice.images(self._points, reach)
            if reach >= most:
                return reach, images
            # With too few images cells are too large, never too small
            wanted = 2 * self._cells_of(images)._radii()[images.home].max() * (1 + 1e-12)
            if wanted <= reach:
                return reach, images
            reach = min(most, max(wanted, 1.5 * reach))

    def _cells_of(self, images: Images) -> Cells:
        margin = 2 * self._lattice.covering_radius
        low, high = images.places.min(axis=0) - margin, images.places.max(axis=0) + margin
        box = Bounds(self._lattice.d, np.stack([low, high], axis=-1))
        return Cells(box.to_core(images.places), box, self._threads)


class LineCells(Cells):
    """Cells of points on a line that one vector repeats: those of a circle, with shifts in periods of the vector."""

    def __init__(self, points: ArrayLike, lattice: Lattice, threads: int):
        self._lattice = lattice
        self._period = abs(float(lattice.vectors[0, 0]))
        circle = Bounds(1, (0.0, self._period), True)
        super().__init__(circle.to_core(self._wrapped("points", points)), circle, threads)

    @property
    def lattice(self) -> Array:
        """The lattice vector (1, 1) as given."""
        return self._lattice.vectors.copy()

    def _extent_row(self) -> tuple[str, str]:
        return "lattice", _shown(self.lattice)

    def _locate(self, places: NDArray[Any]) -> NDArray[Any]:
        return super()._locate(self._wrapped("x", places))

    def _find_neighbours(self) -> Neighbours:
        found = super()._find_neighbours()
        if self._lattice.vectors[0, 0] > 0:
            return found
        shifts = -found.shifts
        order = np.lexsort([shifts[:, 0], found.indices, found.rows])
        kept = found.indices[order], found.measures[order], found.distances[order], shifts[order]
        return Neighbours(found.indptr, *kept, found.border)

    def _wrapped(self, name: str, places: ArrayLike) -> Array:
        return np.asarray(np.mod(self._lattice.read(name, places), self._period))


def _shown(vectors: Array) -> str:
    return ", ".join("(" + ", ".join(f"{x:g}" for x in vector) + ")" for vector in vectors)


def _leading(shifts: Integers) -> Integers:
    """The first number of each row (m, d) that is not 0, or 0."""
    first = (shifts != 0).argmax(axis=1)
    return np.take_along_axis(shifts, first[:, None], axis=1)[:, 0]
