"""Weights on tori and lattices, in polygons, polytopes, balls and cylinders."""

from __future__ import annotations

import numpy as np
import pytest

import voroquad as vq

LATTICE = np.array([(1.0, 0.3), (0.4, 0.8)])
TRIANGLE = [(0, 0), (2, 0), (0, 2)]
OBLONG = [(0, 2), (0, 1)]


def f(periods: np.ndarray) -> np.ndarray:
    """Of places in periods: neither periodic nor symmetric, with a jump; its mean is (e − 1)^d + 0.05."""
    return np.exp(periods.sum(axis=-1)) + (periods[..., 0] < 0.05)


@pytest.mark.parametrize(
    ("place", "whole"),
    [
        ({"periodic": True}, 1),
        ({"periodic": [False, True], "bounds": OBLONG}, 2),
        ({"domain": TRIANGLE}, 2),
        ({"domain": ([[1, 1], [-1, 0], [0, -1]], [2, 0, 0])}, 2),
        ({"domain": "ball", "bounds": (-1, 1)}, np.pi),
        ({"cell": LATTICE}, 0.68),
    ],
)
def test_order_0_has_the_measures_of_cells(place, whole):
    points = 0.7 * np.random.default_rng(1).random((2, 30, 2))
    w = vq.weights(points, **place)
    np.testing.assert_array_equal(w, vq.cells(points, **place).measures)
    np.testing.assert_allclose(w.sum(axis=1), whole, rtol=1e-12)
    np.testing.assert_array_equal(vq.weights(points[0], order="auto", design="sobol", **place), w[0])


def test_order_0_in_a_cylinder_and_a_polygon():
    pytest.importorskip("shapely")
    in_space = np.random.default_rng(2).uniform(-0.5, 0.5, (30, 3))
    cylinder = {"domain": "cylinder", "bounds": (-1, 1), "periodic": [False, False, True]}
    np.testing.assert_array_equal(vq.weights(in_space, **cylinder), vq.cells(in_space, **cylinder).measures)
    frame = vq.Polygon([[0, 0], [3, 0], [3, 3], [0, 3]], holes=[[[1, 1], [2, 1], [2, 2], [1, 2]]])
    assert vq.weights([[0.5, 0.5], [2.5, 2.5]], domain=frame).tolist() == pytest.approx([4, 4])


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("place", "d", "n"),
    [
        ({"periodic": True}, 1, 7),
        ({"periodic": True, "bounds": OBLONG}, 2, 12),
        ({"cell": LATTICE}, 2, 6),
        ({"periodic": True}, 3, 12),
    ],
)
def test_uniform_points_are_weighed_without_bias_where_nothing_ends(z_score, place, d, n):
    sets = 2_000 if "cell" in place else 20_000
    periods = np.random.default_rng(5).random((sets, n, d))
    low, side = (0, [2, 1]) if "bounds" in place else (0, 1)
    points = periods @ LATTICE if "cell" in place else low + side * periods
    whole = 0.68 if "cell" in place else np.prod(side)
    truth = whole * ((np.e - 1) ** d + 0.05)
    w = vq.weights(points, debias="auto", design="uniform", **place)
    values = f(periods)
    assert abs(z_score((w * values).sum(axis=1), truth)) < 5.5
    if "cell" in place:  # the control: the cell of the lattice taken for a domain with a border
        border = np.array([(0, 0), LATTICE[0], LATTICE[1], LATTICE.sum(axis=0)])
        bounded = vq.weights(points, domain=border)
    else:
        bounded = vq.weights(points, bounds=place.get("bounds"))
    assert abs(z_score((bounded * values).sum(axis=1), truth)) > 8


@pytest.mark.statistical
def test_one_point_in_each_arc_of_a_circle_is_weighed_without_bias(z_score):
    periods = vq.sample("stratified", 9, 1, sets=20_000, rng=4).points
    circle = {"bounds": (0, 2 * np.pi), "periodic": True}
    w = vq.weights(2 * np.pi * periods, design="stratified", debias="auto", **circle)
    truth = 2 * np.pi * (np.e - 0.95)
    assert abs(z_score((w * f(periods)).sum(axis=1), truth)) < 5.5
    bounded = vq.weights(2 * np.pi * periods, bounds=circle["bounds"])
    assert abs(z_score((bounded * f(periods)).sum(axis=1), truth)) > 20


@pytest.mark.statistical
def test_one_point_in_each_square_of_the_torus_is_not(z_score):
    """Why that design is refused: the mean area of a cell depends on where in its square a point lies."""
    points = vq.sample("stratified", 9, 2, sets=40_000, rng=4).points
    centre = (np.abs(points * 3 % 1 - 0.5) < 0.25).all(axis=-1)
    assert abs(z_score((vq.weights(points, periodic=True) * centre).sum(axis=1), 0.25)) > 5.5
    with pytest.raises(ValueError, match="no rule on a torus"):
        vq.weights(points, periodic=True, debias="auto", design="stratified")


def test_sample_sets_bring_their_design():
    s = vq.sample("uniform", 20, 2, rng=1)
    w = vq.weights(s, periodic=True, debias="auto")
    np.testing.assert_array_equal(w, vq.cells(s.points, periodic=True).measures)
    with pytest.raises(ValueError, match="design='sobol' contradicts the set's own design 'uniform'"):
        vq.weights(s, periodic=True, design="sobol")


@pytest.mark.parametrize("n", [1, 2, 200])
def test_above_three_dimensions_probes_wrap(n):
    x = np.random.default_rng(3).random((n, 4))
    box = [(0, 1), (-500, 500), (0, 1), (0, 1)]
    points = x * [1, 1000, 1, 1] - [0, 500, 0, 0]
    w = vq.weights(points[None], bounds=box, periodic=[False, True, False, False])[0]
    assert w.sum() == pytest.approx(1000, rel=1e-12)
    slabs = vq.weights(points[:, 1], bounds=box[1], periodic=True)
    np.testing.assert_allclose(w, slabs, atol=6)  # cells are slabs along the long axis, counted by probes
    if n == 2:  # half the circle each, wherever they are
        assert abs(vq.weights(points[None], bounds=box)[0] - slabs).max() > 100
    one = vq.weights([[1.0, 0.0, 0.2, 0.3]] * 5, periodic=True)
    np.testing.assert_allclose(one, 0.2)


@pytest.mark.parametrize(
    ("place", "options", "message"),
    [
        ({"periodic": True}, {"order": 2}, r"no rule on a torus \(periodic=True\) for order=2.*debias='none' with"),
        ({"periodic": True}, {"debias": "leave-one-out", "design": "uniform"}, "no rule on a torus .* nothing ends"),
        ({"periodic": True}, {"debias": "auto"}, "no rule on a torus .* design 'unknown'"),
        ({"periodic": True}, {"debias": "magic"}, "unknown debias 'magic'"),
        ({"periodic": True}, {"design": "magic"}, "unknown design 'magic'"),
        ({"periodic": True}, {"order": 9}, "order must be a whole number from 0 to 8"),
        ({"periodic": [True, False]}, {"debias": "auto", "design": "uniform"}, "no rule in a box with some periodic"),
        ({"periodic": "x"}, {}, "periodic must be True, False or one of them"),
        ({"periodic": None}, {}, "periodic must be True, False or one of them"),
        ({"cell": np.eye(2)}, {"debias": "auto", "design": "sobol"}, r"no rule on a lattice \(cell=\)"),
        ({"domain": TRIANGLE}, {"debias": "auto", "design": "uniform"}, "biased near the border.*quad, which maps"),
        ({"domain": TRIANGLE, "bounds": (0, 1)}, {}, "domain= says where cells end; leave out bounds="),
    ],
)
def test_what_has_no_rule_is_refused_with_what_there_is(place, options, message):
    with pytest.raises(ValueError, match=message) as error:
        vq.weights([[0.1, 0.2], [0.3, 0.4]], **place, **options)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("place", [{"cell": np.eye(2)}, {"domain": TRIANGLE}, {"periodic": True, "bounds": (0, 2)}])
def test_sample_sets_of_the_unit_box_are_refused_elsewhere(place):
    with pytest.raises(ValueError, match="are of the unit box; "):
        vq.weights(vq.sample("uniform", 4, 2, rng=1), **place)


@pytest.mark.parametrize("place", [{"cell": np.eye(4)}, {"domain": np.eye(4)}])
def test_other_domains_have_up_to_three_dimensions(place):
    with pytest.raises(ValueError, match="domain= and cell= need points with d = 1 to 3, got d = 4"):
        vq.weights(np.full((5, 4), 0.5), **place)
    with pytest.raises(ValueError, match=r"may be \(n, d\) or \(d, n\)"):
        vq.weights(np.full((1, 3), 0.5), periodic=True)


def test_a_stratum_that_holds_two_points_is_found():
    with pytest.raises(ValueError, match="each of the 2 strata must hold one point"):
        vq.weights([0.5, 0.7], bounds=(0, 4), periodic=True, design="stratified", debias="auto")
    with pytest.raises(ValueError, match="each of the 2 strata must hold one point"):
        vq.weights([-3.5, 0.7], cell=[[4]], design="stratified", debias="auto")


def test_sample_sets_of_few_points_are_not_transposed():
    few = vq.sample("uniform", n=2, d=3, rng=1)
    np.testing.assert_array_equal(vq.weights(few, periodic=True), vq.cells(few.points, periodic=True).measures)
    strata = vq.sample("stratified", n=1, d=2, rng=1)
    assert vq.weights(strata, periodic=True).tolist() == [1.0]
    with pytest.raises(ValueError, match="cell has 3 lattice vectors, the points have d = 2"):
        vq.weights([[0.1, 0.2], [0.3, 0.4]], cell=np.eye(3), design="uniform")
