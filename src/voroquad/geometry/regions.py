"""Polygons with holes as domains, by Shapely."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._support.arrays import Array
from .._support.checks import point_array
from .._support.extras import install_hint
from .bounds import Bounds, type_of
from .diagram import Cells
from .neighbours import Neighbours
from .shapes import Polygons
from .triangulation import Triangulation

if TYPE_CHECKING:
    import shapely

Region: TypeAlias = "shapely.Polygon | shapely.MultiPolygon"

#: How far outside a polygon a point may lie, relative to its coordinates, and still count as on its border
ON_BORDER = 1e-14
#: A shared face smaller than this part of the perimeter of either cell is none
SMALL = 1e-12
#: The largest coordinate of a polygon, at most, and of its larger extent at least the inverse
LARGEST = 1e70


def is_region(domain: Any) -> bool:
    """Whether a domain is a geometry of Shapely, GeoPandas or another package with ``__geo_interface__``."""
    return hasattr(domain, "__geo_interface__") or (isinstance(domain, dict) and "type" in domain)


def region_of(domain: Any) -> Region:
    """A polygon or multipolygon from anything with ``__geo_interface__``; the union of a collection's."""
    try:
        import shapely
    except ImportError as error:
        raise ImportError(f"polygons as domains need Shapely; {install_hint('geo')}") from error
    if isinstance(domain, shapely.Geometry):
        region = cast("Region", domain)
    else:
        shapes = _shapes(domain)
        for part in shapes:
            _refuse_invalid(part)
        region = cast("Region", shapely.union_all(shapes))
    _refuse_invalid(region)
    if region.geom_type not in ("Polygon", "MultiPolygon") or region.area == 0:
        raise ValueError(f"domain is a {region.geom_type} of area {region.area:g}; give a polygon or a multipolygon")
    _refuse_out_of_range(region)
    return region


def _refuse_out_of_range(region: Region) -> None:
    """GEOS multiplies coordinates, and forms squares of such products."""
    west, south, east, north = region.bounds
    if max(map(abs, region.bounds)) > LARGEST or max(east - west, north - south) < 1 / LARGEST:
        raise ValueError(f"domain has coordinates beyond {LARGEST:g}, or sides below {1 / LARGEST:g}; change the unit")


def _refuse_invalid(geometry: shapely.Geometry) -> None:
    import shapely

    if not shapely.is_valid(geometry):
        raise ValueError(f"domain is not valid: {shapely.is_valid_reason(geometry)}; shapely.make_valid repairs it")


def _shapes(domain: Any) -> list[shapely.Geometry]:
    """The geometries of a GeoJSON object or anything with ``__geo_interface__``, without those that are null."""
    import shapely
    from shapely.geometry import shape

    try:
        given = domain if isinstance(domain, dict) else domain.__geo_interface__
        members = {"FeatureCollection": "features", "GeometryCollection": "geometries"}.get(given["type"])
        parts = [part for part in (given[members] if members else [given]) if part is not None]
        geometries = [part.get("geometry", part) for part in parts]  # of features
        shapes: list[shapely.Geometry] = [shape(geometry) for geometry in geometries if geometry is not None]
    except (AttributeError, IndexError, KeyError, TypeError, ValueError, shapely.errors.ShapelyError) as error:
        kind = domain.get("type") if isinstance(domain, dict) else type(domain).__name__
        raise ValueError(f"domain of type {kind!r} is no valid GeoJSON; give a polygon or a multipolygon") from error
    if not shapes:
        raise ValueError("domain has no geometry that is not null; give a polygon or a multipolygon")
    return shapes


class RegionCells(Cells):
    """The parts of cells inside a polygon with holes.

    Distances are Euclidean, also across holes and bays, so a cell may consist of several pieces.
    """

    def __init__(self, points: ArrayLike, region: Region, threads: int):
        import shapely

        given = point_array(points)
        if given.shape[-1] != 2:
            raise ValueError(f"a polygon as domain needs points (n, 2) or (sets, n, 2), got shape {given.shape}")
        west, south, east, north = region.bounds
        box = Bounds(2, [(west, east), (south, north)])
        shapely.prepare(region)
        inside = _drawn_in(given, region, type_of(points))
        super().__init__(box.to_core(np.clip(inside, *box.sides.T)), box, threads)
        self._region = region
        self._pieces: NDArray[np.object_] | None = None

    def geometries(self) -> NDArray[np.object_]:
        """The cells (n,) as geometries of Shapely: polygons, or several where the domain cuts a cell into pieces."""
        import shapely

        self._one_set("geometries")
        if self._pieces is None:
            whole = super().geometries()
            inner = shapely.contains_properly(self._region, whole)
            pieces = whole.copy()
            pieces[~inner] = _areas(shapely.intersection(whole[~inner], self._region))
            self._pieces = pieces
        return self._pieces

    def _measure(self) -> Array:
        import shapely

        if self._points.ndim == 3:
            sets = self._bounds.from_core(self._points)
            return np.array([RegionCells(points, self._region, self._threads).measures for points in sets])
        _, first, counts = np.unique(self._points, axis=0, return_inverse=True, return_counts=True)
        return np.asarray(shapely.area(self.geometries()) / counts[first.reshape(-1)])

    def _find_centroids(self) -> Array:
        import shapely

        centroids = shapely.get_coordinates(shapely.centroid(self.geometries()))
        if len(centroids) != len(self._points):
            raise ValueError("centroids: a cell has no area in the domain; drop points that coincide with the border")
        return np.asarray(centroids)

    def polygons(self) -> Polygons:
        """Raises ValueError, since cells may consist of several pieces."""
        self._refuse("polygons")

    def triangulation(self) -> Triangulation:
        """Raises ValueError, since cells may consist of several pieces."""
        self._refuse("triangulation")

    def _locate(self, places: NDArray[Any]) -> NDArray[Any]:
        inside = _drawn_in(point_array(places, name="x"), self._region, type_of(places), "x")
        return super()._locate(np.clip(inside, *self._bounds.sides.T))

    def _outlines(self) -> Iterable[list[Array]]:
        import shapely

        for pieces in self.geometries():
            parts = [part for part in shapely.get_parts(pieces) if part.geom_type == "Polygon"]
            rings = [ring for part in parts for ring in (part.exterior, *part.interiors)]
            yield [shapely.get_coordinates(ring)[:-1] for ring in rings] or [shapely.get_coordinates(pieces)[:1]]

    def _find_neighbours(self) -> Neighbours:
        import shapely

        near = super()._find_neighbours()
        rows = near.rows
        ends = _faces(self.points, near, self.bounds)
        once = np.flatnonzero(rows < near.indices)
        lines = shapely.intersection(shapely.linestrings(ends[once]), self._region)
        found = np.asarray(shapely.length(lines)).tolist()
        length = dict(zip(zip(rows[once], near.indices[once], strict=True), found, strict=True))
        pairs = zip(np.minimum(rows, near.indices), np.maximum(rows, near.indices), strict=True)
        measures = np.array([length[pair] for pair in pairs], dtype=np.float64)
        around = np.asarray(shapely.length(self.geometries()))
        kept = measures > SMALL * np.minimum(around[rows], around[near.indices])
        count = np.bincount(rows[kept], minlength=len(near))
        first = np.unique(self._points, axis=0, return_index=True)[1]  # of coinciding points, which has the entries
        border = np.zeros(len(near))
        border[first] = (around - np.bincount(rows[kept], measures[kept], len(near)))[first]
        return Neighbours(
            np.concatenate([[0], np.cumsum(count)]),
            near.indices[kept],
            measures[kept],
            near.distances[kept],
            near.shifts[kept],
            np.maximum(border, 0.0),
        )

    def _refuse(self, what: str) -> NoReturn:
        raise ValueError(
            f"cells in a polygon may consist of several pieces and have no {what}; use geometries(), or for a "
            "convex polygon give its vertices (k, 2)"
        )


def _drawn_in(points: Array, region: Region, dtype: np.dtype[Any], name: str = "points") -> Array:
    """Points (..., 2), with those that rounding has put outside the polygon on its border; others are refused."""
    import shapely

    inside = points.reshape(-1, 2).copy()
    epsilon = float(np.finfo(dtype).eps)
    outside = np.flatnonzero(~shapely.intersects_xy(region, *inside.T))
    far: NDArray[np.bool_] = np.asarray(~np.isfinite(inside[outside]).all(axis=1))
    towards = shapely.shortest_line(region, shapely.points(np.where(far[:, None], 0.0, inside[outside])))
    far = far | (shapely.length(towards) > max(ON_BORDER, epsilon) * np.abs(region.bounds).max())
    if far.any():
        first = np.unravel_index(outside[far.argmax()], points.shape[:-1])
        index = int(first[0]) if len(first) == 1 else tuple(map(int, first))
        raise ValueError(f"{name}[{index}] = {points[first].tolist()} is outside the polygon; drop it")
    inside[outside] = shapely.get_coordinates(shapely.get_point(towards, 0))
    return inside.reshape(points.shape)


def _faces(points: Array, near: Neighbours, bounds: Array) -> Array:
    """The ends (m, 2, 2) of the faces that cells share in a box: what the other faces leave of the line halfway."""
    ends = np.empty((len(near.indices), 2, 2))
    low, high = bounds.T
    walls = np.concatenate([np.eye(2), -np.eye(2)])
    for i, point in enumerate(points):
        entries = slice(int(near.indptr[i]), int(near.indptr[i + 1]))
        way = points[near.indices[entries]] - point
        length = np.linalg.norm(way, axis=1)
        normals = np.concatenate([way / length[:, None], walls])  # of half-planes n·y ≤ h, y relative to the point
        heights = np.concatenate([length / 2, high - point, point - low])
        for k in range(len(way)):
            along = np.array([-normals[k, 1], normals[k, 0]])
            slope = normals @ along
            room = heights - heights[k] * (normals @ normals[k])
            crosses = np.abs(slope) > 1e-15
            crosses[k] = False
            at = room[crosses] / slope[crosses]
            until = at[slope[crosses] > 0].min(initial=np.inf)
            since = at[slope[crosses] < 0].max(initial=-np.inf)
            middle = point + heights[k] * normals[k]
            ends[entries.start + k] = middle + np.array([[since], [max(since, until)]]) * along
    return ends


def _areas(parts: Any) -> NDArray[np.object_]:
    """The parts of each geometry that have an area, since a cell may also touch the domain in points and lines."""
    import shapely

    parts = np.asarray(parts, dtype=object)
    for i in np.flatnonzero(shapely.get_type_id(parts) == shapely.GeometryType.GEOMETRYCOLLECTION):
        pieces = shapely.get_parts(parts[i])
        parts[i] = shapely.union_all(pieces[shapely.area(pieces) > 0])
    return parts
