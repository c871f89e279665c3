"""Spreads and norms of numbers of any size."""

import numpy as np
import pytest

from voroquad.integrals.units import deviation, norm, scaled


@pytest.mark.parametrize("power", [-1000, 0, 1000])
def test_spreads_and_norms_have_the_bits_of_numbers_of_moderate_size(power):
    values = 1 + np.random.default_rng(2).random((4, 5))
    given = np.ldexp(values, power)
    for axis in (0, 1, -1):
        np.testing.assert_array_equal(deviation(given, axis), np.ldexp(values.std(axis=axis, ddof=1), power))
        root = np.sqrt(np.square(values).sum(axis=axis))
        np.testing.assert_array_equal(norm(given, axis), np.ldexp(root, power))
        assert np.abs(scaled(given, axis)).max() < 1


def test_what_is_not_finite_stays_so_and_0_is_0():
    values = np.array([[np.nan, 1.0], [0.0, 0.0]])
    np.testing.assert_array_equal(deviation(values, 1), [np.nan, 0])
    np.testing.assert_array_equal(norm(values, 1), [np.nan, 0])
