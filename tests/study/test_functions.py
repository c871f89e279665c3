import numpy as np
import pytest
from scipy import integrate

from voroquad.study.functions import (
    INTEGRANDS,
    INTEGRANDS_1D,
    TALK_INTEGRAL,
    gauss_legendre_square,
    half_plane_moment,
    talk_profile,
)

BREAKS = [0.25, 1 / 3, 0.5, 0.55, 0.65, 0.7, 0.8, 0.9]


@pytest.mark.parametrize("f", INTEGRANDS_1D, ids=lambda f: f.name)
def test_integrals_in_1d(f):
    value, _ = integrate.quad(lambda x: float(f.values(np.array([[x]]))[0]), 0, 1, points=BREAKS, epsabs=1e-13)
    assert f.integral == pytest.approx(value, abs=1e-12)


def test_the_talks_integral():
    assert round(TALK_INTEGRAL, 5) == 2.66613


def test_the_talks_function_as_the_slide_prints_it():
    def slide(x):
        if x <= 0.25:
            return 10 * np.sqrt(-(x**2) + 0.5 * x)
        if x <= 0.5:
            return 10 * (-np.sqrt(-(x**2) + x - 0.1875) + 0.25)
        if x <= 0.55:
            return 10 * 20 * (x - 0.5)
        if x <= 0.65:
            return 10.0
        if x <= 0.7:
            return 10 * -20 * (x - 0.7)
        height, start = next((h, s) for e, h, s in [(0.8, 0.1, 0.7), (0.9, 0.25, 0.8), (1, 0.5, 0.9)] if x <= e)
        return 10 * height * np.sin(10 * np.pi * (x - start))

    x = (np.arange(1000) + 0.5) / 1000
    np.testing.assert_allclose(talk_profile(x), [slide(t) for t in x], atol=1e-12)


@pytest.mark.parametrize("name", ["talk-2d", "smooth-2d", "kink-2d", "jump-2d"])
def test_integrals_in_2d(name):
    f = INTEGRANDS[name]
    n = 1000
    x = (np.arange(n) + 0.5) / n
    midpoint = f.values(np.stack(np.meshgrid(x, x), axis=-1)).mean()
    # The midpoint rule errs by h² on a smooth f and by about h^(3/2) on a jump or a vertical tangent
    assert f.integral == pytest.approx(midpoint, rel=1e-4)


def test_gauss_legendre_is_converged():
    f = INTEGRANDS["smooth-2d"].values
    assert gauss_legendre_square(f, 32) == pytest.approx(gauss_legendre_square(f, 64), abs=1e-13)


@pytest.mark.parametrize(("a", "b", "c"), [(1, 0.6, 0.7), (1, 0.6, 1.1), (-1, 2, 0.3), (-0.5, -1, -0.8)])
def test_half_plane_moments(a, b, c):
    area, _ = integrate.quad(lambda x: np.clip(np.sign(b) * ((c - a * x) / b - (b > 0)), -1, 0) * -1, 0, 1, limit=200)
    assert half_plane_moment(a, b, c, 0) == pytest.approx(area, abs=1e-6)
    x = (np.arange(1000) + 0.5) / 1000
    volume = np.maximum(0, a * x[:, None] + b * x - c).mean()
    assert half_plane_moment(a, b, c, 1) == pytest.approx(volume, abs=1e-6)
