"""Samples for an error: known power laws, between and beyond the measurements."""

import math

import pytest

from voroquad.results.equal_error import samples_for_error

N = [16, 64, 256]


@pytest.mark.parametrize("slope", [-1.0, -1.5, -4.0])
@pytest.mark.parametrize(("n", "extrapolated"), [(16, False), (40, False), (256, False), (3, True), (5000, True)])
def test_a_power_law_is_inverted(slope, n, extrapolated):
    found = samples_for_error(N, [7 * m**slope for m in N], 7 * n**slope)
    assert found.n == pytest.approx(n, rel=1e-9)
    assert found.extrapolated is extrapolated or n in (16, 256)  # at an end, rounding may put it beyond


def test_between_measurements_the_neighbours_count_alone():
    assert samples_for_error(N, [1.0, 0.1, 0.09], 1.0 / 10**0.5).n == pytest.approx(32)


def test_beyond_them_it_goes_on_from_the_nearest():
    """At the fitted slope, −1 here: a quarter of the last error takes four times its samples."""
    mse = [1.0, 0.5, 1 / 16]
    assert samples_for_error(N, mse, mse[-1] / 4).n == pytest.approx(4 * 256)


def test_noise_upwards_does_not_count():
    assert samples_for_error(N, [1.0, 0.1, 0.2], 0.1).n == pytest.approx(64)


def test_what_cannot_be_known_is_nan():
    assert samples_for_error([64], [0.1], 0.1).n == 64
    assert math.isnan(samples_for_error([64], [0.1], 0.05).n)
    assert math.isnan(samples_for_error(N, [0.1, 0.2, 0.4], 0.05).n)
