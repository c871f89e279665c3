"""Noise contrasts: the variance that weights add to noise they do not know, and nothing of what is smooth."""

from __future__ import annotations

import numpy as np
import pytest

import voroquad as vq
from voroquad.mitsuba.contrasts import noise_contrasts

CASES = [("stratified", 1, 16), ("stratified", 2, 16), ("stratified", 2, 64), ("uniform", 2, 50), ("stratified", 3, 27),
         ("stratified", 2, 4)]  # fmt: skip


def table(design, d, n, sets=200):
    order, debias = (1, "leave-one-out") if d == 3 else (0, "auto")
    return vq.SampleTable.make(design, n, d, sets, order, debias, rng=3)


@pytest.mark.statistical
@pytest.mark.parametrize(("design", "d", "n"), CASES)
def test_variance_is_what_weights_add_to_noise(design, d, n):
    """E[E²] = Var(N w) σ² / n for noise of variance σ²; and constants vanish."""
    made = table(design, d, n)
    c = noise_contrasts(made.points, made.weights)
    np.testing.assert_allclose(c.sum(1), 0, atol=1e-13)
    noise = 3 * np.random.default_rng(1).standard_normal((400, n))
    squares = np.concatenate([(noise @ each) ** 2 for each in c])
    expected = np.mean((n * made.weights - 1) ** 2) * 9 / n
    # The squares of one set are independent, those of different ones nearly so
    assert abs(squares.mean() / expected - 1) < 5 * np.sqrt(2 / 400 / min(n, 200)) + 0.02


@pytest.mark.parametrize(("design", "d", "n", "most"), [("stratified", 1, 16, 0.02), ("stratified", 2, 64, 0.2)])
def test_smooth_functions_are_no_noise(design, d, n, most):
    """What the weights do to a smooth function is not mistaken for noise that they add."""
    made = table(design, d, n)
    values = np.exp(made.points.sum(-1))
    weighted = ((made.weights - 1 / n) * values).sum(-1)
    seen = (noise_contrasts(made.points, made.weights) * values).sum(-1)
    assert (seen**2).sum() < most * (weighted**2).sum()


def test_lines_along_the_last_axis_vanish():
    made = table("stratified", 2, 64)
    seen = (noise_contrasts(made.points, made.weights) * made.points[..., 1]).sum(-1)
    np.testing.assert_allclose(seen, 0, atol=1e-12)


def test_samples_without_neighbours():
    """Then nothing is known, and the weights are not trusted: E is what they add."""
    points = np.random.default_rng(2).random((5, 1, 2))
    np.testing.assert_array_equal(noise_contrasts(points, np.ones((5, 1))), np.zeros((5, 1)))
    w = np.array([[0.3, 0.7]])
    apart = np.array([[[0.1, 0.5, 0.5], [0.9, 0.5, 0.5]]])
    np.testing.assert_allclose(noise_contrasts(apart, w), w - 0.5)
