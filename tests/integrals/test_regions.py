"""The maps from the unit box."""

import math

import numpy as np
import pytest
import scipy.integrate

import voroquad as vq
from voroquad import _core
from voroquad.integrals.library import Library
from voroquad.integrals.places import parts_of
from voroquad.integrals.regions import Box, Region
from voroquad.integrals.rotation import RotatedGaussian


@pytest.mark.parametrize(
    ("a", "b", "scale"),
    [
        *[(-1.5, 2.0, 1), (2.0, -1.5, 1), (0.5, np.inf, 1), (-np.inf, 0.5, 1), (-np.inf, np.inf, 1)],
        *[(np.inf, -np.inf, 1), (0.5, np.inf, 1e3), (-np.inf, 0.5, 10), (-np.inf, np.inf, 7)],
    ],
)
def test_the_jacobian_is_the_derivative_of_the_map(a, b, scale):
    """∫ (dx/du) du = x(v) − x(u), on intervals that halve towards both ends, down to 2^−40."""
    box = Box(a, b, Library.of(a, b), 0.0 if np.isfinite([a, b]).any() else 3.0, scale)
    near = 2.0 ** -np.arange(1, 41.0)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    for ends in (near, 1 - near):
        start, stop = np.minimum(ends[1:], ends[:-1]), np.maximum(ends[1:], ends[:-1])
        u = start[:, None] + (stop - start)[:, None] * (nodes + 1) / 2
        _, jacobian = box.pull_back(u.reshape(1, -1))
        integrals = (box.sign * jacobian.reshape(u.shape) @ weights) * (stop - start) / 2
        (to,), (begin,) = box.pull_back(stop[None])[0], box.pull_back(start[None])[0]
        np.testing.assert_allclose(integrals, to - begin, rtol=2e-5)  # 2^-40 away from 1, u has 12 digits less
        np.testing.assert_allclose(integrals[:20], (to - begin)[:20], rtol=1e-9)


def test_the_map_goes_through_the_whole_interval():
    """Strictly upwards, from one limit to the other; those at infinity are left out."""
    u = np.concatenate([[0.0], np.geomspace(1e-12, 0.5, 50), 1 - np.geomspace(0.4, 1e-12, 50), [1.0]])[None]
    for a, b in [(-1.5, 2.0), (0.5, np.inf), (-np.inf, 0.5), (-np.inf, np.inf)]:
        (x,), jacobian = Box(a, b, Library.of(a, b)).pull_back(u)
        assert np.isfinite(x).all()
        assert (np.isfinite(jacobian) & (jacobian > 0)).all()
        assert (np.diff(x) >= 0).all()
        assert (np.diff(x[1:-1]) > 0).all()
        assert x[0] == pytest.approx(a, abs=1e-15) if np.isfinite(a) else x[0] < -1e15
        assert x[-1] == pytest.approx(b, abs=1e-15) if np.isfinite(b) else x[-1] > 1e15


@pytest.mark.parametrize(
    ("a", "b", "loc", "scale", "median"),
    [(2, np.inf, 0, 5, 7), (-np.inf, 2, 0, 5, -3), (-np.inf, np.inf, 40, 5, 40)],
)
def test_half_of_the_points_are_where_loc_and_scale_say(a, b, loc, scale, median):
    ((x,),), _ = Box(a, b, Library.of(a, b), loc, scale).pull_back(np.array([[0.5]]))
    assert x == median


@pytest.mark.parametrize(
    ("limits", "maps", "message"),
    [
        ((0, 1), {"scale": 2}, "loc and scale are for infinite limits, and these are finite"),
        ((0, 1), {"loc": 2}, "loc and scale are for infinite limits, and these are finite"),
        ((0, np.inf), {"loc": 2}, "loc and scale are for infinite limits|loc is for coordinates"),
        ((0, np.inf), {"scale": 0}, "scale must be positive, got 0"),
        ((0, np.inf), {"scale": [1, 2]}, "scale must be a finite number or 1 of them"),
        (([-np.inf, 0], [np.inf, 1]), {"loc": [1, 1]}, "loc is for coordinates that run from -inf to inf"),
    ],
)
def test_locations_and_scales_that_mean_nothing_are_refused(limits, maps, message):
    with pytest.raises(ValueError, match=message):
        vq.quad(lambda x: x[0], *limits, **maps)


def test_a_peak_far_from_0_is_found_where_loc_says():
    def f(x):
        return np.exp(-((x[0] - 1e6) ** 2) / 2)

    r = vq.quad(f, -np.inf, np.inf, loc=1e6 + 2, scale=2, rng=1)
    assert r.integral == pytest.approx(np.sqrt(2 * np.pi), rel=1e-8)
    with pytest.warns(vq.IntegrationWarning, match="func is 0 at every point"):
        assert vq.quad(f, -np.inf, np.inf, rng=1).integral == 0


# ---------------------------------------------------------------------- limits that are functions


def test_the_limits_of_a_coordinate_take_those_after_it():
    """∫_0^1 dz ∫_0^z dy ∫_{y−z}^{y+2z} x dx."""
    seen = []

    def low(y, z):
        seen.append((y.shape, bool((y <= z).all())))
        return y - z

    r = vq.quad(lambda x: x[0], [low, 0, 0], [lambda y, z: y + 2 * z, lambda z: z, 1], rng=1)
    # ∫ x dx = ((y + 2z)² − (y − z)²)/2 = (6yz + 3z²)/2; over y: (3z³ + 3z³)/2 = 3z³; over z: 3/4
    assert abs(r.integral - 0.75) < 1e-6
    assert set(seen) == {((r.n_evaluations,), True)}


def test_iterated_limits_agree_with_nquad():
    ranges = [lambda y, z: (-y, y * z), lambda z: (1 - z, 1), (0, 1)]
    exact, _ = scipy.integrate.nquad(lambda x, y, z: np.exp(x + y * z), ranges)
    low, high = [lambda y, z: -y, lambda z: 1 - z, 0], [lambda y, z: y * z, 1, 1]
    r = vq.quad(lambda x: np.exp(x[0] + x[1] * x[2]), low, high, rng=1)
    assert abs(r.integral - exact) < 5 * r.standard_error < 2e-3


def test_iterated_limits_that_cross_change_the_sign():
    r = vq.quad(lambda x: np.ones(x.shape[1]), [lambda y: y, 0], [0.5, 1], n_points=4096, rng=1)
    assert abs(r.integral) < 1e-12  # ∫ (½ − y) dy
    assert vq.quad(lambda x: x[0], [0, 1], [lambda y: 2 * y, 0], rng=1).integral == pytest.approx(-2 / 3)


def test_iterated_limits_may_be_infinite():
    r = vq.quad(lambda x: np.exp(-x[0] * x[1] ** 2), [lambda y: y, 1], [np.inf, 2], n_points=4096, rng=1)
    exact, _ = scipy.integrate.quad(lambda y: np.exp(-(y**3)) / y**2, 1, 2)
    assert r.integral == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize(
    ("a", "b", "message"),
    [
        ([0, 0], [1, lambda x: x], r"b\[-1\] must be a number, got a callable: limits depend on the coordinates after"),
        ([0, 0, 0], [lambda y: y, 1], "a and b must have a limit for each dimension, got 3 and 2"),
        ([0, 0], [lambda y: np.ones(3), 1], r"b\[0\] must return a number or shape \(1024,\)"),
        ([0, 0], [lambda y: np.nan * y, 1], "none of them NaN"),
        ([0, "1"], [lambda y: y, 1], r"a\[1\] must be"),
    ],
)
def test_limits_that_are_no_limits_are_refused(a, b, message):
    with pytest.raises(ValueError, match=message):
        vq.quad(lambda x: x[0], a, b)


def regions() -> dict[str, Region]:
    """A region of each kind, the first part where there are several."""
    rng = np.random.default_rng(5)
    turned, _ = np.linalg.qr(rng.normal(size=(6, 6)))
    above = [0, 0], [lambda y: np.sqrt(1 - y**2), 1]
    places = {
        "whole space": ([-np.inf] * 3, [np.inf] * 3),
        "callable limits": above,
        "triangle": (vq.Triangle([[0, 0], [2, 1], [0.3, 3]]), None),
        "simplex of 6 dimensions": (vq.Simplex(rng.random((7, 6))), None),
        "ball": (vq.Ball([1, 2, 3], 0.7), None),
        "ball of 5 dimensions": (vq.Ball([0] * 5, 2), None),
        "sphere": (vq.SphereSurface([1, 2, 3], 0.7), None),
        "sphere in 5 dimensions": (vq.SphereSurface([0] * 5, 2), None),
        "polygon": (vq.Polygon([[0, 0], [3, 0.2], [1, 1], [0.3, 3]]), None),
        "octahedron": (vq.Polytope(np.concatenate([np.eye(3), -np.eye(3)])), None),
    }
    found = {name: parts_of(a, b, None, 0.0, 1.0)[0][0].region for name, (a, b) in places.items()}
    return found | {"turned Gaussian": RotatedGaussian(rng.random(6), rng.random(6), turned)}


@pytest.mark.parametrize("name", regions())
def test_the_bits_of_a_point_do_not_depend_on_those_beside_it(name):
    """Else the result would depend on `batch`, as a product by BLAS does: its blocks end in other instructions."""
    region = regions()[name]
    u = np.random.default_rng(1).random((region.d, 37))
    points, elements = region.pull_back(u)
    for size in (1, 2, 3, 8):
        batches = [region.pull_back(u[:, i : i + size]) for i in range(0, u.shape[1], size)]
        np.testing.assert_array_equal(np.concatenate([x for x, _ in batches], axis=1), points)
        np.testing.assert_array_equal(np.concatenate([e for _, e in batches]), elements)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_points_of_a_box_are_those_of_the_formula_and_inside(dtype):
    """Of any strides; and on no limit, also where rounding or the ends of the unit box would put them there."""
    a, b = np.array([-1.0, 2.0, 1.0, 7.0]), np.array([3.0, 2.5, np.nextafter(1.0, 2.0), -7.0])
    box = Box(a, b, Library.of(a.astype(dtype), b))
    low, high = np.minimum(a, b), np.maximum(a, b)
    u = np.random.default_rng(1).random((40, 4))
    u[0], u[1] = 0.0, 1.0
    strided = np.asfortranarray(u).T, np.repeat(u, 2, axis=0)[::2].T, np.ascontiguousarray(u.T)
    for given in strided:
        before = given.copy()
        x, volume = box.pull_back(given)
        assert x.flags.c_contiguous
        np.testing.assert_array_equal(given, before)
        np.testing.assert_allclose(x, low[:, None] + (high - low)[:, None] * u.T, rtol=3 * np.finfo(x.dtype).eps)
        wide = [0, 1, 3]
        assert (x[wide] > low[wide, None]).all()
        assert (x[wide] < high[wide, None]).all()
        np.testing.assert_array_equal(volume, -math.prod(high - low))


def test_limits_of_other_dimensions_are_an_error_of_the_core():
    one, two = np.zeros(1), np.zeros(2)
    with pytest.raises(ValueError, match="one for each coordinate"):
        _core.into_box(np.zeros((2, 3)), two, two, one, two)
