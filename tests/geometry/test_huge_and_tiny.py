"""Domains of any size in floating point: the cells of the same domain in another unit, or one line that refuses."""

from __future__ import annotations

import functools
import importlib.util

import numpy as np
import pytest

import voroquad as vq
from voroquad.integrals.corners import near_one

#: Exponents of ten of the unit. In some, products of coordinates or squares of volumes overflow or vanish
UNITS = (-307, -160, -110, -80, -30, -12, -9, 9, 30, 60, 80, 110, 160, 307)


def corner(d: int, unit: float) -> np.ndarray:
    """Vertices (d + 1, d) of a corner of a cube."""
    return unit * np.vstack([np.zeros(d), np.eye(d)])


def half_spaces(d: int, unit: float) -> tuple[np.ndarray, np.ndarray]:
    """The same as half-spaces."""
    return np.vstack([np.ones(d), -np.eye(d)]), np.concatenate([[unit], np.zeros(d)])


def bent(unit: float) -> np.ndarray:
    """Corners (5, 2) of a polygon that is not convex."""
    return unit * np.array([(0, 0), (1, 0), (1, 1), (0.5, 0.5), (0, 1)])


KINDS = {
    "bounds": lambda d, unit: {"bounds": (0.0, unit)},
    "bounds about 0": lambda d, unit: {"bounds": (-unit, unit)},
    "torus": lambda d, unit: {"bounds": (0.0, unit), "periodic": True},
    "lattice": lambda d, unit: {"cell": unit * np.eye(d)},
    "ball": lambda d, unit: {"domain": vq.Ball(np.zeros(d), unit)},
    "simplex": lambda d, unit: {"domain": vq.Simplex(corner(d, unit))},
    "polytope": lambda d, unit: {"domain": vq.Polytope(corner(d, unit))},
    "polytope about 0": lambda d, unit: {"domain": vq.Polytope(np.vstack([corner(d, unit), -corner(d, unit)]))},
}
CONVEX = {
    "disc or ball": lambda d, unit: {"bounds": (-unit, unit), "domain": "ball"},
    "vertices": lambda d, unit: {"domain": corner(d, unit)},
    "half-spaces": lambda d, unit: {"domain": half_spaces(d, unit)},
    "scaled half-spaces": lambda d, unit: {"domain": (half_spaces(d, 1.0)[0] / unit, half_spaces(d, 1.0)[1])},
}
PLANE = {
    "polygon": lambda d, unit: {"domain": vq.Polygon(bent(unit))},
    "polygon about 0": lambda d, unit: {"domain": vq.Polygon(unit * np.array([(-1, -1), (1, -1), (0, 1)]))},
}
SHAPES = [(name, d, kind) for name, kind in KINDS.items() for d in (1, 2, 3)]
SHAPES += [(name, d, kind) for name, kind in CONVEX.items() for d in (2, 3)]
SHAPES += [(name, 2, kind) for name, kind in PLANE.items()]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("name", "d", "kind"), SHAPES, ids=[f"{name}, d = {d}" for name, d, _ in SHAPES])
def test_cells_in_another_unit(name, d, kind):
    if "polygon" in name and not importlib.util.find_spec("shapely"):
        pytest.skip("needs Shapely")
    points = np.random.default_rng(3).random((6, d)) / (2 * d)
    expected = vq.cells(points, **kind(d, 1.0)).measures
    for exponent in UNITS:
        unit = 10.0**exponent
        cut = functools.partial(lambda unit: vq.cells(unit * points, **kind(d, unit)).measures, unit)
        if abs(exponent) < 80:
            np.testing.assert_allclose(cut() / unit**d, expected, rtol=1e-12)
            continue
        try:
            measures, refusal = cut(), ""
        except ValueError as error:
            measures, refusal = None, str(error)
        if measures is None:
            assert "unit" in refusal
            assert "\n" not in refusal
        else:
            np.testing.assert_allclose(measures / unit**d, expected, rtol=1e-12)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: vq.Simplex([[-1.7e308], [1.7e308]]), "vertices: the volume is not a normal number, got .*; change"),
        (lambda: vq.Simplex(corner(3, 1e150)), "vertices: the volume is not a normal number"),
        (lambda: vq.Polytope([[-1.7e308], [0.0], [1.7e308]]), "vertices: the volume is not a normal number"),
        (lambda: vq.Polygon(bent(1e200)), "vertices: the volume is not a normal number"),
        (lambda: vq.Polygon(bent(1e-200)), "vertices: the volume is not a normal number"),
        (lambda: vq.Ball([0.0], 1.7e308), "radius must have a 1-th power that is a positive number"),
        (lambda: vq.cells([0.5], cell=[[1e200]]), "largest coordinate of each vector must be between"),
        (lambda: vq.cells([0.5], cell=[[1e-200]]), "largest coordinate of each vector must be between"),
        (
            lambda: vq.cells([[0.0, 0]], domain=corner(2, 1e305)),
            "domain has coordinates beyond 1e.300; change the unit",
        ),
        (
            lambda: vq.cells([[0.0, 0]], domain=(np.eye(2) * 1e-200, [1e200, 1])),
            "the distance of a half-space from the origin is not finite; change the unit",
        ),
        (lambda: vq.quad(np.sum, [0.0, 0], [1e-200, 1e-200]), "the volume of the box is too small for floating point"),
    ],
)
def test_refused_in_one_line(make, message):
    with pytest.raises(ValueError, match=message) as error:
        make()
    assert "\n" not in str(error.value)


@pytest.mark.filterwarnings("error")
def test_polygons_beyond_the_range_of_geos():
    shapely = pytest.importorskip("shapely")
    for unit in (1e80, 1e-80):
        with pytest.raises(
            ValueError, match=r"domain has coordinates beyond 1e.70, or sides below 1e-70; change the unit"
        ):
            vq.cells([[0.0, 0.0]], domain=shapely.Polygon(bent(unit)))


@pytest.mark.filterwarnings("error")
def test_single_precision_in_a_box_beyond_its_range():
    cells = vq.cells(np.float32([[0.5, 1], [2, 3]]), bounds=[(-1e150, 1e150), (0, 1e60)])
    assert cells.measures.sum() == pytest.approx(2e210, rel=1e-12)


def test_points_on_a_line_are_a_polytope():
    domain = vq.Polytope([[2.0], [0.0], [1.0], [1.0]])
    assert domain.volume == 2
    assert sorted(s.volume for s in domain.simplices) == [1, 1]
    assert vq.cells([0.25, 1.5], domain=domain).measures.tolist() == [0.875, 1.125]
    assert vq.quad(lambda x: x, domain, rng=1).integral == pytest.approx(2, rel=1e-12)
    with pytest.raises(ValueError, match="vertices must be 2 points or more that span 1 dimensions"):
        vq.Polytope([[1.0], [1.0]])


@pytest.mark.parametrize("d", [1, 2, 3, 10])
def test_ordinary_vectors_stay_as_they_are(d):
    """So that volumes keep their bits."""
    x = np.random.default_rng(d).normal(size=(5, d))
    assert near_one(x)[0] is x
    assert near_one(np.zeros((2, d)))[1] == 0
    for factor in (1e-300, 1e300):
        scaled, exponent = near_one(factor * x)
        assert 0.5 <= np.abs(scaled).max() < 1
        np.testing.assert_array_equal(np.ldexp(scaled, exponent), factor * x)


@pytest.mark.parametrize("thin", [1e-4, 1e-8, 1e-12])
def test_volumes_of_thin_simplices(thin):
    """The determinant of the edges' products would have an error of 1e-16 / thin²."""
    legs = [(1.0, thin, 0.5), (thin, 1.0, 0.5), (1.0, 0.5, thin)]
    for sides in legs:
        vertices = np.vstack([np.zeros(3), np.diag(sides)])
        assert vq.Simplex(vertices).volume == pytest.approx(thin / 12, rel=1e-15 / thin)


def test_triangulation_of_a_box_thinner_than_points_are_told_apart():
    x = np.array([[i, j, k] for i in (0.25, 0.75) for j in (0.25, 0.75) for k in (0.25, 0.75)])
    sides = np.array([1.0, 1e-15, 1.0])
    bounds = np.stack([np.zeros(3), sides], axis=-1)
    assert len(vq.cells(x * sides, bounds=bounds, periodic=True).triangulation()) == 0
