"""The domains that quad integrates over, as those that cells fill."""

from __future__ import annotations

import numpy as np
import pytest

import voroquad as vq

CORNERS = np.array([[1.0, 2, 0], [4, 2, 1], [1, 6, 0], [2, 3, 5]])
L_SHAPE = np.array([[0.0, 0], [2, 0], [2, 1], [1, 1], [1, 3], [0, 3]])
DOMAINS = {
    "interval": vq.Ball([3.0], 2),
    "disc": vq.Ball([1.0, -2], 2),
    "polar disc": vq.PolarBall([1.0, -2], 2),
    "ball": vq.Ball([1.0, 2, 3], 0.5),
    "small ball far away": vq.Ball([1e6, 2e6, -1e6], 0.1),
    "segment": vq.Simplex([[4.0], [1.5]]),
    "triangle": vq.Triangle([[0.0, 0], [4, 0], [0, 3]]),
    "tetrahedron": vq.Simplex(CORNERS),
    "polytope": vq.Polytope(np.concatenate([CORNERS, CORNERS.mean(axis=0, keepdims=True), [[4, 4, 4]]])),
    "polytope in the plane": vq.Polytope([[0.0, 0], [2, 0], [3, 1], [2, 2], [0, 2], [1, 1]]),
    "pieces of a line": vq.Polytope([[2.0], [0.0], [1.0]], [[0, 2], [1, 2]]),
    "polygon": vq.Polygon(L_SHAPE),
}


def points_in(domain, n: int) -> np.ndarray:
    """Places (n, d) that quad draws in a domain."""
    seen = []
    vq.quad(lambda x: seen.append(x) or x[0], domain, n_points=4 * n, rng=1)
    return np.concatenate(seen, axis=1).T[:n]


@pytest.mark.parametrize("name", DOMAINS)
def test_measures_sum_to_the_volume(name):
    domain = DOMAINS[name]
    if name == "polygon":
        pytest.importorskip("shapely")
    points = points_in(domain, 40)
    measures = vq.cells(points, domain=domain).measures
    rounding = 1e-8 if "far away" in name else 1e-12
    np.testing.assert_allclose(measures.sum(), domain.volume, rtol=rounding)
    np.testing.assert_array_equal(vq.weights(points, domain=domain), measures)


def test_a_ball_is_that_of_its_bounds():
    x = 0.5 * np.random.default_rng(2).random((30, 3))
    expected = vq.cells(x, bounds=[(-1, 1), (-0.5, 1.5), (-1, 1)], domain="ball").measures
    np.testing.assert_array_equal(vq.cells(x, domain=vq.Ball([0, 0.5, 0], 1)).measures, expected)


def test_a_simplex_is_the_hull_of_its_corners():
    x = points_in(DOMAINS["tetrahedron"], 30)
    expected = vq.cells(x, domain=CORNERS)
    cells = vq.cells(x, domain=vq.Simplex(CORNERS))
    np.testing.assert_array_equal(cells.measures, expected.measures)
    np.testing.assert_array_equal(cells.neighbours().border, expected.neighbours().border)


@pytest.mark.parametrize(
    ("domain", "message"),
    [
        (vq.Ball([0, 0, 0]), "domain is a Ball with d = 3, the points have d = 2"),
        (vq.SphereSurface(), "domain is a surface; vq.sphere_weights"),
        (vq.Triangle([[0, 0, 0], [1, 0, 0], [0, 1, 1]]), r"domain is a surface in R\^3"),
        (vq.Polytope(L_SHAPE, [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]), "cells need a convex one"),
        (object(), "domain must be vertices .* vq.Ball, .* got <object"),
        (vq.ProductMeasure, "domain must be vertices"),
        (vq.Ball, "domain must be vertices"),
        (vq.Ball([1e10, 1], 1e-6), "rounding moves a border of radius 1e-06 about .*; move all to 0"),
        ({"corners": 3}, "domain must be vertices .* got {'corners': 3}"),
    ],
)
@pytest.mark.parametrize("take", [vq.cells, vq.weights])
def test_refuses_in_one_line(take, domain, message):
    with pytest.raises(ValueError, match=message) as error:
        take([[0.2, 0.3], [0.4, 0.1]], domain=domain)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("beside", [{"bounds": (-1, 1)}, {"periodic": True}])
def test_says_alone_where_cells_end(beside):
    with pytest.raises(ValueError, match="domain= says where cells end; leave out"):
        vq.cells([[0.2, 0.3], [0.4, 0.1]], domain=vq.Ball([0, 0]), **beside)


def test_density_compensation_takes_polytopes_and_names_the_rim_of_balls():
    k = 0.4 * np.random.default_rng(3).random((50, 2))
    triangle = vq.Triangle([[0, 0], [0.9, 0], [0, 0.9]])
    expected = vq.density_compensation(k, domain=triangle.vertices)
    np.testing.assert_array_equal(vq.density_compensation(k, domain=triangle), expected)
    with pytest.raises(ValueError, match="say rim='ball'"):
        vq.density_compensation(k, domain=vq.Ball([0, 0], 0.5))
    for other in (vq.Simplex(CORNERS), vq.Ball(), vq.Simplex([[-0.5], [0.5]])):
        with pytest.raises(ValueError, match=f"with d = {other.d}, the points have d = 2"):
            vq.density_compensation(k, domain=other)


def test_a_box_that_rounding_makes_square_is_none():
    with pytest.raises(ValueError, match="these sides must be equal"):
        vq.cells([[1e10, 1]], bounds=[(1e10 - 1e-6, 1e10 + 1e-6), (1 - 1e-6, 1 + 1e-6)], domain="ball")


def test_vertices_are_numbers_of_any_type():
    corners = np.array([[0, 0], [2, 0], [0, 2]], dtype=object)
    assert vq.cells([[0.2, 0.3], [0.4, 0.1]], domain=corners).measures.sum() == pytest.approx(2, rel=1e-12)
