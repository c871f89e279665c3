"""Density compensation against the weights known for radial trajectories."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest
from any_points import any_set
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import KDTree

import voroquad as vq
from voroquad.geometry.k_space import cylinder_axis, rim_of


def radial(spokes: int, samples: int) -> np.ndarray:
    angle = np.pi * np.arange(spokes) / spokes
    radius = (np.arange(samples + 1) - samples / 2) / samples
    return radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None]


def koosh_ball(spokes: int, samples: int) -> np.ndarray:
    u = np.random.default_rng(0).normal(size=(spokes, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return u[:, None] * np.linspace(0, 0.5, samples)[:, None]


def test_radial_weights_are_the_ramp_filter():
    trajectory = radial(200, 64)
    w = vq.density_compensation(trajectory, (64, 64)).reshape(200, 65)
    radius = np.abs(np.arange(65) - 32) / 64
    ramp = radius * (np.pi / 200) / 64  # r dθ dr
    inner = (radius > 0) & (radius < 0.5)
    np.testing.assert_allclose(w[:, inner], np.broadcast_to(ramp[inner], w[:, inner].shape), rtol=1e-3)
    outer = 0.5 * (0.5**2 - (0.5 - 0.5 / 64) ** 2) * np.pi / 200  # (R² − r²) dθ / 2: whole sectors of the disc
    np.testing.assert_allclose(w[:, [0, -1]], outer, rtol=1e-3)


@pytest.mark.parametrize("samples", [64, 65])  # with the centre and around it
def test_spokes_share_the_centre(samples):
    w = vq.density_compensation(radial(50, samples), rim="box").reshape(50, -1)
    assert w.sum() == pytest.approx(1, abs=1e-12)
    if samples % 2 == 0:
        assert np.ptp(w[:, samples // 2]) <= 1e-18
        assert w[:, samples // 2].sum() == pytest.approx(np.pi / (4 * samples**2), rel=1e-2)


def all_of(d: int, radius: float) -> float:
    return np.pi * radius**2 if d == 2 else 4 / 3 * np.pi * radius**3


@pytest.mark.parametrize(
    "trajectory",
    [
        *[radial(200, 64), radial(7, 33), 1e-3 * radial(50, 20), np.array([[0.0, 0.3]])],
        *[koosh_ball(500, 17), 0.3 * koosh_ball(4, 5), np.array([[0.1, 0.2, 0.3]])],
        np.array([[0.5, 0, 0], [-0.5, 0, 0], [0, 0.5, 0], [0, -0.5, 0], [0, 0, 0.5], [0, 0, -0.5]]),
    ],
)
def test_the_ball_is_shared_to_the_last_digit(trajectory):
    trajectory = trajectory.reshape(-1, trajectory.shape[-1])
    w = vq.density_compensation(trajectory, rim="ball")
    assert (w > 0).all()
    whole = all_of(trajectory.shape[1], np.linalg.norm(trajectory, axis=1).max())
    assert w.sum() == pytest.approx(whole, rel=1e-12)


def test_the_six_ends_of_the_axes_share_the_ball_alike():
    ends = np.vstack([np.eye(3), -np.eye(3)]) / 2
    np.testing.assert_allclose(vq.density_compensation(ends, rim="ball"), np.pi / 36, rtol=1e-12)
    np.testing.assert_allclose(vq.density_compensation(ends[[0, 1, 3, 4], :2], rim="ball"), np.pi / 16, rtol=1e-12)


def test_a_half_and_its_rest():
    """One point in the plane x = 0.2 of another: a cap and what is left of the disc or ball."""
    for d, cap in ((2, np.arccos(0.4) / 4 - 0.2 * np.sqrt(0.21)), (3, np.pi * 0.3**2 * (3 * 0.5 - 0.3) / 3)):
        points = np.zeros((2, d))
        points[:, 0] = -0.1, 0.5  # halfway: 0.2
        w = vq.density_compensation(points, rim="ball")
        np.testing.assert_allclose(w, [all_of(d, 0.5) - cap, cap], rtol=1e-12)


@pytest.mark.statistical
@pytest.mark.parametrize("d", [2, 3])
def test_the_ball_by_counting(d):
    """Shares of random points nearest to each sample: normal errors, |z| > 5.5 once in 2.6e7 for each of 60."""
    rng = np.random.default_rng(d)
    points = rng.uniform(-0.5, 0.5, (100, d))
    points = points[np.linalg.norm(points, axis=1) < 0.5]
    points[0] = [0.5] + [0] * (d - 1)
    w = vq.density_compensation(points, rim="ball")
    darts = rng.uniform(-0.5, 0.5, (10**6, d))
    inside = darts[np.linalg.norm(darts, axis=1) < 0.5]
    share = np.bincount(KDTree(points).query(inside)[1], minlength=len(points)) / len(darts)
    z = (share - w) / np.sqrt(w * (1 - w) / len(darts))
    assert np.abs(z).max() < 5.5
    box = vq.density_compensation(points, rim="box")
    assert np.abs((share - box) / np.sqrt(box * (1 - box) / len(darts))).max() > 20, "the test can tell them apart"


@given(any_set(), st.booleans())
def test_any_positions_share_the_box_or_the_ball(points, ball):
    trajectory = np.resize(points, (len(points), max(2, points.shape[1]))) - 0.5
    radius = np.linalg.norm(trajectory, axis=1).max()
    if ball and radius == 0:
        return
    w = vq.density_compensation(trajectory, rim="ball" if ball else "box")
    assert (w >= 0).all()
    assert w.sum() == pytest.approx(all_of(trajectory.shape[1], radius) if ball else 1, rel=1e-12)


def test_the_rim_that_fits_is_chosen():
    square = np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, 9)] * 2), axis=-1)
    for trajectory, rim in ((radial(20, 16), "ball"), (koosh_ball(100, 9), "ball"), (square, "box")):
        np.testing.assert_array_equal(vq.density_compensation(trajectory), vq.density_compensation(trajectory, rim=rim))
    assert vq.density_compensation(np.zeros((4, 2))).tolist() == [0.25] * 4


# ---------------------------------------------------------------------- cylinders


def stack(planes: int, plane: np.ndarray, axis: int = 2) -> np.ndarray:
    """Planes (planes * n, 3) at the centres of equal slabs of the axis."""
    height = (np.arange(planes) + 0.5) / planes - 0.5
    flat = plane.reshape(-1, 2)
    return np.concatenate([np.insert(flat, axis, h, axis=1) for h in height])


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("shift", [0.0, -1 / 16])  # planes at the centres of slabs, or from -1/2
def test_a_stack_is_weighed_as_its_planes(axis, shift):
    plane = vq.density_compensation(radial(20, 16))
    trajectory = stack(8, radial(20, 16), axis)
    trajectory[:, axis] += shift
    for rim in ("auto", "cylinder"):
        np.testing.assert_allclose(vq.density_compensation(trajectory, rim=rim), np.tile(plane, 8) / 8, atol=1e-15)
    box = vq.density_compensation(trajectory, rim="box")
    assert abs(box.reshape(8, -1) - plane / 8).max() > plane.max() / 8, "the box is another domain"


def random_cylinder(n: int) -> np.ndarray:
    rng = np.random.default_rng(4)
    angle, radius = 2 * np.pi * rng.random(n), 0.5 * np.sqrt(rng.random(n))
    radius[0] = 0.5
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), rng.uniform(-0.5, 0.5, n)], axis=1)


@pytest.mark.statistical
@pytest.mark.parametrize("bounded", [False, True])
def test_weights_in_the_cylinder_by_counting(bounded):
    """Shares of a million darts: normal errors, |z| > 5.5 once in 2.6e7 for each of 60 weights."""
    points = random_cylinder(60)
    ends = (-0.5, 0.5) if bounded else None
    w = vq.density_compensation(points, rim="cylinder", bounds=ends)
    assert w.sum() == pytest.approx(np.pi / 4, rel=1e-12)
    darts = np.random.default_rng(5).uniform(-0.5, 0.5, (10**6, 3))
    inside = darts[np.hypot(darts[:, 0], darts[:, 1]) < 0.5]
    tree = KDTree(points + 0.5, boxsize=None if bounded else [9, 9, 1])
    share = np.bincount(tree.query(inside + 0.5)[1], minlength=len(points)) / len(darts)
    z = (share - w) / np.sqrt(w * (1 - w) / len(darts))
    assert np.abs(z).max() < 5.5
    other = vq.density_compensation(points, rim="cylinder", bounds=None if bounded else (-0.5, 0.5))
    assert np.abs((share - other) / np.sqrt(other * (1 - other) / len(darts))).max() > 20, "the ends are told apart"


def test_tilted_cuts_of_a_cylinder():
    """A plane z = 0.05 + 0.4 x that meets the mantle only, and a wedge of 2/3 R³ over half of the floor."""
    w = vq.density_compensation([[0.1, 0, -0.2], [-0.1, 0, 0.3]], rim="cylinder", bounds=(-0.5, 0.5))
    np.testing.assert_allclose(w, np.pi * 0.1**2 * np.array([0.55, 0.45]), rtol=1e-12)
    ends = [(-0.5, 0.5), (-0.5, 0.5), (0, 0.5)]
    w = vq.density_compensation([[0.1, 0, 0], [0, 0, 0.1], [0, 0.1, 0.5]], rim="cylinder", bounds=ends)
    assert w[0] == pytest.approx(2 / 3 * 0.1**3, rel=1e-12)
    assert w.sum() == pytest.approx(np.pi * 0.1**2 / 2, rel=1e-12)


@given(any_set())
def test_any_positions_share_the_cylinder(points):
    trajectory = np.resize(points, (len(points), 3)) - 0.5
    radius = np.linalg.norm(np.delete(trajectory, cylinder_axis(trajectory), axis=1), axis=1).max()
    if radius == 0:
        return
    w = vq.density_compensation(trajectory, rim="cylinder", bounds=(-0.5, 0.5))
    assert (w >= 0).all()
    assert w.sum() == pytest.approx(np.pi * radius**2, rel=1e-12)


@pytest.mark.parametrize(
    ("trajectory", "rim"),
    [
        (stack(8, radial(20, 16)), "cylinder"),
        (0.2 * stack(8, radial(20, 16)) + [0, 0, 0.4], "cylinder"),  # few planes, round in all axes' directions
        (stack(8, np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, 9)] * 2), axis=-1)), "box"),
        (random_cylinder(500), "cylinder"),
        (koosh_ball(300, 17), "ball"),
        (np.concatenate([koosh_ball(300, 17).reshape(-1, 3), [[0, 0, 0.5], [0, 0, -0.5]]]).round(1), "ball"),
    ],
)
def test_the_rim_of_samples_in_space(trajectory, rim):
    assert rim_of(trajectory.reshape(-1, 3)) == rim


def test_an_axis_that_is_covered_in_part_needs_bounds():
    part = stack(8, radial(20, 16)) * [1, 1, 0.2]
    with pytest.raises(ValueError, match=r"covers \[-0.0875, 0.0875\] of axis 2 only"):
        vq.density_compensation(part)
    w = vq.density_compensation(part, rim="cylinder", bounds=[(-0.5, 0.5), (-0.5, 0.5), (-0.1, 0.1)])
    np.testing.assert_allclose(w, np.tile(vq.density_compensation(radial(20, 16)), 8) / 40, atol=1e-15)
    with pytest.raises(ValueError, match=r"not inside \[-0.1, 0.1\]\^3 cycles/voxel; widen bounds="):
        vq.density_compensation(part, rim="cylinder", bounds=(-0.1, 0.1))


# ---------------------------------------------------------------------- planes, bounds, units


@pytest.mark.parametrize("rim", ["auto", "ball", "cylinder", "box"])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_plane_stored_in_space_is_weighed_as_a_plane(rim, axis):
    plane = radial(20, 16)
    stored = np.insert(plane, axis, 0.25, axis=2)
    expected = vq.density_compensation(plane, rim="ball" if rim == "cylinder" else rim)
    for shape in (None, (32, 32), (32, 32, 1) if axis == 2 else (1, 32, 32)):
        np.testing.assert_array_equal(vq.density_compensation(stored, shape, rim=rim), expected)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(("units", "unit"), [("cycles/voxel", 1.0), ("radians/voxel", 2 * np.pi)])
@pytest.mark.parametrize("where", ["vertices", "half-spaces", "polygon", "cell", "periodic", "each axis", "bounds"])
def test_a_plane_stored_in_space_has_domains_of_a_plane(where, units, unit, axis):
    triangle = unit * np.array([(-0.5, -0.5), (0.5, -0.5), (0.0, 0.5)])
    wheres = {
        "vertices": {"domain": triangle},
        "half-spaces": {"domain": ([[1, 1], [-1, 0], [0, -1]], unit * np.array([0.6, 0.3, 0.4]))},
        "cell": {"cell": unit * np.array([(0.9, 0.1), (0.2, 1.0)])},
        "periodic": {"periodic": True},
        "each axis": {"periodic": [True, False]},
        "bounds": {"bounds": unit * np.array([(-0.3, 0.4), (-0.4, 0.3)])},
    }
    if where == "polygon":
        pytest.importorskip("shapely")
        wheres[where] = {"domain": vq.Polygon(triangle)}
    plane = unit * np.random.default_rng(axis).uniform(-0.15, 0.15, (20, 2))
    expected = vq.density_compensation(plane, units=units, **wheres[where])
    stored = np.insert(plane, axis, 0.2 * unit, axis=1)
    np.testing.assert_array_equal(vq.density_compensation(stored, units=units, **wheres[where]), expected)


def test_a_plane_has_three_axes_where_they_are_asked_for():
    plane = np.random.default_rng(1).uniform(-0.15, 0.15, (20, 2))
    stored = np.insert(plane, 2, 0.2, axis=1)
    slab = {"bounds": [(-0.5, 0.5), (-0.5, 0.5), (0.0, 0.25)]}
    torus = vq.density_compensation(plane, periodic=True)
    for where, expected in (
        (slab, vq.density_compensation(plane, rim="box") / 4),
        (slab | {"periodic": [True, True, True]}, torus / 4),
        ({"bounds": (-0.5, 0.5), "periodic": [True, True, True]}, torus),
        ({"cell": np.diag([1, 1, 0.25])}, torus / 4),
    ):
        np.testing.assert_allclose(vq.density_compensation(stored, **where), expected, rtol=1e-12)


def test_a_third_coordinate_that_is_no_number_is_not_dropped():
    stored = np.insert(radial(4, 8).reshape(-1, 2), 2, 0.25, axis=1)
    stored[3, 2] = np.nan
    with pytest.raises(ValueError, match="sample 3 of the trajectory"):
        vq.density_compensation(stored)


def test_a_tilted_plane_or_a_line_in_space_is_asked_about():
    tilted = np.insert(radial(20, 16), 2, 0, axis=2) @ np.array([[1, 0, 0], [0, 0.6, 0.8], [0, -0.8, 0.6]])
    line = np.linspace(-0.5, 0.5, 33)[:, None] * [0.0, 0.0, 1.0]
    for flat in (tilted, line):
        with pytest.raises(ValueError, match="lies in one plane or on a line of space; pass its two coordinates"):
            vq.density_compensation(flat)
        assert vq.density_compensation(flat, rim="ball").sum() == pytest.approx(np.pi / 6, rel=1e-12)


def test_bounds_end_the_box():
    grid = np.stack(np.meshgrid(np.arange(-4, 5) / 16, np.arange(-2, 3) / 16), axis=-1)
    w = vq.density_compensation(grid, bounds=[(-4.5 / 16, 4.5 / 16), (-2.5 / 16, 2.5 / 16)])
    np.testing.assert_allclose(w, 1 / 256, rtol=1e-12)
    radians = vq.density_compensation(
        grid * 2 * np.pi,
        bounds=2 * np.pi * np.array([(-4.5 / 16, 4.5 / 16), (-2.5 / 16, 2.5 / 16)]),
        units="radians/voxel",
    )
    np.testing.assert_allclose(radians, w, rtol=1e-12)


@pytest.mark.parametrize(("units", "unit"), [("cycles/voxel", 1), ("radians/voxel", 2 * np.pi), ("cycles/fov", 8)])
def test_a_grid_that_starts_at_the_end_is_periodic(units, unit):
    grid = unit * np.stack(np.meshgrid(*[np.arange(-4, 4) / 8] * 2), axis=-1)
    for periodic in (True, [True, True]):
        w = vq.density_compensation(grid, (8, 8), periodic=periodic, units=units)
        np.testing.assert_allclose(w, 1 / 64, rtol=1e-12)
    one_axis = vq.density_compensation(grid, (8, 8), periodic=[True, False], units=units).reshape(8, 8)
    np.testing.assert_allclose(one_axis[:, 3], np.array([0.5, 1, 1, 1, 1, 1, 1, 1.5]) / 64, rtol=1e-12)
    part = unit * np.array([(-0.5, 0.5), (-0.5, 1.0)])
    with pytest.raises(ValueError, match="rim='ball' has no periodic axes; leave out periodic="):
        vq.density_compensation(grid, (8, 8), rim="ball", periodic=True, units=units)
    whole = vq.density_compensation(grid, (8, 8), bounds=part, periodic=[True, False], units=units).sum()
    assert whole == pytest.approx(1.5, rel=1e-12)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize(("units", "unit"), [("cycles/voxel", 1), ("radians/voxel", 2 * np.pi), ("cycles/fov", 8)])
def test_domains_are_in_the_units_of_the_trajectory(units, unit, dtype):
    angle = np.arange(6) * np.pi / 3
    hexagon = 0.5 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    inside = np.random.default_rng(6).uniform(-0.25, 0.25, (40, 2))
    positions = (unit * np.concatenate([inside, hexagon])).astype(dtype)
    expected = vq.cells(np.concatenate([inside, hexagon]), domain=hexagon).measures
    normals = np.stack([np.cos(angle + np.pi / 6), np.sin(angle + np.pi / 6)], axis=-1)
    domains = [unit * hexagon, (normals, np.full(6, unit * 3**0.5 / 4))]
    if importlib.util.find_spec("shapely"):
        domains.append(vq.Polygon(unit * hexagon))
    for domain in domains:
        w = vq.density_compensation(positions, (8, 8), domain=domain, units=units)
        np.testing.assert_allclose(w, expected, atol=1e-6 if dtype == np.float32 else 1e-12)
        assert w.sum() == pytest.approx(3**1.5 / 8, rel=1e-12)
    lattice = [(1.1, 0), (0.5, 0.9)]
    w = vq.density_compensation(positions, (8, 8), cell=unit * np.array(lattice), units=units)
    exact = vq.cells(np.concatenate([inside, hexagon]), cell=lattice).measures
    np.testing.assert_allclose(w, exact, atol=1e-6 if dtype == np.float32 else 1e-12)


@pytest.mark.parametrize("rim", ["box", "ball"])
def test_units(rim):
    w = vq.density_compensation(radial(20, 16), rim=rim)
    for units, factor in (("radians/voxel", 2 * np.pi), ("cycles/fov", np.array([32, 24]))):
        given = (radial(20, 16) * factor).astype(np.float32)
        np.testing.assert_allclose(vq.density_compensation(given, (32, 24), rim=rim, units=units), w, rtol=1e-4)


def test_positions_rounded_to_single_precision():
    rounded = (radial(20, 16) * 2 * np.pi).astype(np.float32) / np.float32(2 * np.pi) * (1 + 1e-7)
    for rim in ("box", "ball"):
        expected = vq.density_compensation(radial(20, 16), rim=rim)
        np.testing.assert_allclose(vq.density_compensation(rounded, rim=rim).sum(), expected.sum(), rtol=1e-6)


def test_bits_do_not_depend_on_threads():
    one, two = (vq.density_compensation(koosh_ball(300, 33), threads=t) for t in (1, 2))
    assert one.tobytes() == two.tobytes()


@pytest.mark.parametrize(
    ("trajectory", "options", "message"),
    [
        (np.zeros((4, 5)), {}, "d = 2 or 3"),
        (np.full((4, 2), 0.6), {}, r"sample 0 .* \[0.6, 0.6\], not inside \[-0.5, 0.5\]\^2 cycles/voxel; say units="),
        (np.full((4, 2), np.nan), {}, "sample 0"),
        (np.zeros((4, 2)), {"shape": (8, 8, 8)}, "as many axes"),
        (np.zeros((4, 2)), {"rim": "disc"}, "unknown rim"),
        (np.zeros((4, 2)), {"rim": "ball"}, "leaves the origin"),
        (np.zeros((4, 2)), {"rim": "cylinder"}, "d = 3"),
        (np.eye(3) * [0, 0, 0.5], {"rim": "cylinder", "bounds": (-0.5, 0.5)}, "leaves the axis"),
        (radial(4, 8), {"rim": "ball", "bounds": (-0.5, 0.5)}, "bounds= is for rim='box' and 'cylinder'"),
        (radial(4, 8), {"domain": np.eye(3)[:, :2], "rim": "ball"}, "domain= says where cells end; leave out rim="),
        (radial(4, 8), {"cell": np.eye(2), "bounds": (-0.5, 0.5)}, "cell= says where cells end; leave out bounds="),
        (radial(4, 8), {"cell": np.eye(2), "periodic": True}, "cell= says where cells end; leave out periodic="),
        (radial(4, 8), {"domain": "ball"}, "domain='ball': say rim='ball'"),
        (radial(4, 8), {"domain": "disc"}, "unknown domain 'disc'; a disc or ball is rim='ball'"),
        (radial(4, 8), {"cell": np.eye(2), "domain": np.eye(2)}, "leave out domain="),
        (radial(4, 8), {"cell": np.eye(3)}, r"cell has shape \(3, 3\); the trajectory has d = 2"),
        (radial(4, 8), {"cell": [1, 2]}, r"cell has shape \(2,\); the trajectory has d = 2"),
        (radial(4, 8), {"cell": np.ones((3, 2))}, r"cell has shape \(3, 2\); give d = 2 lattice vectors"),
        (
            koosh_ball(4, 8),
            {"domain": [(0, 0), (1, 0), (0, 1)]},
            r"domain has shape \(3, 2\); the trajectory has d = 3",
        ),
        (koosh_ball(4, 8), {"domain": ([[1, 1]], [1])}, r"domain\[0\] has shape \(1, 2\); the trajectory has d = 3"),
        (koosh_ball(4, 8), {"domain": {"type": "Polygon"}}, "domain is a polygon, the trajectory has d = 3"),
        (koosh_ball(4, 8), {"rim": "cylinder", "periodic": True}, "rim='cylinder' is periodic along its axis"),
        (radial(4, 8), {"bounds": []}, r"bounds must be pairs \(low, high\)"),
        (radial(4, 8), {"periodic": [True]}, "periodic must be True, False or one of them for each of d = 2 axes"),
        (radial(4, 8), {"bounds": (-0.4, 0.5)}, r"not inside \[-0.4, 0.5\] × .*|widen bounds="),
        (radial(4, 8), {"units": "cycles"}, "unknown units 'cycles'; choose one of cycles/voxel, radians/voxel"),
        (radial(4, 8), {"units": "cycles/fov"}, "needs the shape of the image"),
        (np.ma.masked_greater(radial(4, 8), 0.4), {}, "must not be masked"),
    ],
)
def test_bad_input_is_named(trajectory, options, message):
    with pytest.raises(ValueError, match=message) as error:
        vq.density_compensation(trajectory, **options)
    assert "\n" not in str(error.value)
