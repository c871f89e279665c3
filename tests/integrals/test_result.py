"""How a result is read and printed."""

import math

import numpy as np
import pytest

import voroquad as vq
from voroquad.integrals.result import QuadResult


def test_prints_a_value_with_its_uncertainty():
    assert str(QuadResult(2.666131, 0.000042, 100)) == "2.66613(4)"
    assert str(QuadResult(np.array([[2.5, -1e-17]]), np.array([[0.1, 6e-16]]), 100)) == "[[2.50(10) 0(6)e-16]]"
    assert "standard_error" in repr(QuadResult(1.0, 0.1, 100))


def test_unpacks_as_results_of_scipy_do():
    integral, error = vq.quad(lambda x: x[0] ** 2, 0, 1, rng=1)
    assert integral == pytest.approx(1 / 3)
    assert 0 < error < 1e-12
    integrals, errors = vq.quad(lambda x: np.stack([x[0], x[0] ** 2]), 0, 1, rng=1)
    assert np.shape(integrals) == np.shape(errors) == (2,)


@pytest.mark.parametrize(
    ("degrees_of_freedom", "level", "half"),
    [
        (math.inf, math.erf(1 / math.sqrt(2)), 1.0),  # a normal variable is within one standard deviation
        (math.inf, math.erf(3 / math.sqrt(2)), 3.0),
        (1, 0.5, 1.0),  # a Cauchy variable is in (−1, 1) or outside with equal chance
        (1, 0.9, math.tan(0.45 * math.pi)),
        (2, 0.8, 0.8 * math.sqrt(2 / (1 - 0.8**2))),  # F⁻¹(½ + p/2) of two degrees of freedom
    ],
)
def test_an_interval_holds_its_level_of_the_distribution_on_both_sides(degrees_of_freedom, level, half):
    result = QuadResult(np.array([2.0, -1.0]), np.array([0.5, 3.0]), 100, degrees_of_freedom)
    low, high = result.confidence_interval(level)
    np.testing.assert_allclose(high, [2 + 0.5 * half, -1 + 3 * half], rtol=1e-10)
    np.testing.assert_allclose(low, [2 - 0.5 * half, -1 - 3 * half], rtol=1e-10)
