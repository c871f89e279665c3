"""Voronoi cells of points in the unit box or on the unit torus."""

from __future__ import annotations

import itertools
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._support.checks import thread_count, unit_points


class Cells:
    """The Voronoi cells of one set of points or of a batch of sets; made by :func:`cells`."""

    def __init__(self, points: NDArray[np.float64], periodic: bool, threads: int):
        self._points = points
        self.periodic = periodic
        self._threads = threads

    @cached_property
    def measures(self) -> NDArray[np.float64]:
        """Length, area or volume (n,) of each point's cell; (sets, n) for a batch. They sum to 1 per set."""
        batch = self._points if self._points.ndim == 3 else self._points[None]
        measures = _core.measures(batch, self.periodic, self._threads)
        return measures if self._points.ndim == 3 else measures[0]

    @cached_property
    def centroids(self) -> NDArray[np.float64]:
        """Centre of mass (n, d) of each point's cell; of one set. On the torus it may lie outside the unit box."""
        points = self._one_set("centroids")
        if points.shape[-1] == 1:
            return _core.intervals(points, self.periodic).mean(axis=1, keepdims=True)
        return _core.centroids(points, self.periodic, self._threads)

    def intervals(self) -> NDArray[np.float64]:
        """Ends (n, 2) of each point's cell, d = 1; on the torus they may lie outside [0, 1]."""
        return _core.intervals(self._one_set("intervals", 1), self.periodic)

    def polygons(self) -> list[NDArray[np.float64]]:
        """Corners (k, 2) of each point's cell, counter-clockwise, d = 2.

        On the torus a cell is not cut at the border of the square, so corners may lie outside it.
        Points that coincide each get the cell that they share.
        """
        vertices, offsets = _core.polygons(self._one_set("polygons", 2), self.periodic)
        return np.split(vertices, offsets[1:-1].astype(np.intp))

    def polyhedra(self) -> list[list[NDArray[np.float64]]]:
        """Faces of each point's cell, d = 3; each face its corners (k, 3), counter-clockwise from outside.

        On the torus a cell is not cut at the border of the cube. Points that coincide each get the
        cell that they share.
        """
        corners, begin, cells = _core.polyhedra(self._one_set("polyhedra", 3), self.periodic)
        faces = np.split(corners, begin[1:-1].astype(np.intp))
        return [faces[first:last] for first, last in itertools.pairwise(cells.tolist())]

    def _one_set(self, what: str, d: int | None = None) -> NDArray[np.float64]:
        if self._points.ndim != 2 or d not in (None, self._points.shape[-1]):
            raise ValueError(f"{what} needs one set of points (n, {d or 'd'}), got shape {self._points.shape}")
        return self._points[None]


def cells(points: ArrayLike, *, periodic: bool = False, threads: int | None = None) -> Cells:
    """Voronoi cells of points in the unit box or torus.

    Parameters
    ----------
    points : array_like, (n,), (n, d) or (sets, n, d), d = 1, 2 or 3
        Points of [0, 1]^d. Points that coincide share their cell equally.
    periodic : bool
        False: cells of the box [0, 1]^d. True: cells of the torus.
    threads : int, optional
        Number of threads; by default all processors, or what the environment variable
        VOROQUAD_NUM_THREADS says. The result does not depend on it.

    Returns
    -------
    Cells
        With ``measures`` (n,) or (sets, n), ``centroids`` (n, d), ``intervals()`` for d = 1,
        ``polygons()`` for d = 2 and ``polyhedra()`` for d = 3; each is computed when it is asked for.

    Raises
    ------
    ValueError
        A point is NaN or outside the domain, or d is not 1, 2 or 3.

    Notes
    -----
    The cell of x_i is the set of all y no farther from x_i than from any other point,
    V_i = {y : \\|y − x_i\\| ≤ \\|y − x_j\\| for all j}. It is cut out by the half-spaces
    (x_j − x_i)·(y − x_i) ≤ \\|x_j − x_i\\|²/2 of the neighbours, nearest first, until every
    corner of the cell is closer than half the distance to all points not yet seen.

    Examples
    --------
    >>> import voroquad as vq
    >>> vq.cells([0.25, 0.5, 0.75]).measures
    array([0.375, 0.25 , 0.375])
    >>> vq.cells([[0.25, 0.5], [0.75, 0.5]]).polygons()[0]
    array([[0.5, 1. ], [0. , 1. ], [0. , 0. ], [0.5, 0. ]])
    """
    array = unit_points(points, closed=not periodic)
    if array.shape[-1] > 3:
        raise ValueError(f"cells are computed for d = 1, 2 and 3, got points with d = {array.shape[-1]}")
    # A copy: what is checked here is what is cut later
    return Cells(array.copy(), bool(periodic), thread_count(threads))
