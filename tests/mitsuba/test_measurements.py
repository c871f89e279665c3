"""Errors after a blur: what it leaves of independent errors, and of errors that cancel."""

from __future__ import annotations

import numpy as np
import pytest

from voroquad.mitsuba.blend import checkerboard
from voroquad.mitsuba.measurements import BLURS, blurred_mse, error_spectrum, left_by_blur


@pytest.mark.parametrize("sigma", BLURS)
def test_a_blur_leaves_its_part_of_independent_errors(sigma):
    error = np.random.default_rng(1).standard_normal((300, 400, 3))
    assert blurred_mse(error, sigma) == pytest.approx(left_by_blur(sigma) * (error**2).mean(), rel=0.05)


@pytest.mark.parametrize("sigma", BLURS)
def test_a_blur_leaves_constant_errors_and_cancels_those_of_a_checkerboard(sigma):
    ones = np.ones((20, 30, 3))
    assert blurred_mse(0.5 * ones, sigma) == pytest.approx(0.25)
    board = (2.0 * checkerboard(20, 30, 0) - 1)[..., None] * ones
    assert blurred_mse(board, sigma) < 1e-2 * left_by_blur(sigma)


def test_channels_do_not_blur_into_each_other():
    error = np.zeros((20, 30, 3))
    error[..., 1] = 1
    assert blurred_mse(error, 3.0) == pytest.approx(1 / 3)


def test_independent_errors_have_their_mse_at_all_frequencies():
    error = 0.3 * np.random.default_rng(2).standard_normal((120, 160, 3))
    frequency, power = error_spectrum(error)
    assert len(frequency) == 16
    assert (np.diff(frequency) > 0).all()
    assert frequency[-1] < 0.5
    np.testing.assert_allclose(power[1:], 0.09, rtol=0.15)


def test_a_wave_has_its_power_at_its_frequency_alone():
    """Of amplitude a in N pixels: a² N / 4 at each of ±f, in the mean over the frequencies of the band."""
    wave = np.sin(2 * np.pi * 0.25 * np.arange(64))[None, :, None] * np.ones((32, 64, 1))
    _, power = error_spectrum(wave)
    band = int(0.25 * 32)
    f = np.hypot(np.fft.fftfreq(32)[:, None], np.fft.fftfreq(64))
    number = ((f >= 8 / 32) & (f < 9 / 32)).sum()
    assert power[band] == pytest.approx(2 * 32 * 64 / 4 / number)
    assert np.delete(power, band).max() < 1e-20
    assert error_spectrum(np.ones((20, 30, 3)))[1].max() < 1e-20  # the mean error is left out


def test_small_images_have_fewer_bands():
    frequency, power = error_spectrum(np.random.default_rng(3).standard_normal((4, 6, 3)))
    assert 2 <= len(frequency) == len(power) < 16
