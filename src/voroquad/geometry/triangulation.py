"""The Delaunay triangulation that is dual to Voronoi cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, KDTree, QhullError

from .._support.arrays import Array, Integers

#: Corners of cells that are nearer to each other, relative to the longest side of the box, count as one,
SAME = 1e-12
#: and so do points: among those of a cluster, corners could not be told apart.
ONE_POINT = 1e-9


@dataclass(frozen=True, eq=False)
class Triangulation:
    """Triangles or tetrahedra between points whose cells meet in a corner; made by :meth:`Cells.triangulation`.

    Attributes
    ----------
    simplices : ndarray of int, (m, d + 1)
        Indices of the corners, counter-clockwise for d = 2 and with positive volume for d = 3; the lowest is first.
    shifts : ndarray of int, (m, d + 1, d)
        Number of periods by which the image of each corner is shifted along each axis, relative to the first corner.
    """

    simplices: Integers
    shifts: Integers

    def __len__(self) -> int:
        """Number of simplices."""
        return len(self.simplices)


def triangulate(
    points: Array, corners: Array, owners: Integers, origin: Array, vectors: Array, periodic: NDArray[np.bool_]
) -> Triangulation:
    """The dual of cells of points (n, d) that have corners (v, d) inside the domain, owned by cells (v,).

    The domain is spanned by vectors (d, d) from its origin, and periodic along some. Corners lie around their points,
    also outside of it.
    """
    d = points.shape[1]
    lengths = np.linalg.norm(vectors, axis=1)
    at, sites = ((places - origin) @ np.linalg.inv(vectors) for places in (corners, points))  # in periods
    period, same = np.where(periodic, lengths, 0), SAME * lengths.max()
    cluster, first = _clusters(sites * lengths, period, same * ONE_POINT / SAME)
    # Across a seam, the point that represents others is its image near them
    turns = np.where(periodic, np.floor(at), 0)
    home = at - turns
    turns -= np.where(periodic, np.round(sites - sites[first[cluster]]), 0)[owners]
    label, reference = _clusters(home * lengths, period, same)
    # For each owner, the image that has a corner at the cluster's reference
    turns += np.where(periodic, np.round(home - home[reference[label]]), 0)
    rows = np.unique(np.column_stack([label, first[cluster][owners], -turns.astype(np.int64)]), axis=0)
    size = np.bincount(rows[:, 0])
    found = [rows[size[rows[:, 0]] == d + 1][:, 1:].reshape(-1, d + 1, d + 1)]
    starts = np.cumsum(size) - size
    for k in np.flatnonzero(size > d + 1):
        group = rows[starts[k] : starts[k] + size[k], 1:]
        found.append(_pulled(group, points[group[:, 0]] + group[:, 1:] @ vectors))
    vertices = np.concatenate(found)
    simplices, shifts = vertices[..., 0], vertices[..., 1:] - vertices[:, :1, 1:]
    places = points[simplices] + shifts @ vectors
    negative = np.linalg.det(places[:, 1:] - places[:, :1]) < 0
    for array in (simplices, shifts):
        array[negative, -2:] = array[negative, :-3:-1]
    order = np.lexsort(np.concatenate([simplices, shifts.reshape(-1, (d + 1) * d)], axis=1).T[::-1])
    return Triangulation(simplices[order], shifts[order])


def _clusters(places: Array, period: Array, distance: float) -> tuple[Integers, Integers]:
    """A label (v,) for each place, the same for those that are nearer than `distance`, and a place of each label."""
    keys, first, key_of = np.unique(np.round(places / distance), axis=0, return_index=True, return_inverse=True)
    at = np.where(period > 0, np.mod(keys * distance, np.where(period > 0, period, 1)), keys * distance)
    label_of = _components(len(keys), KDTree(at, boxsize=period).query_pairs(2 * distance, output_type="ndarray"))
    return label_of[key_of.reshape(-1)], first[np.unique(label_of, return_index=True)[1]]


def _components(n: int, pairs: Integers) -> Integers:
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(n, n))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def _pulled(group: Integers, places: Array) -> Integers:
    """Simplices (m, d + 1, 1 + d) of the convex hull of images of points (k, 1 + d) on one circle or sphere.

    The pulling triangulation: from the first of them to all facets that it is not on, which are triangulated in the
    same way. So the facet between two groups is split alike for both.
    """
    if places.shape[1] == 2:
        return group[_fan(_around(places))]
    try:
        hull = ConvexHull((places - places.mean(axis=0)) / np.ptp(places, axis=0).max())
    except QhullError:  # in one plane up to rounding, in a box that is thinner than points are told apart
        return np.empty((0, 4, group.shape[1]), dtype=group.dtype)
    ways = np.column_stack([np.repeat(np.arange(len(hull.simplices)), 3), hull.neighbors.ravel()])
    flat = np.abs(hull.equations[ways[:, 0]] - hull.equations[ways[:, 1]]).max(axis=1) < 1e-6
    facet_of = _components(len(hull.simplices), ways[flat])
    tetrahedra = []
    for facet in range(facet_of.max() + 1):
        members = np.unique(hull.simplices[facet_of == facet])
        if members[0] == 0:
            continue
        normal = hull.equations[np.argmax(facet_of == facet), :3]
        plane = np.linalg.svd(normal[None])[2][1:]
        triangles = members[_fan(_around(places[members] @ plane.T))]
        tetrahedra.append(np.column_stack([np.zeros(len(triangles), dtype=np.int64), triangles]))
    return group[np.concatenate(tetrahedra)]


def _around(places: Array) -> Integers:
    """Corners (k, 2) of a convex polygon in their order around it, the first first."""
    centred = places - places.mean(axis=0)
    order = np.argsort(np.arctan2(centred[:, 1], centred[:, 0]))
    return np.roll(order, -int(np.argmin(order)))


def _fan(ring: Integers) -> Integers:
    """Triangles (k - 2, 3) from the first corner of a polygon."""
    return np.column_stack([np.full(len(ring) - 2, ring[0]), ring[1:-1], ring[2:]])
