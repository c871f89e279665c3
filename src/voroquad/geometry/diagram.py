"""The class of Voronoi cells, which computes their properties on demand."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._support.arrays import Array, Integers
from .._support.checks import real_numbers
from .._support.extras import install_hint
from .._support.html import table
from .bounds import Bounds
from .neighbours import Neighbours
from .plots import draw
from .shapes import Polygons, Polyhedra
from .triangulation import SAME, Triangulation, triangulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Cells:
    """The Voronoi cells of one set of points or of a batch of sets; made by :func:`cells`."""

    def __init__(self, points: Array, bounds: Bounds, threads: int):
        self._points = points  # in the core's coordinates
        self._bounds = bounds
        self._threads = threads
        # What has been computed. No lock: threads that ask at the same time may compute it twice, and a child forked
        # meanwhile waits for nobody.
        self._measures: Array | None = None
        self._centroids: Array | None = None
        self._polygons: Polygons | None = None
        self._polyhedra: Polyhedra | None = None

    def __repr__(self) -> str:
        *sets, n, d = self._points.shape
        return f"{type(self).__name__}({f'sets={sets[0]}, ' if sets else ''}n={n}, d={d})"

    def _repr_html_(self) -> str:
        *sets, n, d = self._points.shape
        measures = self._measures
        known = [] if measures is None else [("measures", f"{measures.min():.4g} to {measures.max():.4g}")]
        batch = [("sets", sets[0])] if sets else []
        rows = [*batch, ("cells", n), ("dimension", d), self._extent_row(), ("periodic", self.periodic), *known]
        return table(type(self).__name__, rows)

    def _extent_row(self) -> tuple[str, str]:
        """What a notebook shows of where cells end."""
        return "bounds", " × ".join(f"[{low:g}, {high:g}]" for low, high in self.bounds)

    @property
    def points(self) -> Array:
        """The points (n, d) or (sets, n, d), on periodic axes below the upper end."""
        return self._bounds.from_core(self._points)

    @property
    def bounds(self) -> Array:
        """Lower and upper end (d, 2) of the box's sides."""
        return self._bounds.sides.copy()

    @property
    def periodic(self) -> bool | tuple[bool, ...]:
        """Whether the axes are periodic: a single bool if it is the same for all, otherwise a bool for each axis."""
        axes = tuple(self._bounds.periodic.tolist())
        return axes[0] if len(set(axes)) == 1 else axes

    @property
    def measures(self) -> Array:
        """Length, area or volume (n,) of each point's cell, or (sets, n) of a batch. They sum to that of the box."""
        if self._measures is None:
            self._measures = self._measure()
        return self._measures

    @property
    def centroids(self) -> Array:
        """Centre of mass (n, d) of each point's cell, for a single set. On periodic axes it may lie outside the box."""
        self._one_set("centroids")
        if self._centroids is None:
            self._centroids = self._find_centroids()
        return self._centroids

    def intervals(self) -> Array:
        """Ends (n, 2) of each point's cell, d = 1; on a periodic axis they may lie outside the bounds."""
        return self._bounds.from_core(_core.intervals(self._one_set("intervals", 1), *self._bounds.in_core))

    def polygons(self) -> Polygons:
        """Corners of each point's cell, counter-clockwise, d = 2.

        Returns
        -------
        Polygons
            A sequence of n arrays (k, 2). These are views, made when asked for, of one array ``coordinates`` (v, 2),
            in which those of cell i begin at ``offsets[i]``.

        Notes
        -----
        On periodic axes a cell is not cut at the border of the box, so corners may lie outside it.
        Points that coincide each get the cell that they share.
        """
        self._one_set("polygons", 2)
        if self._polygons is None:
            self._polygons = self._cut_polygons()
        return self._polygons

    def polygon(self, i: int) -> Array:
        """Corners (k, 2) of the cell of point i, counter-clockwise, d = 2."""
        return self.polygons()[i]

    def geometries(self) -> NDArray[np.object_]:
        """The cells (n,) as Shapely polygons, d = 2. For GeoPandas use ``GeoSeries(cells.geometries(), crs=...)``.

        Needs the extra ``geo``.
        """
        try:
            import shapely
        except ImportError as error:
            raise ImportError(f"geometries needs Shapely; {install_hint('geo')}") from error
        self._one_set("geometries", 2)
        polygons = Cells.polygons(self)
        # A cell of fewer than three corners has no area, and Shapely's rings are closed
        rings = [polygon if len(polygon) > 2 else np.repeat(polygon[:1], 3, axis=0) for polygon in polygons]
        geometries = np.array([shapely.Polygon(ring) for ring in rings], dtype=object)
        # Rounding may fold a thin cell; GEOS wants none that cross themselves, and cells are convex
        folded = ~shapely.is_valid(geometries)
        geometries[folded] = shapely.convex_hull(geometries[folded])
        return geometries

    def polyhedra(self) -> Polyhedra:
        """Faces of each point's cell, d = 3.

        Returns
        -------
        Polyhedra
            A sequence of n lists of faces. A face is an array (k, 3) of its corners, counter-clockwise from outside.
            These are views, made when asked for, of one array ``coordinates`` (c, 3), in which those of face f begin at
            ``face_offsets[f]``; the faces of cell i begin at ``offsets[i]``.

        Notes
        -----
        On periodic axes a cell is not cut at the border of the box. Points that coincide each get the
        cell that they share.
        """
        self._one_set("polyhedra", 3)
        if self._polyhedra is None:
            self._polyhedra = self._cut_polyhedra()
        return self._polyhedra

    def polyhedron(self, i: int) -> list[Array]:
        """Faces of the cell of point i, each an array of corners (k, 3), counter-clockwise from outside, d = 3."""
        return self.polyhedra()[i]

    def locate(self, x: ArrayLike) -> Integers:
        """Index of the point whose cell contains x, that is, of the nearest point in the distance of the box or torus.

        Parameters
        ----------
        x : array_like, (m, d), (d,) for one place, or (m,) if d = 1
            Places of the domain; on a lattice anywhere.

        Returns
        -------
        ndarray of int, (m,)
            Indices. If several points are equally near within rounding, the lowest index. Shape () for one place.

        Raises
        ------
        ValueError
            A place is not finite or outside the domain, or the shape is wrong.

        Examples
        --------
        >>> import voroquad as vq
        >>> vq.cells([[0.1, 0.5], [0.6, 0.5]], periodic=True).locate([[0.3, 0.1], [0.95, 0.7]])
        array([0, 0])
        """
        d = self._one_set("locate").shape[-1]
        places = real_numbers("x", x)
        rows = places[..., None] if d == 1 and places.ndim < 2 else places
        if rows.ndim not in (1, 2) or rows.shape[-1] != d:
            raise ValueError(f"x must have shape (m, {d}) or ({d},), got {places.shape}")
        if not len(rows):
            return np.empty(0, dtype=np.int64)
        nearest = self._locate(np.asarray(x).reshape(-1, d))  # in its own type
        return nearest.astype(np.int64).reshape(rows.shape[:-1])

    def neighbours(self) -> Neighbours:
        """Which cells share a face, how large the face is and how far apart the points are, for a single set.

        Returns
        -------
        Neighbours
            Compressed sparse rows (CSR): `indptr` (n + 1,), `indices` (m,), and for each entry the length or area of
            the face (`measures`), the `distances` of the two points and on periodic axes the `shifts` (m, d) of the
            neighbour's image, in periods. Faces on the border of the domain have no entry; `border` (n,) has their
            measure for each cell. So the ``measures`` of a row and ``border`` add up to the surface of the cell.

        Notes
        -----
        Both cells list the same face. A face smaller than 1e-12 of their surfaces is left out, so cells that touch only
        in a corner or an edge, as on a lattice, are not neighbours. Of coinciding points the first has all entries. If
        two clusters are narrower than 1e-14 of the distance between them, rounding decides which of their points share
        a face.

        Examples
        --------
        >>> import voroquad as vq
        >>> near = vq.cells([[0.25, 0.5], [0.75, 0.25], [0.75, 0.75]]).neighbours()
        >>> near[0].tolist(), near.distances[:2].round(3), near.border
        ([1, 2], array([0.559, 0.559]), array([1.625 , 1.1875, 1.1875]))
        >>> from scipy.sparse import csr_array
        >>> csr_array((near.measures / near.distances, near.indices, near.indptr)).shape  # of a finite volume scheme
        (3, 3)
        """
        self._one_set("neighbours")
        return self._find_neighbours()

    def triangulation(self) -> Triangulation:
        """The Delaunay triangulation of a single set, d = 2 or 3: simplices between points whose cells meet in a
        corner.

        Returns
        -------
        Triangulation
            ``simplices`` (m, d + 1), and on periodic axes the ``shifts`` (m, d + 1, d) of their corners in periods.

        Notes
        -----
        Cells end at the border of the domain, so only simplices whose circumcentre lies inside the domain are included;
        on a torus these are all. If more than d + 1 cells meet in a corner, within 1e-12 of the longest side, their
        points lie on a circle or sphere, and any triangulation of their convex hull is a Delaunay triangulation. The
        hull is split from its point with the lowest index. Points closer together than 1e-9 of the longest side are
        represented by the first of them.

        Examples
        --------
        >>> import voroquad as vq
        >>> vq.cells([[0.2, 0.2], [0.8, 0.2], [0.8, 0.8], [0.2, 0.8]]).triangulation().simplices
        array([[0, 1, 2],
               [0, 2, 3]])
        """
        d = self._one_set("triangulation").shape[-1]
        if d == 1:
            raise ValueError("triangulation needs points in d = 2 or 3; on a line neighbours() has the pairs")
        if d == 2:
            polygons = self.polygons()
            corners, count = polygons.coordinates, np.diff(polygons.offsets)
        else:
            polyhedra = self.polyhedra()
            corners, count = polyhedra.coordinates, np.diff(polyhedra.face_offsets[polyhedra.offsets])
        return self._triangulate(corners, np.repeat(np.arange(len(count)), count))

    def plot(self, values: ArrayLike | None = None, *, ax: Axes | None = None, cmap: Any = "viridis") -> Axes:
        """Draw the cells of a single set with Matplotlib, each in the colour of its value.

        Parameters
        ----------
        values : array_like, (n,), optional
            The values that the colours show; by default the measures.
        ax : matplotlib.axes.Axes, optional
            Where to draw; a new figure by default. For d = 3 it must have ``projection="3d"``.
        cmap : str or matplotlib.colors.Colormap
            Colours of the smallest to the largest value.

        Returns
        -------
        matplotlib.axes.Axes
            The axes: ``cells.plot().figure.savefig("cells.png")``. In the plane
            ``ax.figure.colorbar(ax.collections[0])`` adds the scale. In space the cells are shaded, and drawn smaller
            about their centroids.

        Raises
        ------
        ImportError
            Matplotlib is not installed; the extra ``study`` brings it.
        """
        return draw(self, values, ax, cmap)

    def _outlines(self) -> Iterable[list[Array]]:
        """For each cell in the plane, the rings (k, 2) around its pieces and holes."""
        return ([polygon] for polygon in self.polygons())

    def _rim(self) -> tuple[Array, float] | None:
        """Centre and radius of the disc that pictures of cells end at, if there is one."""
        return None

    def _one_set(self, what: str, d: int | None = None) -> Array:
        if self._points.ndim != 2 or d not in (None, self._points.shape[-1]):
            raise ValueError(f"{what} needs one set of points (n, {d or 'd'}), got shape {self._points.shape}")
        return self._points[None]

    # What follows is for boxes and convex domains; other domains have classes of their own.

    def _measure(self) -> Array:
        batch = self._points if self._points.ndim == 3 else self._points[None]
        measures = self._bounds.measures_from_core(_core.measures(batch, *self._bounds.region, self._threads))
        return measures if self._points.ndim == 3 else measures[0]

    def _radii(self) -> Array:
        """Distance (n,) from each point to the farthest corner of its cell."""
        radii = _core.radii(self._points[None], *self._bounds.region, self._threads)
        return self._bounds.measures_from_core(radii, 1)

    def _find_centroids(self) -> Array:
        points = self._points[None]
        if points.shape[-1] == 1:
            centroids = _core.intervals(points, *self._bounds.in_core).mean(axis=1, keepdims=True)
        else:
            centroids = _core.centroids(points, *self._bounds.region, self._threads)
        return self._bounds.from_core(centroids)

    def _cut_polygons(self) -> Polygons:
        coordinates, offsets = _core.polygons(self._points[None], *self._bounds.region)
        return Polygons(self._bounds.from_core(coordinates, in_place=True), offsets.view(np.int64))

    def _cut_polyhedra(self) -> Polyhedra:
        coordinates, faces, offsets = _core.polyhedra(self._points[None], *self._bounds.region)
        coordinates = self._bounds.from_core(coordinates, in_place=True)
        return Polyhedra(coordinates, faces.view(np.int64), offsets.view(np.int64))

    def _locate(self, places: NDArray[Any]) -> NDArray[Any]:
        inside = self._bounds.to_core(places, "x")
        return _core.nearest(self._points[None], inside[None], *self._bounds.in_core, self._threads)

    def _find_neighbours(self) -> Neighbours:
        box, d = self._bounds, self._points.shape[-1]
        found = _core.neighbours(self._points[None], *box.region, self._threads)
        indptr, indices, measures, distances, periods, border = found
        measures, border = (box.measures_from_core(values, d - 1) for values in (measures, border))
        distances = box.measures_from_core(distances, 1)
        shifts = periods.astype(np.int64) if box.periodic.any() else np.zeros((len(indices), d), np.int64)
        return Neighbours(indptr.view(np.int64), indices.view(np.int64), measures, distances, shifts, border)

    def _triangulate(self, corners: Array, owners: Integers) -> Triangulation:
        low, high = self._bounds.sides.T
        inside = self._bounds.depth(corners) > SAME * (high - low).max()
        vectors = np.diag(high - low)
        return triangulate(self.points, corners[inside], owners[inside], low, vectors, self._bounds.periodic)
