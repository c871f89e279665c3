"""Cells counted by probes: their measures, their accuracy, points that coincide."""

import numpy as np
import pytest

import voroquad as vq
from voroquad.geometry.probes import PROBES, probed_measures


def test_the_counts_are_as_accurate_as_they_say():
    points = vq.sample("uniform", 300, 3, rng=1).points
    exact, counted = vq.cells(points).measures, probed_measures(points, 1)
    error = (counted - exact) / np.sqrt(exact / (PROBES * 300))
    assert np.sqrt(np.mean(error**2)) < 1
    assert abs(error).max() < 4
    assert counted.sum() == pytest.approx(1, abs=1e-14)


def test_points_that_coincide_share_their_cell():
    points = np.array([[0.25] * 4, [0.75] * 4, [0.25] * 4])
    (w,) = vq.weights(points[None])  # one set: three points in d = 4, not four in d = 3
    assert w[0] == w[2]
    assert w == pytest.approx([0.25, 0.5, 0.25], abs=0.02)


def test_order_0_in_many_dimensions_beats_equal_weights():
    points = vq.sample("uniform", 256, 5, sets=30, rng=1).points
    f = np.exp(points.mean(axis=-1))
    truth = (5 * (np.exp(0.2) - 1)) ** 5
    weighted = ((vq.weights(points, threads=2) * f).sum(axis=1) - truth) ** 2
    assert weighted.mean() < ((f.mean(axis=1) - truth) ** 2).mean()


def test_the_same_on_any_number_of_threads():
    points = vq.sample("uniform", 40, 6, rng=2).points
    assert np.array_equal(probed_measures(points, 1), probed_measures(points, 3))
    assert np.array_equal(probed_measures(points[None], 1)[0], probed_measures(points, 1))
