"""vq.quad of integrands of any size: values and errors scale with them."""

import warnings

import numpy as np
import pytest
from scipy.stats import norm

import voroquad as vq


@pytest.mark.parametrize("power", [-1000, -560, 900])
@pytest.mark.parametrize("options", [{}, {"n_estimates": 3}, {"sampler": "sobol"}, {"sampler": "uniform", "order": 0}])
def test_value_and_error_scale_with_the_integrand(power, options):
    warnings.simplefilter("error")  # undone after each test
    options = options | {"n_points": 256, "rng": 1}
    for f in (lambda x: np.exp(x[0]) + (x[1] > 0.3333), lambda x: np.stack([x[0], 1.0 * (x[0] > 0.3333)])):
        one = vq.quad(f, [0, 0], [1, 1], **options)
        many = vq.quad(lambda x, f=f: np.ldexp(f(x), power), [0, 0], [1, 1], **options)
        np.testing.assert_array_equal(many.integral, np.ldexp(one.integral, power))
        np.testing.assert_array_equal(many.standard_error, np.ldexp(one.standard_error, power))


def peak(x):
    return 2.0**-12 + np.exp(-600 / len(x) ** 2 * ((x - 0.4) ** 2).sum(axis=0))


def kink(x):
    return 1 + np.abs(x.sum(axis=0) - 0.7) + (x[0] > 0.37)


def stopping(progress):
    return progress.n_evaluations >= 300


@pytest.mark.parametrize("power", [-1000, 900])
@pytest.mark.parametrize(
    ("place", "options"),
    [
        ({"measure": vq.PiecewiseUniform([0, 0.5, 1], [300, 300])}, {"n_points": 256}),
        ({"a": [0, 0], "b": [1, 1]}, {"n_points": 8192, "n_estimates": 3}),
        ({"a": [0, 0], "b": [1, 1]}, {"n_points": 512, "n_estimates": 3, "method": "pilot"}),
        ({"a": [0] * 4, "b": [1] * 4}, {"n_points": 512, "n_estimates": 3, "method": "polynomials"}),
        ({"measure": vq.ProductMeasure(*[norm()] * 5)}, {"n_points": 512}),
        ({"a": [0, 0], "b": [1, 1]}, {"n_points": 512, "callback": stopping}),
        ({"a": [0] * 4, "b": [1] * 4}, {"n_points": 512, "method": "polynomials", "callback": stopping}),
        ({"a": [0, 0], "b": [1, 1]}, {"n_points": 1024, "adapt": True}),
        ({"a": [0] * 4, "b": [1] * 4}, {"n_points": 1024, "adapt": "auto"}),
    ],
)
def test_sums_and_spreads_of_estimates_scale_with_the_integrand(power, place, options):
    warnings.simplefilter("error")  # undone after each test
    warnings.filterwarnings("ignore", "the integration was stopped")
    func = peak if "adapt" in options else kink
    one = vq.quad(func, **place, **options, rng=1)
    many = vq.quad(lambda x: np.ldexp(func(x), power), **place, **options, rng=1)
    assert one.standard_error > 1e-9
    assert many.integral == np.ldexp(one.integral, power)
    assert many.standard_error == np.ldexp(one.standard_error, power)
    if "adapt" in options:
        assert many.adaptation.adapted == (place["a"] == [0] * 4)
        assert many.adaptation.concentration == one.adaptation.concentration


def test_components_of_any_size_are_integrated_together():
    def f(x):
        return np.stack([1e-170 * (x[0] > 0.3333), 1e200 * x[0] ** 12])

    r = vq.quad(f, 0, 1, rng=1)
    assert r.standard_error[0] == pytest.approx(4.1e-174, rel=0.1)
    assert abs(r.integral[1] - 1e200 / 13) < 1e190


@pytest.mark.filterwarnings("ignore::voroquad.IntegrationWarning")
def test_a_peak_of_a_tiny_integrand_is_noticed():
    with pytest.warns(vq.IntegrationWarning, match="a single stratum"):
        vq.quad(
            lambda x: 1e-200 / (1e-6 + ((x - 0.475) ** 2).sum(axis=0)), [0, 0], [1, 1], n_points=400, order=2, rng=2
        )
