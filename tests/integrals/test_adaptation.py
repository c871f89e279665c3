"""Maps learned from pilot rounds: they find peaks, and fresh samples keep the estimate unbiased."""

import math

import numpy as np
import pytest
import scipy.stats

import voroquad as vq
from voroquad.integrals.adaptation import Learner, PilotSamples, concentration
from voroquad.integrals.partition import Partition, grow
from voroquad.integrals.separable_map import SeparableMap


def peak(d, sigma=0.03):
    """A Gaussian of this width, the integral of which over the unit box is 1 but for tails of 10⁻¹⁵."""
    center = np.linspace(0.35, 0.6, d)[:, None]
    return lambda x: np.exp(-((x - center) ** 2).sum(axis=0) / (2 * sigma**2)) / (2 * np.pi * sigma**2) ** (d / 2)


NODES = np.stack([np.linspace(0, 1, 25) ** 3, np.sin(np.linspace(0, np.pi / 2, 25))])


def test_samples_of_all_rounds_stand_for_the_box():
    """Σ_i 1/Σ_t n_t p_t(u_i) estimates the volume, 1, and the moments of the box, with a map and a tree."""

    def ones(u):
        return np.ones((1, len(u)))

    rng = np.random.default_rng(1)
    even = rng.random((2, 2000))
    tree = grow(even, np.exp(-(((even[0] - even[1]) / 0.05) ** 2))[None], np.full(2000, 1 / 2000))
    pool = None
    for warp, partition in (
        (SeparableMap.identity(2), Partition.whole(2)),
        (SeparableMap(NODES), Partition.whole(2)),
        (SeparableMap(NODES), tree),
    ):
        pilot = Learner(lambda _: ones, vq.Ball([0, 0]), True, rng)
        u, values, drawn = pilot.draw(warp, partition, 4000)
        if pool is None:
            pool = PilotSamples(u, values, drawn)
        else:
            pool.add(u, values, drawn)
    assert pool.u.shape[1] > 11_500
    assert pool.weights.sum() == pytest.approx(1, abs=0.01)
    np.testing.assert_allclose(pool.u @ pool.weights, [0.5, 0.5], atol=0.01)


@pytest.mark.parametrize(
    ("d", "sigma", "options"),
    [(1, 0.0005, {}), (2, 0.006, {}), (3, 0.02, {}), (4, 0.03, {}), (4, 0.03, {"order": 1}), (6, 0.06, {})],
)
def test_peaks_that_other_rules_miss_are_resolved(d, sigma, options):
    options = {"n_points": 8000 if d > 2 else 3000, "rng": 3} | options
    points = []

    def f(x):
        points.append(x.shape[1])
        return peak(d, sigma)(x)

    r = vq.quad(f, [0] * d, [1] * d, adapt=True, **options)
    assert r.adaptation.adapted
    assert r.n_evaluations == sum(points) <= options["n_points"]
    assert abs(r.integral - 1) < 0.05
    assert abs(r.integral - 1) < 6 * r.standard_error + 1e-9
    nodes = r.adaptation.nodes
    assert ((nodes > 0.1) & (nodes < 0.9)).mean() > 0.8


def test_a_tree_finds_what_no_map_of_the_axes_does():
    def ridge(x):
        return np.exp(-(((x[0] - x[1]) / 0.03) ** 2)) / (math.sqrt(math.pi) * 0.03 - 0.03**2)

    r = vq.quad(ridge, [0] * 4, [1] * 4, n_points=8000, adapt=True, rng=1)
    plain = vq.quad(ridge, [0] * 4, [1] * 4, n_points=8000, method="plain", rng=1)
    assert len(r.adaptation.low) > 50
    assert abs(r.integral - 1) < 4 * r.standard_error
    assert r.standard_error < plain.standard_error / 1.5
    middle = (r.adaptation.low + r.adaptation.high) / 2
    small = np.prod(r.adaptation.high - r.adaptation.low, axis=1) < 1 / 256
    assert np.abs(middle[small, 0] - middle[small, 1]).mean() < 0.15


def test_where_the_plain_grid_sees_the_peak_there_is_no_map():
    r = vq.quad(peak(2), [0, 0], [1, 1], n_points=8000, adapt=True, rng=1)
    assert not r.adaptation.adapted
    assert abs(r.integral - 1) < 1e-4
    assert r.n_evaluations <= 8000


def smooth(d):
    return lambda x: np.exp(x.sum(axis=0) / d)


@pytest.mark.parametrize(
    ("d", "n", "look"), [(4, 1000, 60), (6, 2000, 60), (9, 8000, 240), (3, 3000, 27), (3, 5000, 64)]
)
def test_by_default_a_first_look_finds_peaks(d, n, look):
    def adaptation(f, **options):
        points = []
        r = vq.quad(lambda x: (points.append(x.shape[1]), f(x))[1], [0] * d, [1] * d, n_points=n, rng=1, **options)
        assert r.n_evaluations == sum(points) <= n
        return r.adaptation

    plain = adaptation(smooth(d))
    assert not plain.adapted
    assert 0.9 * look <= plain.n_pilot <= look
    found = adaptation(peak(d, 0.05 if d < 9 else 0.15))
    assert found.n_pilot > plain.n_pilot
    assert found.adapted
    assert adaptation(peak(d), adapt=False) is None


@pytest.mark.parametrize("n", [3375, 4096, 4913])  # cubes, which have as many strata
@pytest.mark.parametrize("func", [lambda x: np.exp(x.sum(axis=0)), lambda x: np.cos(37 * x.sum(axis=0))])
def test_a_coarse_grid_is_part_of_the_budget(n, func):
    """Before the rule for few points where func is smooth, and before the pilot rule where it is rough."""
    points = []

    def counted(x):
        points.append(x.shape[1])
        return func(x)

    r = vq.quad(counted, [0] * 3, [1] * 3, n_points=n, rng=1)
    assert r.n_evaluations == sum(points) <= n
    assert r.adaptation is not None
    assert not r.adaptation.adapted


def test_in_space_a_rough_integrand_gets_the_pilot_rule():
    def rule(f):
        return vq.quad(f, [0] * 3, [1] * 3, n_points=5000, rng=1).rule

    assert rule(peak(3, 0.1)).startswith("pilot grid of 9 × 9 × 9")
    assert not rule(smooth(3)).startswith("pilot")
    both = rule(lambda x: np.stack([smooth(3)(x), peak(3, 0.04)(x)]))
    assert all(one.startswith("pilot") for one in both)
    beside_0 = rule(lambda x: np.stack([smooth(3)(x), 0 * x[0]]))
    assert not any(one.startswith("pilot") for one in beside_0)


@pytest.mark.parametrize(
    ("d", "options"),
    [
        (3, {"n_points": 2999}),
        (4, {"n_points": 999}),
        (4, {"n_points": 2000, "order": 1}),
        (4, {"n_points": 1000, "n_estimates": 2}),
        (4, {"n_points": 8192}),
        (6, {"n_points": 16_384 + 31}),
        (9, {"n_points": 4000, "method": "plain"}),
        (4, {"n_points": 1000, "rtol": 0.5, "max_evaluations": 4000}),
    ],
)
def test_where_auto_takes_no_look_the_result_is_that_without_adaptation(d, options):
    one, other = (vq.quad(peak(d, 0.3), [0] * d, [1] * d, adapt=how, rng=1, **options) for how in ("auto", False))
    assert one.adaptation is None
    assert (one.integral, one.standard_error) == (other.integral, other.standard_error)


@pytest.mark.parametrize(("d", "n"), [(1, 8192), (2, 8192), (3, 16_384)])
def test_the_grid_of_the_pilot_rule_is_a_look_that_costs_nothing(d, n):
    for sets in (1, 2):
        one, other = (
            vq.quad(smooth(d), [0] * d, [1] * d, n_points=n, n_estimates=sets, adapt=how, rng=1)
            for how in ("auto", False)
        )
        assert (one.integral, one.standard_error) == (other.integral, other.standard_error)
        assert (one.adaptation.adapted, one.adaptation.n_pilot) == (False, 0)
    f = peak(d, {1: 5e-5, 2: 0.004, 3: 0.02}[d])
    assert vq.quad(f, [0] * d, [1] * d, n_points=n, rng=1).adaptation.adapted


def test_a_concentrated_integrand_that_the_grid_resolves_gets_no_map():
    found = vq.quad(peak(2, 0.04), [0, 0], [1, 1], n_points=8192, rng=1).adaptation
    assert found.concentration < 0.03
    assert (found.adapted, found.n_pilot) == (False, 0)


def test_smooth_functions_are_more_concentrated_in_more_dimensions():
    def adapts(d, found_in):
        learner = Learner(None, vq.Simplex(np.eye(d + 1, d)), False, np.random.default_rng(1))
        return learner.concentrated(found_in)

    assert [adapts(d, 0.06) for d in (1, 2, 3, 4, 5, 6, 9)] == [False, False, True, True, True, False, False]
    assert [adapts(d, 0.04) for d in (6, 9)] == [True] * 2
    assert [adapts(d, 0.0015) for d in (1, 2, 8)] == [True] * 3


@pytest.mark.parametrize(("d", "n"), [(4, 2000), (6, 4000)])
def test_powers_at_the_ends_of_axes_call_for_a_map(d, n):
    def power(x):
        return (x[0] * (1 - x[1])) ** -0.4 * smooth(d)(x[2:])

    assert vq.quad(power, [0] * d, [1] * d, n_points=n, rng=1).adaptation.adapted


def test_a_look_that_sees_only_zeros_adapts():
    def far(x):
        return 1.0 * (np.abs(x - 0.9).max(axis=0) < 0.02)

    assert vq.quad(far, [0] * 4, [1] * 4, n_points=1000, rng=1).adaptation.adapted
    assert concentration(np.zeros((2, 5))) == 0
    assert concentration(np.array([[0.0, 0, 0, 0], [1, 1, 1, 0]])) == pytest.approx(0.75)
    assert concentration(np.array([[0.0, 0, 0, 1], [1, 1, 1, 0]])) == pytest.approx(0.75)


@pytest.mark.parametrize(("d", "n"), [(2, 8192), (4, 1000)])
def test_a_peak_beside_a_smooth_component_does_not_adapt(d, n):
    """Two peaks do; what suits them costs a smooth component of the same integrand its digits."""
    narrow = peak(d, 0.004 if d == 2 else 0.03)

    def both(x):
        return np.stack([narrow(x), narrow(x) * x[0]])

    def mixed(x):
        return np.stack([narrow(x), smooth(d)(x)])

    def found(f):
        return vq.quad(f, [0] * d, [1] * d, n_points=n, rng=1)

    assert found(both).adaptation.adapted
    beside, alone = found(mixed), found(smooth(d))
    assert not beside.adaptation.adapted
    assert beside.standard_error[1] < 3 * alone.standard_error


def test_measures_that_are_turned_are_not_adapted_to():
    gauss = vq.ProductMeasure(*[scipy.stats.norm()] * 5)
    r = vq.quad(lambda z: np.exp(z.sum(axis=0)), measure=gauss, n_points=2048, rng=1)
    assert r.adaptation is None


def test_regions_components_and_sets_are_adapted_to():
    disc = vq.Ball([0, 0])
    r = vq.quad(lambda x: np.exp(-((x[0] - 0.5) ** 2 + x[1] ** 2) * 800), disc, n_points=3000, adapt=True, rng=1)
    assert r.integral == pytest.approx(np.pi / 800, rel=1e-3)
    both = vq.quad(lambda x: np.stack([peak(2)(x), peak(2)(x[::-1])]), [0, 0], [1, 1], n_points=3000, adapt=True, rng=1)
    np.testing.assert_allclose(both.integral, 1, atol=1e-2)
    several = vq.quad(peak(2), [0, 0], [1, 1], n_points=1000, n_estimates=3, adapt=True, rng=1)
    assert several.degrees_of_freedom == 2
    assert several.n_evaluations <= 3000


@pytest.mark.slow
@pytest.mark.statistical
@pytest.mark.parametrize(
    ("d", "n", "sigma", "adapt"), [(2, 480, 0.02, True), (4, 600, 0.1, True), (4, 1000, 0.14, "auto")]
)
def test_unbiased_and_the_mean_of_all_rounds_is_not(d, n, sigma, adapt, monkeypatch):
    """A narrow peak and few samples, for which "auto" adapts in some sets only. Weighting rounds by the inverse of the
    variances they show is the control."""
    rounds = []
    draw = Learner.draw

    def recording(self, *how):
        u, values, drawn = draw(self, *how)
        terms = values[0] / drawn.density(u)
        rounds.append((terms.sum(), len(terms) * terms.var(ddof=1)))
        return u, values, drawn

    monkeypatch.setattr(Learner, "draw", recording)
    fresh, weighted, adapted = [], [], []
    for seed in range(2000):
        rounds.clear()
        r = vq.quad(peak(d, sigma), [0] * d, [1] * d, n_points=n, adapt=adapt, rng=seed)
        adapted.append(r.adaptation.adapted)
        fresh.append(r.integral)
        means, variances = np.array([*rounds, (r.integral, r.standard_error**2)]).T
        weights = 1 / np.maximum(variances, 1e-6)
        weighted.append(weights @ means / weights.sum())
    exact = np.prod(-np.diff(scipy.stats.norm(np.linspace(0.35, 0.6, d), sigma).cdf([[1], [0]]), axis=0))
    z_fresh, z_weighted = ((np.mean(e) - exact) / (np.std(e, ddof=1) / math.sqrt(len(e))) for e in (fresh, weighted))
    assert abs(z_fresh) < 4
    assert adapt is True or 0.1 < np.mean(adapted) < 0.9
    assert z_weighted < -6


@pytest.mark.parametrize("adapt", [True, False])
def test_adapt_may_be_a_truth_value_of_numpy(adapt):
    found, expected = (vq.quad(peak(1), 0, 1, n_points=1000, adapt=a, rng=1) for a in (np.bool_(adapt), adapt))
    assert found.integral == expected.integral
    assert (found.adaptation is None) == (not adapt)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"adapt": "yes"}, "adapt must be True, False or 'auto', got 'yes'"),
        ({"adapt": 1}, "adapt must be True, False or 'auto', got 1"),
        ({"adapt": np.array([1, 0])}, r"adapt must be True, False or 'auto', got array\("),
        ({"adapt": True, "n_points": 399}, "n_points must be at least 400 to adapt, got 399"),
        ({"adapt": True, "n_points": 399, "order": 1}, "n_points must be at least 400 to adapt, got 399"),
        ({"adapt": True, "n_points": 133, "n_estimates": 3, "order": 1}, "n_points must be at least 134 to adapt"),
        ({"adapt": True, "rtol": 1e-3}, "adapt and a tolerance do not go together"),
    ],
)
def test_what_adapt_takes(options, message):
    with pytest.raises(ValueError, match=message):
        vq.quad(peak(1), 0, 1, **options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"order": 77}, "order must be .*, got 77"),
        ({"method": "foo"}, "unknown method 'foo'"),
        ({"method": "pilot"}, "method='pilot' integrates in d = 1 to 3 dimensions, got d = 4"),
        ({"sampler": "nosuch"}, "unknown sampler 'nosuch'"),
        ({"sampler": "zero-two"}, "zero-two"),
        ({"sampler": "regular"}, "those of 'regular' are not"),
        ({"sampler": "sobol", "debias": "exchange"}, "no rule for .*debias='exchange', design 'sobol'"),
    ],
)
def test_wrong_arguments_are_found_before_the_pilot(options, message):
    with pytest.raises(ValueError, match=message):
        vq.quad(lambda x: pytest.fail("called"), [0] * 4, [1] * 4, n_points=4200, adapt=True, **options)
