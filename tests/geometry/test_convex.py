"""Cells in convex polygons and polytopes: Qhull with mirrored points, and what holds for any set."""

from __future__ import annotations

import numpy as np
import pytest
from any_points import any_set
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, Voronoi

import voroquad as vq

CORNER = [np.array([(0.0, 0), (1, 0), (0, 1)]), np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])]


def random_hull(rng: np.random.Generator, d: int) -> ConvexHull:
    points = rng.normal(size=(rng.integers(d + 1, 12), d)) * rng.uniform(0.3, 3, d) + rng.normal(size=d)
    return ConvexHull(points)


def points_in(rng: np.random.Generator, hull: ConvexHull, n: int) -> np.ndarray:
    corners = hull.points[hull.vertices]
    return rng.dirichlet(np.ones(len(corners)), n) @ corners


def mirrored_measures(points: np.ndarray, hull: ConvexHull) -> np.ndarray:
    """By Qhull: the bisector of a point and its mirror image in a wall is the wall."""
    equations = np.unique(hull.equations.round(12), axis=0)
    images = [points, *(points - 2 * (points @ e[:-1] + e[-1])[:, None] * e[:-1] for e in equations)]
    diagram = Voronoi(np.concatenate(images))
    regions = (diagram.regions[diagram.point_region[i]] for i in range(len(points)))
    return np.array([ConvexHull(diagram.vertices[region]).volume for region in regions])


@given(d=st.integers(2, 3), n=st.integers(1, 40), seed=st.integers(0, 2**32))
def test_equals_qhull(d, n, seed):
    rng = np.random.default_rng(seed)
    hull = random_hull(rng, d)
    points = points_in(rng, hull, n)
    vertices = vq.cells(points, domain=hull.points[hull.vertices])
    np.testing.assert_allclose(vertices.measures, mirrored_measures(points, hull), rtol=0, atol=1e-10 * hull.volume)
    assert vertices.measures.sum() == pytest.approx(hull.volume, rel=1e-12)
    half_spaces = vq.cells(points, domain=(3 * hull.equations[:, :-1], -3 * hull.equations[:, -1]))
    np.testing.assert_allclose(half_spaces.measures, vertices.measures, rtol=0, atol=1e-12 * hull.volume)


@given(points=any_set().filter(lambda x: x.shape[1] > 1))
def test_of_any_set_fill_the_corner_of_a_cube(points):
    d = points.shape[1]
    total = points.sum(axis=1, keepdims=True)
    points = np.where(total > 1, points / np.maximum(total, 1), points)
    cells = vq.cells(points, domain=CORNER[d - 2])
    measures = cells.measures
    assert (measures >= 0).all()
    assert measures.sum() == pytest.approx(0.5 if d == 2 else 1 / 6, abs=1e-12)
    np.testing.assert_allclose(measures @ cells.centroids, measures.sum() / (d + 1), atol=1e-12)
    surface = 2 + 2**0.5 if d == 2 else 1.5 + 3**0.5 / 2
    near = cells.neighbours()
    if not (near.distances < 1e-6).any():  # else points may lie within a rounding of a wall, in any order
        assert near.border.sum() == pytest.approx(surface, abs=1e-10)


def test_corners_of_half_spaces_that_meet_at_a_small_angle_are_inside():
    """Rounding moves the vertices that Qhull finds there by many roundings of their coordinates."""
    corners = np.array([(-1.0, -2, 1), (-2, 0, -1), (2, 2, -2), (-2, 1, -2)])
    walls = ConvexHull(corners).equations
    assert (walls[:, :-1] @ walls[:, :-1].T).min() < -0.999
    for scale in np.random.default_rng(1).uniform(0.1, 10, (20, len(walls), 1)):
        cells = vq.cells(corners, domain=(scale * walls[:, :-1], -scale[:, 0] * walls[:, -1]))
        assert cells.measures.sum() == pytest.approx(ConvexHull(corners).volume, rel=1e-12)
    with pytest.raises(ValueError, match=r"points\[0\] = .* is outside the domain"):
        vq.cells(corners + np.array([0, 1e-12, 0]), domain=(walls[:, :-1], -walls[:, -1]))


def test_shapes_and_neighbours_end_at_walls():
    points = [[0.5, 0.25], [0.5, 1.0]]
    cells = vq.cells(points, domain=[(0, 0), (2, 0), (0, 2)])
    np.testing.assert_allclose(sorted(cells.polygon(1).tolist()), [[0, 0.625], [0, 2], [1.375, 0.625]], atol=1e-15)
    near = cells.neighbours()
    np.testing.assert_allclose(near.measures, 1.375)
    np.testing.assert_allclose(near.surfaces[1], 2 * 1.375 + 1.375 * 2**0.5)
    np.testing.assert_allclose(cells.bounds, [(0, 2), (0, 2)])


def test_a_polytope_has_faces_on_its_walls():
    cells = vq.cells([[0.1, 0.1, 0.1]], domain=CORNER[1])
    faces = cells.polyhedron(0)
    areas = sorted(np.linalg.norm(np.cross(f[1:-1] - f[0], f[2:] - f[0]).sum(axis=0)) / 2 for f in faces)
    np.testing.assert_allclose(areas, [0.5, 0.5, 0.5, 3**0.5 / 2])
    on_wall = vq.cells([[0.0, 0.0, 0.0], [0.25, 0.25, 0.5]], domain=CORNER[1])
    assert on_wall.measures.sum() == pytest.approx(1 / 6, abs=1e-15)


def test_rounded_points_beyond_sharp_edges_count_as_on_them():
    """The first point is on an edge whose walls are at a sharp angle, but for single precision."""
    corners = [(-2, -2, -1), (1, -2, 1), (-1, -1, -2), (-1, -1, 1), (2, 0, -1), (0, 0, 0), (0, 1, -2), (-2, 2, -1)]
    points = np.float32([(1.254902, -1.4901961, 0.49019608), (0.2112958, -0.72178715, -1.4204613)])
    cells = vq.cells(points, domain=corners)
    np.testing.assert_allclose(cells.measures.sum(), 79 / 6, rtol=1e-14)
    np.testing.assert_allclose(cells.points, points, rtol=0, atol=1e-6)
    again = vq.cells(cells.points, domain=corners)  # in double precision these are in the domain
    np.testing.assert_allclose(again.measures, cells.measures, rtol=1e-13)


def test_takes_batches_and_other_units():
    rng = np.random.default_rng(2)
    hull = ConvexHull(rng.normal(size=(8, 2)))
    batch = points_in(rng, hull, 60).reshape(3, 20, 2)
    corners = hull.points[hull.vertices]
    measures = vq.cells(batch, domain=corners).measures
    np.testing.assert_array_equal(measures, [vq.cells(x, domain=corners).measures for x in batch])
    far = vq.cells(1e3 * batch[0] + 1e6, domain=1e3 * corners + 1e6).measures
    np.testing.assert_allclose(far, 1e6 * measures[0], rtol=1e-7)


def test_the_triangulation_has_circumcentres_inside():
    points = [[0.1, 0.6], [0.6, 0.1], [0.25, 0.25]]  # on a circle about a place near (0.6, 0.6)
    assert len(vq.cells(points, domain=CORNER[0]).triangulation()) == 0
    assert len(vq.cells(points).triangulation()) == 1


@pytest.mark.parametrize(
    ("domain", "message"),
    [
        ([(0, 0), (1, 1)], "domain has no area; give three vertices or more"),
        ([(0, 0), (1, 1), (2, 2)], "domain has no area"),
        ([(0, 0), (4, 0), (0, 4), (1, 1)], r"domain\[3\] = \[1.0, 1.0\] is inside the convex hull of the others"),
        ([(0, 0), (1, np.nan), (0, 1)], "domain has vertices that are not finite"),
        ([(0, 0, 0), (1, 0, 0)], r"domain has vertices of shape \(2, 3\), the points need \(k, 2\)"),
        ((np.eye(2), np.ones(2)), r"domain=\(A, b\) is not bounded"),
        (([[1, 0], [0, 1], [0, -1]], [1, 1, 0]), r"domain=\(A, b\) is not bounded"),
        (([[1, 0], [-1, 0]], [1, 1]), r"domain=\(A, b\) is not bounded"),
        ((np.concatenate([np.eye(2), -np.eye(2)]), -np.ones(4)), r"domain=\(A, b\) is empty"),
        (([[1, 0], [0, 0]], [1, 1]), "needs a finite normal"),
        ((np.eye(3), np.ones(3)), r"has shapes \(3, 3\) and \(3,\)"),
        ([(0, 0), (0.1, 0), (0, 0.1)], r"points\[0\] = \[0.2, 0.2\] is not inside"),
        ([(0, 0), (0.3, 0), (0, 0.3)], r"points\[0\] = \[0.2, 0.2\] is outside the domain; drop the point"),
        (3, "domain has vertices of shape"),
        ("disc", "unknown domain 'disc'; choose one of ball, cylinder"),
    ],
)
def test_refuses(domain, message):
    with pytest.raises(ValueError, match=message):
        vq.cells([[0.2, 0.2]], domain=domain)


@pytest.mark.parametrize("other", [{"bounds": (0, 1)}, {"periodic": True}])
def test_refuses_two_answers_to_where_cells_end(other):
    with pytest.raises(ValueError, match=rf"domain= says where cells end; leave out {next(iter(other))}="):
        vq.cells([[0.2, 0.2]], domain=CORNER[0], **other)
