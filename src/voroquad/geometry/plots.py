"""Pictures of cells, with Matplotlib."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from .._support.arrays import Array
from .._support.checks import real_numbers
from .._support.figures import axes_for

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable

#: Where light comes from in space, and how bright a face that turns away from it is
LIGHT = np.array([0.35, -0.5, 0.79])
SHADE = 0.55
#: In space cells are drawn smaller about their centroids, so that inner faces show
SHRUNK = 0.85


class Drawable(Protocol):
    """The properties of cells that a picture needs."""

    @property
    def points(self) -> Array: ...
    @property
    def measures(self) -> Array: ...
    @property
    def centroids(self) -> Array: ...
    def intervals(self) -> Array: ...
    def _outlines(self) -> Iterable[list[Array]]: ...
    def _rim(self) -> tuple[Array, float] | None: ...
    def polyhedra(self) -> Iterable[list[Array]]: ...


def draw(cells: Drawable, values: Any, ax: Axes | None, cmap: Any) -> Axes:
    """Draw the cells of one set of points, coloured by a value for each; see :meth:`Cells.plot`."""
    points = cells.points
    if points.ndim != 2:
        raise ValueError(f"plot needs one set of points (n, d), got shape {points.shape}")
    numbers = cells.measures if values is None else real_numbers("values", values)
    if numbers.shape != points.shape[:1]:
        raise ValueError(f"values has shape {numbers.shape}; give one for each of the points, ({len(points)},)")
    d = points.shape[1]
    ax = axes_for(ax, d)
    from matplotlib.cm import ScalarMappable

    mappable = ScalarMappable(cmap=cmap)
    mappable.set_array(numbers)
    mappable.autoscale()
    (_draw_line, _draw_plane, _draw_space)[d - 1](cells, mappable, ax)
    return ax


def _draw_line(cells: Drawable, values: ScalarMappable, ax: Axes) -> None:
    colours = _colours(values)
    ends = cells.intervals()
    ax.bar(ends[:, 0], 1.0, np.diff(ends, axis=1)[:, 0], align="edge", color=colours, edgecolor="white")
    ax.plot(cells.points[:, 0], np.full(len(ends), 0.5), ".", color="black", markersize=4)
    ax.set(ylim=(0, 1), yticks=[])


def _draw_plane(cells: Drawable, values: ScalarMappable, ax: Axes) -> None:
    from matplotlib.collections import PathCollection
    from matplotlib.path import Path

    paths = [
        Path.make_compound_path(*(Path(np.concatenate([ring, ring[:1]]), closed=True) for ring in rings))
        for rings in cells._outlines()
    ]
    shapes = PathCollection(paths, cmap=values.cmap, norm=values.norm, edgecolors="white", linewidths=0.6)
    shapes.set_array(values.get_array())
    ax.add_collection(shapes)
    if (rim := cells._rim()) is not None:
        from matplotlib.patches import Circle

        edge = ax.add_patch(Circle((float(rim[0][0]), float(rim[0][1])), rim[1], fill=False, linewidth=0.6))
        shapes.set_clip_path(edge)
    ax.plot(*cells.points.T, ".", color="black", markersize=min(3, 60 / len(paths) ** 0.5))
    ax.autoscale_view()
    ax.set_aspect("equal")


def _draw_space(cells: Drawable, values: ScalarMappable, ax: Any) -> None:
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    polygons, shaded, colours = [], [], _colours(values)
    for faces, centre, colour in zip(cells.polyhedra(), cells.centroids, colours, strict=True):
        for face in faces:
            normal = np.cross(face[1:-1] - face[0], face[2:] - face[0]).sum(axis=0)
            length = float(np.linalg.norm(normal))
            towards = max(0.0, float(normal @ LIGHT) / length) if length > 0 else 0.0
            polygons.append(centre + SHRUNK * (face - centre))
            shaded.append([*(colour[:3] * (SHADE + (1 - SHADE) * towards)), colour[3]])
    ax.add_collection3d(Poly3DCollection(polygons, facecolors=shaded, edgecolors=(0, 0, 0, 0.25), linewidths=0.3))
    corners = np.concatenate(polygons)
    low, high = corners.min(axis=0), corners.max(axis=0)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    ax.set_box_aspect(high - low)


def _colours(values: ScalarMappable) -> Array:
    """Red, green, blue and opacity (n, 4) of the values."""
    return np.asarray(values.to_rgba(np.asarray(values.get_array())))
