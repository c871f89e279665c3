"""Errors after a blur: what it leaves of independent errors, and of errors that cancel."""

from __future__ import annotations

import numpy as np
import pytest

from voroquad.mitsuba.blend import checkerboard
from voroquad.mitsuba.measurements import BLURS, blurred_mse, left_by_blur


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
