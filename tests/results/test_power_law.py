"""The one fit of straight lines in log–log plots."""

import math

import numpy as np
import pytest

from voroquad.results.power_law import fit_power_law


def test_a_power_law_is_found():
    x = np.array([3.0, 10.0, 40.0, 90.0])
    law = fit_power_law(x, 7 * x**-1.5)
    assert law.slope == pytest.approx(-1.5)
    np.testing.assert_allclose(law([1.0, 100.0]), [7.0, 7e-3])


def test_what_has_no_logarithm_is_left_out():
    law = fit_power_law([1, 2, 4, 8, 16, 32], [1, 0, 0.25, -1, math.nan, math.inf])
    assert law.slope == pytest.approx(-1)


@pytest.mark.parametrize(
    ("x", "y"),
    [
        ([], []), ([2], [1]), ([2, 2], [1, 3]), ([1, 1 + 1e-12], [1e-9, 1e9]), ([1, 1.2, 1.9], [9, 1, 1e-9]),
        ([0, 1], [1, 1]),
    ],
)  # fmt: skip
def test_no_slope_where_x_spans_too_little(x, y):
    assert fit_power_law(x, y) is None


def test_no_overflow():
    law = fit_power_law([1, 1.0001, 2], [1e-150, 1e150, 1e150])
    assert np.isfinite(law([1e-300, 1e300])).all()


def test_the_error_of_a_slope():
    """Against that of many fits."""
    x, error = np.array([16, 64, 256]), 0.02
    rng = np.random.default_rng(1)
    slopes = [fit_power_law(x, np.exp(error * rng.standard_normal(3)) / x).slope for _ in range(2000)]
    law = fit_power_law(x, 1 / x, error / x)
    assert law.slope_error == pytest.approx(np.std(slopes), rel=0.1)
    assert fit_power_law(x, 1 / x).slope_error == 0
