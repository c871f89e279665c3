"""Density compensation against the weights known for radial trajectories."""

from __future__ import annotations

import numpy as np
import pytest
from any_points import any_set
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import KDTree

import voroquad as vq


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
        (np.full((4, 2), 0.6), {}, "cycles per voxel"),
        (np.full((4, 2), np.nan), {}, "sample 0"),
        (np.zeros((4, 2)), {"shape": (8, 8, 8)}, "as many axes"),
        (np.zeros((4, 2)), {"rim": "disc"}, "unknown rim"),
        (np.zeros((4, 2)), {"rim": "ball"}, "leaves the origin"),
    ],
)
def test_bad_input_is_named(trajectory, options, message):
    with pytest.raises(ValueError, match=message):
        vq.density_compensation(trajectory, **options)
