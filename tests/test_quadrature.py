"""vq.quad: values, errors, conventions."""

import math
import warnings

import numpy as np
import pytest

import voroquad as vq
from voroquad.quadrature import largest_grid, with_uncertainty
from voroquad.study.genz import instances


def test_a_smooth_integral_in_two_dimensions():
    exact = sum(2 ** (k + 1) / ((k + 1) ** 2 * math.factorial(k)) for k in range(30))
    r = vq.quad(lambda x: np.exp(x[0] * x[1]), [0, 0], [1, 2], rng=7)
    assert abs(r.integral - exact) < 6e-8
    assert 0 < r.standard_error < 6e-8
    assert r.n_evaluations == 1024
    by_order = vq.quad(lambda x: np.exp(x[0] * x[1]), [0, 0], [1, 2], order=8, rng=7)
    assert abs(by_order.integral - exact) < 1e-8


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_at_most_n_points_on_a_near_cubic_grid(d):
    for n in [1, 2, 3, 7, 30, 100, 128, 500, 1000, 2048]:
        shape = largest_grid(n, d)
        assert 0.5 * n - 2**d < math.prod(shape) <= n
        assert max(shape) - min(shape) <= 2
        assert vq.quad(lambda x: x[0], np.zeros(d), np.ones(d), n_points=n, rng=1).n_evaluations == math.prod(shape)


def test_limits_and_signs_as_usual():
    def f(x):
        return np.exp(-x[0]) * x[1]

    exact = (1 - np.exp(-2)) * 4
    assert vq.quad(f, [0, 1], [2, 3], rng=1).integral == pytest.approx(exact, rel=1e-9)
    assert vq.quad(f, [2, 1], [0, 3], rng=1).integral == pytest.approx(-exact, rel=1e-9)
    assert vq.quad(f, [2, 3], [0, 1], rng=1).integral == pytest.approx(exact, rel=1e-9)
    assert vq.quad(f, [0, 1], [0, 3], rng=1).integral == 0


@pytest.mark.parametrize(
    ("f", "a", "b", "exact"),
    [
        (lambda x: np.exp(-(x[0] ** 2)), -np.inf, np.inf, math.sqrt(math.pi)),
        (lambda x: np.exp(-x[0]), 1, np.inf, math.exp(-1)),
        (lambda x: np.exp(2 * x[0]), -np.inf, 0, 0.5),
        (lambda x: np.exp(-(x**2).sum(axis=0)), [-np.inf, 0], [np.inf, np.inf], math.pi / 2),
    ],
)
def test_infinite_limits(f, a, b, exact):
    r = vq.quad(f, a, b, n_points=2048, rng=3)
    assert abs(r.integral - exact) < 1e-3
    assert abs(r.integral - exact) < 5 * r.standard_error


def test_vector_values_are_integrated_together():
    def f(x):
        return np.stack([[x[0], x[0] * x[1]], [x[1] ** 2, np.ones_like(x[0])]])

    r = vq.quad(f, [0, 0], [1, 1], rng=1)
    np.testing.assert_allclose(r.integral, [[1 / 2, 1 / 4], [1 / 3, 1]], atol=1e-13)
    assert np.shape(r.standard_error) == (2, 2)
    low, high = vq.quad(lambda x: np.exp(f(x)), [0, 0], [1, 1], rng=1).confidence_interval(0.9)
    assert (low < high).all()
    one = vq.quad(lambda x: f(x)[0, 1], [0, 0], [1, 1], rng=1)
    assert one.integral == r.integral[0, 1]


def test_several_estimates_are_averaged():
    r = vq.quad(lambda x: np.exp(x[0]), 0, 1, n_points=20, n_estimates=10, rng=1)
    assert r.n_evaluations == 200
    assert r.degrees_of_freedom == 9
    assert abs(r.integral - (math.e - 1)) < 5 * r.standard_error < 1e-4


def test_the_same_seed_gives_the_same_bits():
    f = next(instances(2, 1, 3))
    results = [vq.quad(f, [0, 0], [1, 1], rng=5, threads=t) for t in (1, 2, 3)]
    assert len({r.integral for r in results}) == 1
    assert len({r.standard_error for r in results}) == 1
    assert vq.quad(f, [0, 0], [1, 1], rng=6).integral != results[0].integral


@pytest.mark.statistical
@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_unbiased_with_a_jump(d):
    f = next(i for i in instances(d, 1, 8) if i.name == "half-plane")
    r = vq.quad(lambda x: f(x) + x[0], np.zeros(d), np.ones(d), n_points=20, n_estimates=4000, rng=8)
    assert abs(r.integral - f.integral - 0.5) < 5.5 * r.standard_error  # 0.1 standard deviations of one: 6.3


# ---------------------------------------------------------------------- what it says


def test_prints_a_value_with_its_uncertainty():
    assert with_uncertainty(2.666131, 0.000042) == "2.66613(4)"
    assert with_uncertainty(2.666131, 0.000014) == "2.666131(14)"
    assert with_uncertainty(0.0, 0.03) == "0.00(3)"
    assert with_uncertainty(99.96, 0.096) == "100.0(1)"
    assert with_uncertainty(5231, 120) == "5230(120)"
    assert with_uncertainty(-3.2e-9, 4e-11) == "-3.20(4)e-09"
    assert with_uncertainty(1.5, 0.0) == "1.5"
    assert with_uncertainty(math.nan, 1.0) == "nan(1)"
    r = vq.quad(lambda x: (x[0] < 0.3) + 0.0 * x[0], 0, 1, rng=1)
    assert str(r).startswith("0.")
    assert "standard_error" in repr(r)


def test_warns_of_values_that_are_not_finite_and_names_the_point():
    def f(x):
        return np.where(x[0] < 0.25, np.nan, x[0])

    with pytest.warns(vq.IntegrationWarning, match=r"not finite at 256 of 1024 points, the first x = \[0.00"):
        assert math.isnan(vq.quad(f, 0, 1, rng=1).integral)


def test_warns_of_a_peak_that_is_narrower_than_a_stratum():
    def f(x):
        return 1 / (1e-6 + ((x - 0.475) ** 2).sum(axis=0))

    with pytest.warns(vq.IntegrationWarning, match=r"one stratum, at x = \[0\.4"):
        vq.quad(f, [0, 0], [1, 1], n_points=400, rng=2)


def test_does_not_warn_of_the_corners_of_a_smooth_integrand():
    warnings.simplefilter("error")  # undone after each test
    for seed in range(20):
        vq.quad(lambda x: np.cos(3 * x[0] + 2 * x[1]), [0, 0], [1, 1], n_points=256, rng=seed)


def test_accepts_a_func_of_one_point_with_a_warning():
    with pytest.warns(vq.IntegrationWarning, match="point by point"):
        r = vq.quad(lambda x: math.exp(x[0]), 0, 1, rng=1)
    assert r.integral == pytest.approx(math.e - 1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"a": np.nan}, "a must be numbers"),
        ({"a": "x"}, "a must be numbers"),
        ({"b": [[1, 2]]}, "shape"),
        ({"n_points": 0}, "n_points must be a whole number of at least 1"),
        ({"n_estimates": 1.5}, "n_estimates"),
        ({"sampler": "latin"}, "unknown sampler 'latin'"),
        ({"order": "high"}, "order must be"),
        ({"order": 9}, "order must be a whole number from 0 to 8"),
        ({"debias": "magic"}, "unknown debias 'magic'"),
        ({"func": lambda x: np.ones(3)}, "func must return shape"),
        ({"func": lambda x: x[0] * 1j}, "real"),
    ],
)
def test_bad_arguments_are_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        vq.quad(**{"func": lambda x: x[0], "a": 0, "b": 1} | arguments)


# ---------------------------------------------------------------------- tolerance, workers, libraries


@pytest.mark.parametrize(("family", "rtol"), [("gaussian", 1e-3), ("kink", 1e-3), ("half-plane", 1e-2)])
def test_refines_until_the_interval_is_small_enough(family, rtol):
    f = next(i for i in instances(2, 1, 3) if i.name == family)
    r = vq.quad(f, [0, 0], [1, 1], n_points=64, rtol=rtol, rng=1)
    low, high = r.confidence_interval()
    assert (high - low) / 2 <= rtol * abs(r.integral)
    assert abs(r.integral - f.integral) < 3 * rtol * abs(f.integral)
    assert r.n_evaluations < 1_000_000


def test_says_when_the_budget_is_too_small():
    with pytest.warns(vq.IntegrationWarning, match=r"times as wide as the tolerance allows after \d+ evaluations"):
        r = vq.quad(lambda x: (x.sum(axis=0) < 0.9) * 1.0, [0, 0], [1, 1], atol=1e-7, max_evaluations=3000, rng=1)
    assert 1500 < r.n_evaluations <= 3000


@pytest.mark.slow
@pytest.mark.statistical
@pytest.mark.filterwarnings("ignore::voroquad.IntegrationWarning")
def test_stopping_on_the_error_leaves_no_bias(z_score):
    # A bump that few points find: a set that misses it looks exact
    def f(x):
        return np.exp(-(((x[0] - 0.5) / 0.02) ** 2))

    many = [vq.quad(f, 0, 1, n_points=12, atol=1e-3, max_evaluations=200, rng=s).integral for s in range(4000)]
    assert abs(z_score(np.array(many), 0.02 * math.sqrt(math.pi))) < 5.5


def test_workers_change_nothing():
    f = next(instances(2, 1, 3))
    alone = vq.quad(f, [0, 0], [1, 1], rng=5)
    assert vq.quad(f, [0, 0], [1, 1], rng=5, workers=map).integral == alone.integral
    one, two = (vq.quad(_norm, [0, 0], [1, 1], rng=5, workers=workers) for workers in (1, 2))
    assert one.integral == two.integral


def _norm(x):
    return np.sqrt((x**2).sum(axis=0))


def test_results_come_in_the_callers_array_library():
    strict = pytest.importorskip("array_api_strict")
    a, b = strict.zeros(2), strict.ones(2)

    def f(x):
        assert isinstance(x, type(a))
        return strict.exp(x[0, :] + x[1, :])

    r = vq.quad(f, a, b, rng=1)
    assert isinstance(r.integral, type(a))
    assert float(r.integral) == pytest.approx((math.e - 1) ** 2)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rtol": -1}, "rtol must be a number of at least 0"),
        ({"rtol": 0.0}, "both 0"),
        ({"atol": "small"}, "atol must be"),
        ({"rtol": 0.1, "max_evaluations": 0}, "max_evaluations"),
        ({"workers": 0}, "workers"),
    ],
)
def test_bad_tolerances_and_workers_are_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        vq.quad(lambda x: x[0], 0, 1, **arguments)
