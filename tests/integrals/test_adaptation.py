"""Maps learned from pilot rounds: they find peaks, and fresh samples keep the estimate unbiased."""

import math

import numpy as np
import pytest

import voroquad as vq
from voroquad.integrals.adaptation import Learner, PilotSamples
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


def test_auto_adapts_to_peaks_only():
    def adaptation(f, **options):
        return vq.quad(f, [0] * 4, [1] * 4, n_points=1000, rng=1, **options).adaptation

    smooth = adaptation(lambda x: np.exp(x[0] * x[1]), adapt="auto")
    assert not smooth.adapted
    assert 40 < smooth.n_pilot <= 60
    assert adaptation(peak(4, 0.05), adapt="auto").adapted
    assert adaptation(peak(4)) is None


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
@pytest.mark.parametrize(("d", "n", "sigma"), [(2, 480, 0.02), (4, 600, 0.1)])
def test_unbiased_and_the_mean_of_all_rounds_is_not(d, n, sigma, monkeypatch):
    """A narrow peak and few samples. Weighting rounds by the inverse of the variances they show is the control."""
    rounds = []
    draw = Learner.draw

    def recording(self, *how):
        u, values, drawn = draw(self, *how)
        terms = values[0] / drawn.density(u)
        rounds.append((terms.sum(), len(terms) * terms.var(ddof=1)))
        return u, values, drawn

    monkeypatch.setattr(Learner, "draw", recording)
    fresh, weighted = [], []
    for seed in range(2000):
        rounds.clear()
        r = vq.quad(peak(d, sigma), [0] * d, [1] * d, n_points=n, adapt=True, rng=seed)
        fresh.append(r.integral)
        means, variances = np.array([*rounds, (r.integral, r.standard_error**2)]).T
        weights = 1 / np.maximum(variances, 1e-6)
        weighted.append(weights @ means / weights.sum())
    z_fresh, z_weighted = ((np.mean(e) - 1) / (np.std(e, ddof=1) / math.sqrt(len(e))) for e in (fresh, weighted))
    assert abs(z_fresh) < 4.5
    assert z_weighted < -6


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"adapt": "yes"}, "unknown adapt 'yes'; choose one of auto"),
        ({"adapt": True, "n_points": 399}, "n_points must be at least 400 to adapt, got 399"),
        ({"adapt": True, "n_points": 399, "order": 1}, "n_points must be at least 400 to adapt, got 399"),
        ({"adapt": True, "n_points": 133, "n_estimates": 3, "order": 1}, "n_points must be at least 134 to adapt"),
        ({"adapt": True, "rtol": 1e-3}, "adapt and a tolerance do not go together"),
    ],
)
def test_what_adapt_takes(options, message):
    with pytest.raises(ValueError, match=message):
        vq.quad(peak(1), 0, 1, **options)


@pytest.mark.parametrize(("d", "options"), [(2, {}), (4, {"n_estimates": 2}), (1, {"order": 1})])
def test_too_few_points_for_a_pilot_do_without(d, options):
    few = 399 // options.get("n_estimates", 1)
    one, other = (
        vq.quad(peak(d, 0.3), [0] * d, [1] * d, n_points=few, adapt=adapt, rng=1, **options)
        for adapt in ("auto", False)
    )
    assert (one.integral, one.standard_error) == (other.integral, other.standard_error)
    assert one.adaptation is None
    just = vq.quad(peak(d, 0.3), [0] * d, [1] * d, n_points=400, adapt="auto", rng=1, **options)
    assert just.adaptation is not None


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
