"""Typed formulas and their integrals."""

import math

import numpy as np
import pytest

from voroquad.explore.integrands import FIRST, PRESETS, preset, typed


@pytest.mark.parametrize(
    ("text", "d", "integral"),
    [
        ("exp(x)", 1, math.e - 1),
        ("x < 1/3", 1, 1 / 3),
        ("1/sqrt(x)", 1, 2),
        ("2", 2, 2),
        ("0", 1, 0),
        ("exp(x + y)", 2, (math.e - 1) ** 2),
        ("(x-0.5)^2 + (y-0.5)^2 < 0.1", 2, 0.1 * math.pi),
    ],
)
def test_integral_within_its_uncertainty(text, d, integral):
    problem = typed(text, d)
    assert problem.uncertainty < 1e-3
    assert abs(problem.integrand.integral - integral) <= max(problem.uncertainty, 1e-12)


def test_values_over_any_batch():
    points = np.random.default_rng(1).random((3, 5, 2))
    f = typed("x * y + (x < 0.5)", 2).integrand.values
    np.testing.assert_allclose(f(points), points.prod(axis=-1) + (points[..., 0] < 0.5))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("log(x - 0.5)", "its value is nan at x ="),
        ("x + y", "unknown name 'y'"),
        ("x.real", "'x.real' is not allowed"),
        ("x ** -2", "may not exist"),
        ("1 / (x - 0.4999)", "may not exist"),
    ],
)
def test_refused(text, message):
    with pytest.raises(ValueError, match=message):
        typed(text, 1)


@pytest.mark.parametrize("d", [1, 2])
def test_presets_are_the_studys(d):
    assert preset(FIRST[d], d).integrand in PRESETS[d]
    assert not preset(FIRST[d], d).typed
