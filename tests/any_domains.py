"""Domains of every kind, with sets of points in them that lack general position, for Hypothesis."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from any_points import any_set
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

KINDS = ["box", "convex", "half-spaces", "polygon", "ball", "cylinder", "lattice"]


@dataclass
class Case:
    """Points of a domain, the arguments of :func:`voroquad.cells` that name it, and its measure."""

    kind: str
    points: np.ndarray
    arguments: dict[str, Any]
    whole: float


@st.composite
def any_domain(draw: st.DrawFn, kinds: tuple[str, ...] = tuple(KINDS), max_size: int = 40) -> Case:
    """A domain of one of these kinds; many points are on its border, on lines and lattices, or coincide."""
    kind = draw(st.sampled_from(kinds))
    only = {"polygon": (2,), "cylinder": (3,), "box": (1, 2, 3)}.get(kind, (2, 3))
    unit = draw(any_set(max_size).filter(lambda x: x.shape[1] in only))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    case = MAKE[kind](unit, rng)
    if draw(st.booleans()) and case.arguments.get("cell") is None:
        case.points = case.points.astype(np.float32)
    return case


def box(unit: np.ndarray, rng: np.random.Generator) -> Case:
    """Sides from 1e-3 to 1e3, some axes periodic."""
    low, side = place(unit.shape[1], rng)
    periodic = rng.integers(2, size=len(low)).astype(bool)
    bounds = np.stack([low, low + side], axis=1)
    points = np.clip(low + unit * side, *bounds.T)
    volume = float(np.prod(bounds[:, 1] - bounds[:, 0]))
    return Case("box", points, {"bounds": bounds, "periodic": periodic.tolist()}, volume)


def convex(unit: np.ndarray, rng: np.random.Generator) -> Case:
    """The hull of a few random or whole points."""
    hull = random_hull(unit.shape[1], rng)
    low, high = hull.min_bound, hull.max_bound
    corners = hull.points[hull.vertices]
    return Case("convex", pulled_in(low + unit * (high - low), hull), {"domain": corners}, float(hull.volume))


def half_spaces(unit: np.ndarray, rng: np.random.Generator) -> Case:
    """The same by its walls."""
    case = convex(unit, rng)
    hull = ConvexHull(case.arguments["domain"])
    length = rng.uniform(0.1, 10, (len(hull.equations), 1))
    a, b = length * hull.equations[:, :-1], -(length * hull.equations[:, -1:])[:, 0]
    return Case("half-spaces", case.points, {"domain": (a, b)}, case.whole)


def polygon(unit: np.ndarray, rng: np.random.Generator) -> Case:
    """Blobs and squares with bays and holes, or several of them."""
    import shapely

    if rng.integers(2):
        blobs = [shapely.Point(*rng.uniform(0, 4, 2)).buffer(rng.uniform(0.5, 2), 5) for _ in range(4)]
        region = shapely.union_all(blobs[:3]).difference(blobs[3].buffer(-0.3))
    else:
        region = shapely.box(0, 0, 4, 4).difference(shapely.box(1.5, 2, 2.5, 4)).difference(shapely.box(1, 1, 2, 1.5))
    if region.area < 0.5:
        region = shapely.box(0, 0, 4, 4)
    west, south, east, north = region.bounds
    points = np.array([west, south]) + unit * [east - west, north - south]
    outside = ~shapely.intersects_xy(region, *points.T)
    nearest = shapely.get_point(shapely.shortest_line(region, shapely.points(points[outside])), 0)
    points[outside] = shapely.get_coordinates(nearest)
    return Case("polygon", points, {"domain": region}, region.area)


def ball(unit: np.ndarray, rng: np.random.Generator) -> Case:
    """A disc or ball of any size, about the origin or elsewhere."""
    d = unit.shape[1]
    centre, radius = round_place(d, rng)
    points = pulled_into_ball(2 * unit - 1) * radius + centre
    bounds = np.stack([centre - radius, centre + radius], axis=1)
    whole = math.pi * radius**2 if d == 2 else 4 / 3 * math.pi * radius**3
    return Case("ball", np.clip(points, *bounds.T), {"bounds": bounds, "domain": "ball"}, whole)


def cylinder(unit: np.ndarray, rng: np.random.Generator) -> Case:
    """Flat or long, with ends or periodic along its axis."""
    centre, radius = round_place(2, rng)
    (low,), (height,) = place(1, rng)
    across = pulled_into_ball(2 * unit[:, :2] - 1) * radius + centre
    bounds = np.array([*np.stack([centre - radius, centre + radius], axis=1), [low, low + height]])
    points = np.clip(np.column_stack([across, low + unit[:, 2] * height]), *bounds.T)
    periodic = [False, False, bool(rng.integers(2))]
    whole = math.pi * radius**2 * (bounds[2, 1] - bounds[2, 0])
    return Case("cylinder", points, {"bounds": bounds, "domain": "cylinder", "periodic": periodic}, whole)


def lattice(unit: np.ndarray, rng: np.random.Generator) -> Case:
    """Vectors of any shape, not reduced; points anywhere."""
    d = unit.shape[1]
    vectors = rng.normal(size=(d, d))
    while abs(np.linalg.det(vectors)) < 0.1 * np.prod(np.linalg.norm(vectors, axis=1)):
        vectors = rng.normal(size=(d, d))
    if rng.integers(2):
        vectors = np.eye(d) + np.triu(rng.integers(-2, 3, (d, d)) / 2, 1)  # hexagonal, or cubes that are sheared
    points = (unit + rng.integers(-1, 2, unit.shape)) @ vectors
    return Case("lattice", points, {"cell": vectors}, float(abs(np.linalg.det(vectors))))


MAKE = {
    "box": box,
    "convex": convex,
    "half-spaces": half_spaces,
    "polygon": polygon,
    "ball": ball,
    "cylinder": cylinder,
    "lattice": lattice,
}


def place(d: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """The lower end of the sides of a box, and their lengths."""
    sides = 10.0 ** rng.integers(-3, 4, d) * np.where(rng.integers(2, size=d), 1, rng.random(d) + 0.1)
    return sides * rng.choice([0.0, -0.5, -1.0, 7.3], d), sides


def round_place(d: int, rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """Centre and radius of a disc or ball; often of whole numbers."""
    radius = float(10.0 ** rng.integers(-3, 4) * rng.choice([1.0, 0.37]))
    return radius * rng.choice([0.0, 1.0, 2.6], d), radius


def pulled_into_ball(points: np.ndarray) -> np.ndarray:
    """Points of the cube [−1, 1]^d; those outside the ball go to its border."""
    distance = np.linalg.norm(points, axis=1, keepdims=True)
    return points / np.maximum(distance, 1)


def pulled_in(points: np.ndarray, hull: ConvexHull) -> np.ndarray:
    """Points in a hull; those outside go to its border, along the way to its middle."""
    middle = hull.points[hull.vertices].mean(axis=0)
    normals, offsets = hull.equations[:, :-1], -hull.equations[:, -1]
    share = ((points - middle) @ normals.T / (offsets - normals @ middle)).max(axis=1, keepdims=True)
    return np.where(share > 1, middle + (points - middle) / np.maximum(share, 1), points)


def random_hull(d: int, rng: np.random.Generator) -> ConvexHull:
    """Of random points, or of whole ones, so that walls are parallel, along the axes, or meet in fours."""
    while True:
        if rng.integers(2):
            points = rng.normal(size=(rng.integers(d + 1, 12), d)) * rng.uniform(0.3, 3, d) + rng.normal(size=d)
        else:
            points = rng.integers(-2, 3, (rng.integers(d + 1, 12), d)).astype(float)
        if np.linalg.matrix_rank(points - points[0]) == d:
            return ConvexHull(points)
