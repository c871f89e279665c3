"""vq.quad: values, errors, conventions."""

import functools
import math
import warnings
from itertools import combinations

import numpy as np
import pytest
from scipy.stats import qmc

import voroquad as vq
from voroquad.designs.grids import largest_grid
from voroquad.study.genz import instances


def test_a_smooth_integral_in_two_dimensions():
    exact = sum(2 ** (k + 1) / ((k + 1) ** 2 * math.factorial(k)) for k in range(30))
    r = vq.quad(lambda x: np.exp(x[0] * x[1]), [0, 0], [1, 2], rng=7)
    assert abs(r.integral - exact) < 6e-8
    assert 0 < r.standard_error < 4e-8
    assert r.n_evaluations == 1024
    by_order = vq.quad(lambda x: np.exp(x[0] * x[1]), [0, 0], [1, 2], order=8, rng=7)
    assert abs(by_order.integral - exact) < 1e-8


def test_rounding_is_no_surprise():
    """Where a polynomial that is integrated exactly nearly vanishes, rounding is larger than its value."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for seed in range(12):
            r = vq.quad(lambda x: np.stack([x[0] ** 8, x[0] ** 5 * x[1] ** 4]), [0, 0], [1, 1], rng=seed)
            np.testing.assert_allclose(r.integral, [1 / 9, 1 / 30], rtol=1e-13)


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_at_most_n_points_on_a_near_cubic_grid(d):
    for n in [1, 2, 3, 7, 30, 100, 128, 500, 1000, 2048]:
        shape = largest_grid(n, d)
        assert 0.5 * n - 2**d < math.prod(shape) <= n
        assert max(shape) - min(shape) <= 2
        r = vq.quad(lambda x: x[0], np.zeros(d), np.ones(d), n_points=n, adapt=False, rng=1)
        assert r.n_evaluations == math.prod(shape)


@pytest.mark.parametrize(
    ("sampler", "debias", "evaluations"),
    [("stratified", "none", 960), ("orthogonal", "auto", 4 * 169), ("sobol", "auto", 1004), ("uniform", "none", 1004)],
)
def test_replicates_have_a_size_that_the_sampler_has(sampler, debias, evaluations):
    r = vq.quad(lambda x: x[0] * x[1], [0, 0], [1, 1], n_points=1004, sampler=sampler, debias=debias, rng=1)
    assert r.n_evaluations == evaluations
    assert abs(r.integral - 1 / 4) < 8 * r.standard_error + 1e-14


def test_orthogonal_arrays_are_refined():
    r = vq.quad(lambda x: (x.sum(axis=0) < 0.9) * 1.0, [0, 0], [1, 1], sampler="orthogonal", rtol=1e-2, rng=1)
    assert r.integral == pytest.approx(0.405, rel=2e-2)


@pytest.mark.parametrize("kind", [{"sampler": "regular"}, {"sampler": "regular", "debias": "none"}])
def test_a_design_that_is_not_random_has_no_error(kind):
    with pytest.raises(ValueError, match=r"and those of 'regular' are not; choose one of uniform, stratified, .*sobol"):
        vq.quad(lambda x: x[0], [0, 0], [1, 1], **kind)


class CentresOfCells(qmc.QMCEngine):
    """A Latin hypercube of the centres of cells: random, but no point is uniform."""

    def __init__(self, d, *, rng=None):
        super().__init__(d=d, rng=rng)

    def _random(self, n=1, *, workers=1):
        return np.stack([(self.rng.permutation(n) + 0.5) / n for _ in range(self.d)], axis=-1)


@pytest.mark.parametrize(
    ("sampler", "message"),
    [
        (functools.partial(qmc.Sobol, scramble=False), "two of 4 sets have the same points"),
        (
            functools.partial(qmc.LatinHypercube, scramble=False),
            r"those of 'latinhypercube \(scramble=False\)' are not",
        ),
        (functools.partial(qmc.Sobol, optimization="lloyd"), r"those of 'sobol \(optimization\)' are not"),
        (functools.partial(qmc.Halton, optimization="random-cd"), r"those of 'halton \(optimization\)' are not"),
        (functools.partial(qmc.PoissonDisk, radius=0.01), "those of 'poissondisk' are not"),
        (lambda d, rng: qmc.PoissonDisk(d, radius=0.01, rng=rng), "those of 'poissondisk' are not"),
        (CentresOfCells, r"those of 'engine \(on a lattice\)' are not; choose one of .* an engine that scrambles its"),
    ],
)
def test_an_engine_whose_points_are_not_random_has_no_error(sampler, message):
    with pytest.raises(ValueError, match=message):
        vq.quad(lambda x: np.exp(x[0]), [0, 0], [1, 1], n_points=64, sampler=sampler, rng=1)


class Jittered(CentresOfCells):
    def _random(self, n=1, *, workers=1):
        return super()._random(n) + (self.rng.random((n, self.d)) - 0.5) / n


@pytest.mark.parametrize(
    "sampler",
    [
        qmc.Sobol,
        functools.partial(qmc.Sobol, bits=50),
        functools.partial(qmc.Halton, scramble=True),
        functools.partial(qmc.LatinHypercube, strength=1),
        lambda d, rng: qmc.LatinHypercube(d, rng=rng),
        Jittered,
    ],
)
def test_engines_that_are_random_have_one(sampler):
    r = vq.quad(lambda x: np.exp(x[0]), [0, 0], [1, 1], n_points=256, sampler=sampler, rng=1)
    assert abs(r.integral - math.e + 1) < 8 * r.standard_error < 1e-2


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


@pytest.mark.parametrize(("a", "b"), [(np.inf, np.inf), (-np.inf, -np.inf), ([0, np.inf], [1, np.inf]), (2, 2)])
def test_an_empty_interval_holds_nothing(a, b):
    r = vq.quad(lambda x: np.exp(-(x**2).sum(axis=0)), a, b, rng=3)
    assert (r.integral, r.standard_error) == (0, 0)


@pytest.mark.parametrize(("a", "b"), [(-np.inf, np.inf), (1, np.inf), (-np.inf, 0), ([-np.inf, 0], [np.inf, 1])])
def test_the_sign_of_infinite_limits(a, b):
    def f(x):
        return np.exp(-(x**2).sum(axis=0))

    assert vq.quad(f, b, a, rng=3).integral == (-1) ** np.size(a) * vq.quad(f, a, b, rng=3).integral


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


@pytest.mark.parametrize("sets", [2, 5])
def test_the_spread_of_several_estimates_is_an_unbiased_variance(sets):
    """Of estimates that are single values: with two, the standard error is half their distance."""
    seen = []

    def f(x):
        seen.append(np.exp(3 * x[0]))
        return seen[-1]

    r = vq.quad(f, 0, 1, sampler="stratified", n_points=1, n_estimates=sets, rng=1)
    (values,) = seen
    pairs = [(u - v) ** 2 / 2 for u, v in combinations(values, 2)]  # each has the mean Var f
    assert r.integral == pytest.approx(values.mean(), rel=1e-14)
    assert r.standard_error == pytest.approx(math.sqrt(np.mean(pairs) / sets), rel=1e-12)


@pytest.mark.parametrize(("n", "d", "order", "fitted"), [(9, 1, 8, 4), (64, 2, 8, 7), (4, 1, 8, 1)])
def test_an_order_that_is_too_high_is_the_highest_that_the_samples_support(n, d, order, fitted):
    """In value and in error: the error scale is that of the fit."""
    results = [
        vq.quad(lambda x: np.exp(x.sum(axis=0)), [0] * d, [1] * d, n_points=n, order=p, rng=1) for p in (order, fitted)
    ]
    assert results[0].integral == results[1].integral
    assert results[0].standard_error == results[1].standard_error


@pytest.mark.statistical
@pytest.mark.filterwarnings("ignore::voroquad.IntegrationWarning")
@pytest.mark.parametrize(
    ("d", "n", "seeds", "least"),
    [(1, 64, 60, 0.92), (2, 100, 60, 0.945), (2, 1156, 10, 0.93), (3, 125, 60, 0.94), (6, 256, 40, 0.89)],
)
def test_intervals_hold_the_integral(d, n, seeds, least):
    """Of random members of the families, but for jumps along the axes, which small sets miss whole.

    The 95 % intervals hold .97 to .99 of them, in six dimensions .94, six to nine standard errors above `least`; half
    as wide, they hold .78 to .89.
    """
    functions = [f for f in instances(d, 3, rng=[d, 7]) if f.name != "jump"]
    truth = np.array([f.integral for f in functions])
    held = []
    for seed in range(seeds):
        r = vq.quad(lambda x: np.stack([f(x) for f in functions]), [0] * d, [1] * d, n_points=n, rng=seed)
        held.append((np.abs(r.integral - truth) <= r.confidence_interval().high - r.integral).mean())
    assert np.mean(held) > least


def test_the_same_seed_gives_the_same_bits():
    f = next(instances(2, 1, 3))
    results = [vq.quad(f, [0, 0], [1, 1], rng=5, threads=t) for t in (1, 2, 3)]
    assert len({r.integral for r in results}) == 1
    assert len({r.standard_error for r in results}) == 1
    assert vq.quad(f, [0, 0], [1, 1], rng=6).integral != results[0].integral


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("d", "n", "order"),
    [
        *((d, n, "auto") for d, n in ((2, 3), (3, 7), (4, 15))),
        (1, 20, 3),
        *((d, 20, "kriging") for d in (2, 3, 4)),
        *(pytest.param(d, 20, "auto", marks=pytest.mark.slow) for d in (1, 2, 3, 4)),  # choose a model in each set
    ],
)
def test_unbiased_with_a_jump(d, n, order):
    f = next(i for i in instances(d, 1, 8) if i.name == "half-plane")
    r = vq.quad(lambda x: f(x) + x[0], np.zeros(d), np.ones(d), n_points=n, n_estimates=4000, order=order, rng=8)
    assert abs(r.integral - f.integral - 0.5) < 5.5 * r.standard_error  # 0.1 standard deviations of one: 6.3


# ---------------------------------------------------------------------- what it says


def test_warns_of_values_that_are_not_finite_and_names_the_point():
    def f(x):
        return np.where(x[0] < 0.25, np.nan, x[0])

    with pytest.warns(vq.IntegrationWarning, match="func is not finite everywhere, so the integral is NaN"):
        r = vq.quad(f, 0, 1, rng=1)
    assert math.isnan(r.integral)
    assert (r.warnings[0].details["points"], r.warnings[0].details["of"]) == (256, 1024)
    assert 0 < r.warnings[0].details["first_x"][0] < 0.01


@pytest.mark.parametrize("order", ["kriging", 3])
def test_infinite_values_are_one_warning_of_ours(order):
    warnings.simplefilter("error", RuntimeWarning)  # undone after each test
    with pytest.warns(vq.IntegrationWarning, match="not finite") as caught:
        r = vq.quad(lambda x: np.where(x[0] < 0.01, np.inf, 1), [0, 0], [1, 1], order=order, rng=1)
    assert len(caught) == 1
    assert caught[0].message.details["points"] == 11
    assert math.isnan(r.integral)


def test_a_product_with_the_volume_that_is_not_finite_is_named():
    with pytest.warns(vq.IntegrationWarning, match="not finite"):
        assert math.isnan(vq.quad(lambda x: np.full(x.shape[1], 1e300), 0, 1e300, rng=1).integral)


def test_warnings_point_at_the_callers_line():
    def one_point(x):
        return float(x[0])

    for call in (
        lambda: vq.quad(lambda x: 1 / (x[0] - x[0]), 0, 1, rng=1),
        lambda: vq.quad(
            lambda x: 1 / (1e-6 + ((x - 0.475) ** 2).sum(axis=0)), [0, 0], [1, 1], n_points=400, order=2, rng=2
        ),
        lambda: vq.quad(lambda x: x[0], [0] * 5, [1] * 5, n_points=4, rng=2),
        lambda: vq.quad(lambda x: x[0] > 0.3, 0, 1, atol=1e-9, max_evaluations=3000, rng=2),
        lambda: vq.quad(one_point, 0, 1, n_points=4, rng=2),
    ):
        with np.errstate(all="ignore"), pytest.warns(vq.IntegrationWarning) as caught:
            call()
        assert {w.filename for w in caught} == {__file__}


@pytest.mark.parametrize("options", [{"a": [0] * 5, "b": [1] * 5}, {"sampler": "sobol"}])
def test_warns_of_a_single_set_without_an_error(options):
    with pytest.warns(
        vq.IntegrationWarning, match="a single set of points has no standard error; take n_points of at least 8"
    ):
        r = vq.quad(**{"func": lambda x: x[0], "a": 0, "b": 1, "n_points": 7, "rng": 1} | options)
    assert math.isnan(r.standard_error)


def test_a_fixed_rule_warns_of_a_peak_that_is_narrower_than_a_stratum():
    def f(x):
        return 1 / (1e-6 + ((x - 0.475) ** 2).sum(axis=0))

    with pytest.warns(vq.IntegrationWarning, match="a single stratum") as caught:
        r = vq.quad(f, [0, 0], [1, 1], n_points=400, order=2, rng=2)
    assert caught[0].message.details["x"] == pytest.approx([0.475, 0.475], abs=0.05)
    assert not r.success


def test_does_not_warn_of_the_corners_of_a_smooth_integrand():
    warnings.simplefilter("error")  # undone after each test
    for seed in range(20):
        vq.quad(lambda x: np.cos(3 * x[0] + 2 * x[1]), [0, 0], [1, 1], n_points=256, rng=seed)


def test_accepts_a_func_of_one_point_with_a_warning():
    with pytest.warns(vq.IntegrationWarning, match="point by point"):
        r = vq.quad(lambda x: math.exp(x[0]), 0, 1, rng=1)
    assert r.integral == pytest.approx(math.e - 1)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "qrng",
            r"quad has no qrng=; write sampler=qmc.Sobol \(the class, or functools.partial of it .* rng= the seed",
        ),
        ("log", r"quad has no log=; write quad\(lambda x: np.exp\(g\(x\) - c\), a, b\)"),
        ("complex_func", "quad has no complex_func=; write nothing: complex values are integrated as they are"),
        ("neval", "quad has no neval=; write n_points="),
        ("epsabs", "quad has no epsabs=; write atol="),
        ("seed", "quad has no seed=; write rng="),
        ("banana", "unexpected keyword argument 'banana'"),
    ],
)
def test_tells_what_to_write_in_place_of_scipys_arguments(name, message):
    with pytest.raises(TypeError, match=message):
        vq.quad(lambda x: x[0], 0, 1, **{name: 1})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"a": np.nan}, "a must be numbers"),
        ({"a": "x"}, "a must be an array of numbers, got 'x'"),
        ({"a": "0"}, "a must be an array of numbers, got '0'"),
        ({"b": [[1, 2]]}, "shape"),
        ({"n_points": 0}, "n_points must be a whole number of at least 1"),
        ({"n_estimates": 1.5}, "n_estimates"),
        ({"sampler": "latin"}, "unknown sampler 'latin'"),
        ({"order": "high"}, "order must be"),
        ({"order": 9}, "order must be a whole number from 0 to 8"),
        ({"debias": "magic"}, "unknown debias 'magic'"),
        ({"func": lambda x: np.ones(3)}, "func must return shape"),
        ({"func": lambda x: np.empty((0, x.shape[1]))}, r"func must return one component or more, got shape \(0, 1024"),
        ({"order": True}, "order must be a whole number"),
        ({"a": [0, 0], "b": [1, 1, 1]}, "a and b must have a number for each dimension, got 2 and 3"),
        ({"a": -1e308, "b": 1e308}, "a and b: the box is too large"),
        ({"a": [0, 0], "b": [1e200, 1e200]}, "a and b: the box is too large"),
        ({"a": [0] * 3, "b": [1e-150] * 3}, "a and b: the volume of the box is too small"),
        ({"n_points": 10**30}, r"n_points must be at most 2\^63 - 1, got 1000"),
        ({"vectorized": "no"}, "vectorized must be True or False, got 'no'"),
        ({"progress": "yes"}, "progress must be True or False, got 'yes'"),
        ({"store": 3}, "store must be a folder or another path of fsspec, such as 'runs/wing', got 3"),
        ({"sampler": lambda d, rng: 3}, "sampler must make an engine of scipy.stats.qmc from .* got 3"),
        ({"rng": -1}, "rng: a seed must be at least 0, got -1"),
        ({"sampler": qmc.Sobol(1)}, r"pass the class, sampler=qmc.Sobol, or with options functools.partial"),
        ({"sampler": "orthogonal", "n_points": 8}, "at least n = 4 samples in d = 1, .* at most 2; raise n_points"),
    ],
)
def test_bad_arguments_are_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        vq.quad(**{"func": lambda x: x[0], "a": 0, "b": 1} | arguments)


# ---------------------------------------------------------------------- tolerance, workers, libraries


@pytest.mark.parametrize(("family", "rtol"), [("gaussian", 1e-6), ("kink", 1e-3), ("half-plane", 1e-2)])
def test_refines_until_the_interval_is_small_enough(family, rtol):
    f = next(i for i in instances(2, 1, 3) if i.name == family)
    r = vq.quad(f, [0, 0], [1, 1], n_points=64, rtol=rtol, rng=1)
    low, high = r.confidence_interval()
    assert (high - low) / 2 <= rtol * abs(r.integral)
    assert abs(r.integral - f.integral) < 3 * rtol * abs(f.integral)
    assert r.n_evaluations < 1_000_000


def test_says_when_the_budget_is_too_small():
    with pytest.warns(vq.IntegrationWarning, match="the tolerance is not met; raise max_evaluations or") as caught:
        r = vq.quad(lambda x: (x.sum(axis=0) < 0.9) * 1.0, [0, 0], [1, 1], atol=1e-7, max_evaluations=3000, rng=1)
    assert 1500 < r.n_evaluations <= 3000
    details = caught[0].message.details
    assert (details["evaluations"], details["of_at_most"]) == (r.n_evaluations, 3000)
    low, high = r.confidence_interval()
    assert details["times_too_wide"] == pytest.approx((high - low) / 2 / 1e-7, rel=0.01)
    assert not r.success


@pytest.mark.slow
@pytest.mark.statistical
@pytest.mark.filterwarnings("ignore::voroquad.IntegrationWarning")
def test_stopping_on_the_error_leaves_no_bias(z_score):
    # A bump that few points find: a set that misses it looks exact
    def f(x):
        return np.exp(-(((x[0] - 0.5) / 0.02) ** 2))

    many = [vq.quad(f, 0, 1, n_points=12, atol=1e-3, max_evaluations=200, rng=s).integral for s in range(4000)]
    assert abs(z_score(np.array(many), 0.02 * math.sqrt(math.pi))) < 5.5


@pytest.mark.filterwarnings("ignore::voroquad.IntegrationWarning")
def test_a_value_that_is_not_finite_meets_no_tolerance_and_ends_the_refinement():
    with pytest.warns(vq.IntegrationWarning, match="func is not finite everywhere, so the integral is NaN"):
        r = vq.quad(lambda x: np.where(x[0] < 0.5, np.nan, 1), 0, 1, rtol=1e-3, rng=1)
    assert math.isnan(r.integral)
    assert r.n_evaluations == 2048


@pytest.mark.filterwarnings("ignore:a single set of points")
def test_a_set_without_an_error_is_refined():
    r = vq.quad(lambda x: np.exp(x[0]), [0] * 5, [1] * 5, n_points=4, rtol=1e-2, rng=1)
    assert r.integral == pytest.approx(math.e - 1, rel=2e-2)


def test_several_estimates_have_the_whole_budget():
    with pytest.warns(vq.IntegrationWarning, match="the tolerance is not met"):
        r = vq.quad(
            lambda x: (x.sum(axis=0) < 0.9) * 1.0, [0, 0], [1, 1], n_estimates=8, atol=1e-9, max_evaluations=10_000,
            rng=1,
        )  # fmt: skip
    assert 5_000 < r.n_evaluations <= 10_000


def test_orders_of_numpy_are_orders():
    results = [vq.quad(lambda x: np.exp(x[0]), 0, 1, order=order, rng=1).integral for order in (3, np.int64(3))]
    assert results[0] == results[1]


def test_workers_change_nothing():
    f = next(instances(2, 1, 3))
    alone = vq.quad(f, [0, 0], [1, 1], rng=5)
    assert vq.quad(f, [0, 0], [1, 1], rng=5, workers=map).integral == alone.integral
    one, two = (vq.quad(_norm, [0, 0], [1, 1], rng=5, workers=workers) for workers in (1, 2))
    assert one.integral == two.integral


def _norm(x):
    return np.sqrt((x**2).sum(axis=0))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rtol": -1}, "rtol must be a number of at least 0"),
        ({"rtol": True}, "rtol must be a number of at least 0, got True"),
        ({"rtol": 0.1, "n_estimates": 8, "max_evaluations": 7}, "max_evaluations must be at least n_estimates = 8"),
        ({"rtol": 0.0}, "both 0"),
        ({"atol": "small"}, "atol must be"),
        ({"rtol": 0.1, "max_evaluations": 0}, "max_evaluations"),
        ({"workers": 0}, "workers"),
    ],
)
def test_bad_tolerances_and_workers_are_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        vq.quad(lambda x: x[0], 0, 1, **arguments)


def test_hundreds_of_dimensions():
    r = vq.quad(lambda x: x[0] + x[-1], [0] * 400, [1] * 400, n_points=256, rng=1)
    assert abs(r.integral - 1) < 5 * max(r.standard_error, 1e-12)
