"""Circle and torus as domains: cells(periodic=True) without a correction."""

import numpy as np
import pytest

import voroquad as vq


def on_the_torus(points):
    return vq.cells(points, periodic=True).measures


def f(x):
    """Neither periodic nor symmetric, with a jump; ∫ f = (e − 1)^d + 0.05."""
    return np.exp(x.sum(axis=-1)) + (x[..., 0] < 0.05)


@pytest.mark.statistical
@pytest.mark.parametrize(("d", "n"), [(1, 9), (2, 9), (2, 25), (3, 20)])
def test_independent_points_are_weighed_without_bias(z_score, d, n):
    x = vq.sample("uniform", n, d, sets=20_000, rng=4).points
    truth = (np.e - 1) ** d + 0.05
    assert abs(z_score((on_the_torus(x) * f(x)).sum(axis=1), truth)) < 5.5
    assert abs(z_score((vq.cells(x).measures * f(x)).sum(axis=1), truth)) > 20  # the box has a border


@pytest.mark.statistical
def test_one_point_per_arc_of_the_circle(z_score):
    x = vq.sample("stratified", 9, 1, sets=20_000, rng=4).points
    assert abs(z_score((on_the_torus(x) * f(x)).sum(axis=1), np.e - 0.95)) < 5.5
    assert abs(z_score((vq.cells(x).measures * f(x)).sum(axis=1), np.e - 0.95)) > 20


@pytest.mark.statistical
def test_a_random_shift_makes_any_set_unbiased(z_score):
    rng = np.random.default_rng(4)
    crowded = rng.random((20_000, 12, 2)) ** 2  # towards the origin
    shifted = (crowded + rng.random((20_000, 1, 2))) % 1.0
    truth = (np.e - 1) ** 2 + 0.05
    assert abs(z_score((on_the_torus(shifted) * f(shifted)).sum(axis=1), truth)) < 5.5
    assert abs(z_score((on_the_torus(crowded) * f(crowded)).sum(axis=1), truth)) > 20
    np.testing.assert_allclose(on_the_torus(shifted), on_the_torus(crowded), atol=1e-12)


@pytest.mark.statistical
@pytest.mark.parametrize("d", [1, 2])
def test_the_error_falls_faster_than_that_of_equal_weights(d):
    def errors(n):
        x = vq.sample("uniform", n, d, sets=400, rng=6).points
        values = np.exp(np.sin(2 * np.pi * x).sum(axis=-1)) - np.i0(1.0) ** d
        return np.mean((on_the_torus(x) * values).sum(axis=1) ** 2), np.mean(values.mean(axis=1) ** 2)

    (few, few_equal), (many, many_equal) = errors(32), errors(512)
    assert few < few_equal / 2
    assert few / many > 8 * few_equal / many_equal  # O(N^(−1 − 2/d)) at least, against O(1/N)
