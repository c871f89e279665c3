"""Voronoi cells of points in a box or on a torus."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._support.checks import point_array, real_numbers, thread_count
from .bounds import Bounds, Periodic
from .neighbours import Neighbours
from .shapes import Polygons, Polyhedra
from .triangulation import SAME, Triangulation, triangulate


class Cells:
    """The Voronoi cells of one set of points or of a batch of sets; made by :func:`cells`."""

    def __init__(self, points: NDArray[np.float64], bounds: Bounds, threads: int):
        self._points = points  # in the core's coordinates
        self._bounds = bounds
        self._threads = threads
        # What has been computed. No lock: threads that ask at the same time may compute it twice, and a child forked
        # meanwhile waits for nobody.
        self._measures: NDArray[np.float64] | None = None
        self._centroids: NDArray[np.float64] | None = None
        self._polygons: Polygons | None = None
        self._polyhedra: Polyhedra | None = None

    @property
    def points(self) -> NDArray[np.float64]:
        """The points (n, d) or (sets, n, d), on periodic axes below the upper end."""
        return self._bounds.from_core(self._points)

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Lower and upper end (d, 2) of the box's sides."""
        return self._bounds.sides.copy()

    @property
    def periodic(self) -> bool | tuple[bool, ...]:
        """Whether the axes are periodic: one answer where it is the same for all, else one for each."""
        axes = tuple(self._bounds.periodic.tolist())
        return axes[0] if len(set(axes)) == 1 else axes

    @property
    def measures(self) -> NDArray[np.float64]:
        """Length, area or volume (n,) of each point's cell; (sets, n) for a batch. Those of a set sum to the box's."""
        if self._measures is None:
            batch = self._points if self._points.ndim == 3 else self._points[None]
            measures = _core.measures(batch, *self._bounds.region, self._threads)
            measures = self._bounds.measures_from_core(measures)
            self._measures = measures if self._points.ndim == 3 else measures[0]
        return self._measures

    @property
    def centroids(self) -> NDArray[np.float64]:
        """Centre of mass (n, d) of each point's cell; of one set. On periodic axes it may lie outside the box."""
        points = self._one_set("centroids")
        if self._centroids is None:
            if points.shape[-1] == 1:
                centroids = _core.intervals(points, *self._bounds.in_core).mean(axis=1, keepdims=True)
            else:
                centroids = _core.centroids(points, *self._bounds.region, self._threads)
            self._centroids = self._bounds.from_core(centroids)
        return self._centroids

    def intervals(self) -> NDArray[np.float64]:
        """Ends (n, 2) of each point's cell, d = 1; on a periodic axis they may lie outside the bounds."""
        return self._bounds.from_core(_core.intervals(self._one_set("intervals", 1), *self._bounds.in_core))

    def polygons(self) -> list[NDArray[np.float64]]:
        """Corners (k, 2) of each point's cell, counter-clockwise, d = 2.

        On periodic axes a cell is not cut at the border of the box, so corners may lie outside it.
        Points that coincide each get the cell that they share.
        """
        arrays = self.polygon_arrays()
        return np.split(arrays.coordinates, arrays.offsets[1:-1])

    def polygon(self, i: int) -> NDArray[np.float64]:
        """Corners (k, 2) of the cell of point i, counter-clockwise, d = 2."""
        return self.polygon_arrays()[i]

    def polygon_arrays(self) -> Polygons:
        """Corners of all cells in one array, and where those of each cell begin, d = 2."""
        if self._polygons is None:
            coordinates, offsets = _core.polygons(self._one_set("polygons", 2), *self._bounds.region)
            self._polygons = Polygons(self._bounds.from_core(coordinates), offsets.astype(np.int64))
        return self._polygons

    def polyhedra(self) -> list[list[NDArray[np.float64]]]:
        """Faces of each point's cell, d = 3; each face its corners (k, 3), counter-clockwise from outside.

        On periodic axes a cell is not cut at the border of the box. Points that coincide each get the
        cell that they share.
        """
        arrays = self.polyhedron_arrays()
        faces = np.split(arrays.coordinates, arrays.face_offsets[1:-1])
        return [faces[first:last] for first, last in itertools.pairwise(arrays.offsets.tolist())]

    def polyhedron(self, i: int) -> list[NDArray[np.float64]]:
        """Faces of the cell of point i, each its corners (k, 3), counter-clockwise from outside, d = 3."""
        return self.polyhedron_arrays()[i]

    def polyhedron_arrays(self) -> Polyhedra:
        """Corners of all faces in one array, where those of each face and the faces of each cell begin, d = 3."""
        if self._polyhedra is None:
            coordinates, faces, offsets = _core.polyhedra(self._one_set("polyhedra", 3), *self._bounds.region)
            coordinates = self._bounds.from_core(coordinates)
            self._polyhedra = Polyhedra(coordinates, faces.astype(np.int64), offsets.astype(np.int64))
        return self._polyhedra

    def locate(self, x: ArrayLike) -> NDArray[np.int64]:
        """Index of the point whose cell holds x: of the nearest point by the distances of the box or torus.

        Parameters
        ----------
        x : array_like, (m, d), (d,) for one place, or (m,) if d = 1
            Places of the domain.

        Returns
        -------
        ndarray of int, (m,)
            Indices; of points that are equally near, as distances are rounded, the lowest. Shape () for one place.

        Examples
        --------
        >>> import voroquad as vq
        >>> vq.cells([[0.1, 0.5], [0.6, 0.5]], periodic=True).locate([[0.3, 0.1], [0.95, 0.7]])
        array([0, 0])
        """
        points = self._one_set("locate")
        d = points.shape[-1]
        places = real_numbers("x", x)
        rows = places[..., None] if d == 1 and places.ndim < 2 else places
        if rows.ndim not in (1, 2) or rows.shape[-1] != d:
            raise ValueError(f"x must have shape (m, {d}) or ({d},), got {places.shape}")
        inside = self._bounds.to_core(np.asarray(x).reshape(-1, d), "x")  # in its own type
        nearest = _core.nearest(points, inside[None], *self._bounds.in_core, self._threads)
        return nearest.astype(np.int64).reshape(rows.shape[:-1])

    def neighbours(self) -> Neighbours:
        """Which cells share a face, how large it is and how far apart their points are; of one set.

        Returns
        -------
        Neighbours
            Compressed sparse rows (CSR): `indptr` (n + 1,), `indices` (m,), and for each entry the length or area of
            the face (`measures`), the `distances` of the two points and on periodic axes the `shifts` (m, d) in
            periods of the image that is met. Faces on the border of the domain have no entry: `border` (n,) has what
            of each cell lies there. So ``measures`` of a row and ``border`` add up to the cell's surface.

        Notes
        -----
        Both cells list the same face; of less than 1e-12 of their surfaces it is left out: cells that touch in a corner
        or an edge, as on a lattice, are not neighbours. Of points that coincide the first has all entries. From afar
        two clusters that are narrower than 1e-14 of their distance look like points: which of theirs have a face
        between them is left to rounding.

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
        points = self._one_set("neighbours")
        box, d = self._bounds, points.shape[-1]
        indptr, indices, measures, distances, shifts, border = _core.neighbours(points, *box.region, self._threads)
        measures, border = (box.measures_from_core(values, d - 1) for values in (measures, border))
        return Neighbours(indptr, indices, measures, box.measures_from_core(distances, 1), shifts, border)

    def triangulation(self) -> Triangulation:
        """The Delaunay triangulation: simplices between points whose cells meet in a corner; d = 2 or 3, of one set.

        Returns
        -------
        Triangulation
            ``simplices`` (m, d + 1), and on periodic axes the ``shifts`` (m, d + 1, d) of their corners in periods.

        Notes
        -----
        Cells end at the border of the domain. So simplices are those of the Delaunay triangulation whose circumcentre
        lies inside the domain; on a torus these are all. Where more than d + 1 cells meet in a corner, to within 1e-12
        of the longest side, their points lie on a circle or sphere, and any triangulation of their convex hull is a
        Delaunay triangulation: it is drawn from the point with the lowest index. Of points nearer to each other than
        1e-9 of the longest side the first stands for all.

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
            polygons = self.polygon_arrays()
            corners, count = polygons.coordinates, np.diff(polygons.offsets)
        else:
            polyhedra = self.polyhedron_arrays()
            corners, count = polyhedra.coordinates, np.diff(polyhedra.face_offsets[polyhedra.offsets])
        owners = np.repeat(np.arange(len(count)), count)
        inside = self._bounds.depth(corners) > SAME * np.ptp(self._bounds.sides, axis=1).max()
        return triangulate(self.points, corners[inside], owners[inside], self._bounds.sides, self._bounds.periodic)

    def _one_set(self, what: str, d: int | None = None) -> NDArray[np.float64]:
        if self._points.ndim != 2 or d not in (None, self._points.shape[-1]):
            raise ValueError(f"{what} needs one set of points (n, {d or 'd'}), got shape {self._points.shape}")
        return self._points[None]


def cells(
    points: ArrayLike,
    *,
    bounds: ArrayLike | None = None,
    periodic: Periodic = False,
    threads: int | None = None,
) -> Cells:
    """Voronoi cells of points in a box or on a torus.

    Parameters
    ----------
    points : array_like, (n,), (n, d) or (sets, n, d), d = 1, 2 or 3
        Points of the box. Points that coincide share their cell equally.
    bounds : array_like, (d, 2) or (2,), optional
        Lower and upper end of each side of the box, in the unit of the points; a single pair is for all axes. By
        default the unit box [0, 1]^d.
    periodic : bool or sequence of bool, (d,)
        False: cells end at the faces of the box. True: opposite faces are the same place, as on a torus, and the
        upper end of an axis is its lower end. One answer for all axes, or one for each: ``[False, True]``.
    threads : int, optional
        Number of threads; by default all processors, or what the environment variable
        VOROQUAD_NUM_THREADS says. The result does not depend on it.

    Returns
    -------
    Cells
        With ``measures`` (n,) or (sets, n), ``centroids`` (n, d), ``intervals()`` for d = 1,
        ``polygons()`` for d = 2 and ``polyhedra()`` for d = 3, all in the coordinates of the points; each is computed
        when it is asked for.

    Raises
    ------
    ValueError
        A point is NaN or outside the box, d is not 1, 2 or 3, or `bounds` or `periodic` do not fit d.

    Notes
    -----
    The cell of x_i is the set of all y no farther from x_i than from any other point,
    V_i = {y : \\|y − x_i\\| ≤ \\|y − x_j\\| for all j}. It is cut out by the half-spaces
    (x_j − x_i)·(y − x_i) ≤ \\|x_j − x_i\\|²/2 of the neighbours, nearest first, until every
    corner of the cell is closer than half the distance to all points not yet seen.

    Distances are Euclidean in the unit of the points. Scaling each axis of a box that is not a cube to [0, 1] changes
    distances, and hence cells: give `bounds` instead.

    Points outside the box by no more than the rounding of their own type (float32 or float64) are moved onto its
    faces; on periodic axes they are wrapped.

    Examples
    --------
    >>> import voroquad as vq
    >>> vq.cells([0.25, 0.5, 0.75]).measures
    array([0.375, 0.25 , 0.375])
    >>> vq.cells([[0.25, 0.5], [0.75, 0.5]]).polygons()[0]
    array([[0.5, 1. ], [0. , 1. ], [0. , 0. ], [0.5, 0. ]])
    >>> vq.cells([[1.0, 0.5], [2.0, 0.5]], bounds=[(0, 4), (0, 1)]).measures
    array([1.5, 2.5])
    >>> vq.cells([[1.0, 0.5], [2.0, 0.5]], bounds=[(0, 4), (0, 1)], periodic=[True, False]).measures
    array([2., 2.])
    """
    array = point_array(points)
    n, d = array.shape[-2:]
    if d > 3:
        remedy = "pass points.T if they are (d, n)" if n <= 3 else "weights(points) counts them by probes"
        raise ValueError(f"cells are computed for d = 1, 2 and 3, got d = {d}, points of shape {array.shape}; {remedy}")
    box = Bounds(d, bounds, periodic)
    inside = box.to_core(points)
    # A copy: what is checked here is what is cut later
    own = inside.copy() if np.may_share_memory(inside, array) else inside
    return Cells(own, box, thread_count(threads))
