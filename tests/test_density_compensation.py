"""Density compensation against the weights known for radial trajectories."""

from __future__ import annotations

import numpy as np
import pytest

import voroquad as vq


def radial(spokes: int, samples: int) -> np.ndarray:
    angle = np.pi * np.arange(spokes) / spokes
    radius = (np.arange(samples + 1) - samples / 2) / samples
    return radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None]


def test_radial_weights_are_the_ramp_filter():
    trajectory = radial(200, 64)
    w = vq.density_compensation(trajectory, (64, 64), rim="ball").reshape(200, 65)
    radius = np.abs(np.arange(65) - 32) / 64
    ramp = radius * (np.pi / 200) / 64  # r dθ dr
    inner = (radius > 0) & (radius < 0.5)
    np.testing.assert_allclose(w[:, inner], np.broadcast_to(ramp[inner], w[:, inner].shape), rtol=1e-3)
    assert w.sum() == pytest.approx(np.pi / 4, rel=1e-3)


def test_spokes_share_the_centre():
    w = vq.density_compensation(radial(50, 32)).reshape(50, 33)
    assert np.ptp(w[:, 16]) <= 1e-18
    assert w[:, 16].sum() == pytest.approx(np.pi / (4 * 32**2), rel=1e-2)
    assert w.sum() == pytest.approx(1, abs=1e-12)


def test_the_ball_in_space():
    u = np.random.default_rng(0).normal(size=(2000, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    koosh = u[:, None] * np.linspace(0, 0.5, 17)[:, None]
    w = vq.density_compensation(koosh, (32, 32, 32), rim="ball")
    assert w.sum() == pytest.approx(np.pi / 6, rel=1e-2)
    assert (w > 0).all()


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
