"""Cells of every kind of domain against references that share nothing with the core.

Exact arithmetic for polygons, polytopes and lattices; discs with 60 digits; balls and cylinders by slices. Sets are
small, without general position. HYPOTHESIS_PROFILE=long draws 20 000 for each test.
"""

from __future__ import annotations

import numpy as np
import pytest
from any_domains import any_domain, pulled_in
from any_points import any_set
from curved_cells import areas_in_disc, volumes_in_round
from exact_cells import exact_areas_in_polygon, exact_measures_on_lattice, exact_measures_within
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

import voroquad as vq
from voroquad.geometry.lattice import Lattice

#: Examples of tests whose references take long
FEWER = settings(max_examples=settings.default.max_examples // 5)


def few(points: np.ndarray, most: dict[int, int]) -> np.ndarray:
    """A few points of a set, by dimension."""
    return np.random.default_rng(0).permutation(points)[: most[points.shape[1]]]


def agree(measures: np.ndarray, exact: np.ndarray, whole: float, tolerance: float = 1e-12) -> None:
    assert exact.sum() == pytest.approx(whole, rel=1e-12), "the reference"
    np.testing.assert_allclose(measures, exact, rtol=0, atol=tolerance * whole)


@st.composite
def any_whole_hull(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Points, vertices, and walls (A, b): polygons and polytopes whose vertices are whole numbers."""
    unit = draw(any_set(12).filter(lambda x: x.shape[1] > 1))
    d = unit.shape[1]
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    corners = rng.integers(-5, 6, (rng.integers(d + 1, 9), d))
    while np.linalg.matrix_rank(corners - corners[0]) < d:
        corners = rng.integers(-5, 6, (rng.integers(d + 1, 9), d))
    hull = ConvexHull(corners)
    walls = []
    for facet, outward in zip(corners[hull.simplices], hull.equations, strict=True):
        ways = facet[1:] - facet[0]
        normal = np.array([ways[0, 1], -ways[0, 0]]) if d == 2 else np.cross(*ways)
        normal = normal if normal @ outward[:-1] > 0 else -normal
        walls.append([*normal.tolist(), int(normal @ facet[0])])
    a, b = np.array(sorted({tuple(w) for w in walls}))[:, :-1], np.array(sorted({tuple(w) for w in walls}))[:, -1]
    points = pulled_in(hull.min_bound + unit * (hull.max_bound - hull.min_bound), hull)
    return few(points, {2: 12, 3: 5}), corners[hull.vertices], a, b


@given(any_whole_hull())
def test_convex_domains(case):
    points, corners, a, b = case
    for domain in (corners, (a, b)):
        cells = vq.cells(points, domain=domain)
        agree(cells.measures, exact_measures_within(cells.points, a, b), ConvexHull(corners).volume)


@given(any_domain(("polygon",), max_size=8))
def test_polygons_with_holes(case):
    shapely = pytest.importorskip("shapely")
    region = shapely.orient_polygons(case.arguments["domain"])
    parts = shapely.get_parts(region)
    rings = [shapely.get_coordinates(r)[:-1] for part in parts for r in (part.exterior, *part.interiors)]
    cells = vq.cells(few(case.points, {2: 6}), domain=region)
    agree(cells.measures, exact_areas_in_polygon(cells.points, rings), case.whole)


@FEWER
@given(any_domain(("lattice",), max_size=8))
def test_lattices(case):
    """The lattice and the points that the core is given, whose coordinates are rounded as docs/cells.md says."""
    points = few(case.points, {2: 3, 3: 2})
    cells = vq.cells(points, **case.arguments)
    reduced = Lattice(case.arguments["cell"]).reduced
    agree(cells.measures, exact_measures_on_lattice(cells.points, reduced), case.whole)


@FEWER
@given(any_domain(("ball",), max_size=8).filter(lambda case: case.points.shape[1] == 2))
def test_discs(case):
    cells = vq.cells(few(case.points, {2: 5}), **case.arguments)
    low, high = case.arguments["bounds"].T
    exact = areas_in_disc(cells.points, (low + high) / 2, float((high - low).max()) / 2)
    agree(cells.measures, exact, case.whole)


@FEWER
@given(n=st.integers(1, 5), seed=st.integers(0, 2**32), whole=st.booleans())
def test_balls(n, seed, whole):
    points = points_in_ball(np.random.default_rng(seed), n, 3, whole=whole)
    measures = vq.cells(3 + 2 * points, bounds=(1, 5), domain="ball").measures / 8
    agree(measures, volumes_in_round(points, 1.0), 4 / 3 * np.pi, 1e-11)


@FEWER
@given(n=st.integers(1, 4), seed=st.integers(0, 2**32), whole=st.booleans(), periodic=st.booleans())
def test_cylinders(n, seed, whole, periodic):
    rng = np.random.default_rng(seed)
    n = min(n, 3) if periodic else n
    points = np.column_stack([points_in_ball(rng, n, 2, whole=whole), rng.integers(-4, 4, n) / 4])
    if not whole:
        points[:, 2] = rng.uniform(-1, 1, n)
    arguments = {"bounds": (1, 5), "domain": "cylinder", "periodic": [False, False, periodic]}
    measures = vq.cells(3 + 2 * points, **arguments).measures / 8
    exact = volumes_in_round(points, 1.0, (-1.0, 1.0), 2.0 if periodic else None)
    agree(measures, exact, 2 * np.pi, 1e-11)


def points_in_ball(rng: np.random.Generator, n: int, d: int, *, whole: bool) -> np.ndarray:
    """Points of the unit ball; or quarters of whole numbers, many of which lie on one line, plane or circle."""
    points = rng.integers(-4, 5, (n, d)) / 4 if whole else rng.uniform(-1, 1, (n, d))
    return points / np.maximum(np.linalg.norm(points, axis=1, keepdims=True), 1)
