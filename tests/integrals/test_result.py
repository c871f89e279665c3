"""How a result is read and printed."""

import math

import numpy as np
import pytest

import voroquad as vq
from voroquad.integrals.result import QuadResult, with_uncertainty


def test_prints_a_value_with_its_uncertainty():
    assert with_uncertainty(2.666131, 0.000042) == "2.66613(4)"
    assert with_uncertainty(2.666131, 0.000014) == "2.666131(14)"
    assert with_uncertainty(0.0, 0.03) == "0.00(3)"
    assert with_uncertainty(99.96, 0.096) == "100.0(1)"
    assert with_uncertainty(5231, 120) == "5230(120)"
    assert with_uncertainty(-3.2e-9, 4e-11) == "-3.20(4)e-09"
    assert with_uncertainty(1.71828e300, 1.4e296) == "1.71828(14)e+300"
    assert with_uncertainty(3e-320, 1e-321) == "2.99997e-320(1e-321)"
    assert with_uncertainty(1.5, 0.0) == "1.5"
    assert with_uncertainty(math.nan, 1.0) == "nan(1)"
    r = vq.quad(lambda x: (x[0] < 0.3) + 0.0 * x[0], 0, 1, rng=1)
    assert str(r).startswith("0.")
    assert "standard_error" in repr(r)


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [(-1e-18, 6e-16, "0(6)e-16"), (-0.0, 0.0, "0"), (-0.001, 0.03, "0.00(3)"), (-3, 120, "0(120)")],
)
def test_a_zero_has_no_minus(value, error, text):
    assert with_uncertainty(value, error) == text


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
    np.testing.assert_allclose(high, [2 + 0.5 * half, -1 + 3 * half], rtol=1e-12)
    np.testing.assert_allclose(low, [2 - 0.5 * half, -1 - 3 * half], rtol=1e-12)
