"""Maps learned from pilot rounds: they find peaks, and fresh samples keep the estimate unbiased."""

import math

import numpy as np
import pytest

import voroquad as vq
from voroquad.integrals.adaptation import INTERVALS, PilotSamples, SeparableMap, refined


def peak(d, sigma=0.03):
    """A Gaussian of this width, the integral of which over the unit box is 1 but for tails of 10⁻¹⁵."""
    center = np.linspace(0.35, 0.6, d)[:, None]
    return lambda x: np.exp(-((x - center) ** 2).sum(axis=0) / (2 * sigma**2)) / (2 * np.pi * sigma**2) ** (d / 2)


NODES = np.stack([np.linspace(0, 1, 25) ** 3, np.sin(np.linspace(0, np.pi / 2, 25))])


def test_the_map_has_its_volume_element_and_inverse():
    warp = SeparableMap(NODES)
    v = np.random.default_rng(1).uniform(0.01, 0.99, (2, 50))
    u, element = warp(v)
    np.testing.assert_allclose(warp.inverse(u), v, atol=1e-12)
    h = 1e-7
    slopes = [(warp(v + h * e[:, None])[0] - warp(v - h * e[:, None])[0]).sum(axis=0) / (2 * h) for e in np.eye(2)]
    np.testing.assert_allclose(element, slopes[0] * slopes[1], rtol=1e-4)
    np.testing.assert_allclose(warp(np.array([[0.0, 1.0], [0.0, 1.0]]))[0], [[0, 1], [0, 1]], atol=1e-15)


def test_samples_of_all_rounds_stand_for_the_box():
    """Σ_i 1/Σ_t n_t p_t(u_i) estimates the volume, 1, and the moments of the box."""
    rng = np.random.default_rng(1)
    rounds = [(SeparableMap.identity(2), 4000), (SeparableMap(NODES), 8000)]
    u = np.concatenate([warp(rng.random((2, n)))[0] for warp, n in rounds], axis=1)
    w = PilotSamples(u, np.ones((1, u.shape[1])), rounds).weights()
    assert w.sum() == pytest.approx(1, abs=0.03)
    np.testing.assert_allclose(u @ w, [0.5, 0.5], atol=0.03)


def test_intervals_gather_where_the_integrand_is_large():
    u = np.random.default_rng(1).random((2, 4000))
    warp = SeparableMap.identity(2)
    pool = PilotSamples(u, (np.exp(-(((u[0] - 0.3) / 0.05) ** 2)) + 1e-3)[None], [(warp, 4000)])
    for _ in range(4):
        warp = refined(warp, pool)
    inside = ((warp.nodes > 0.2) & (warp.nodes < 0.4)).sum(axis=1)
    assert inside[0] > 0.6 * INTERVALS
    assert inside[1] < 0.4 * INTERVALS
    assert (np.diff(warp.nodes) > 0).all()
    assert refined(warp, PilotSamples(u, np.zeros((1, 4000)), pool.rounds)) is warp


@pytest.mark.parametrize(
    ("d", "sigma", "options"), [(1, 0.003, {}), (2, 0.03, {}), (4, 0.03, {"order": 1}), (6, 0.06, {})]
)
def test_peaks_that_today_s_rule_misses_are_resolved(d, sigma, options):
    options = {"n_points": 8000 if d > 2 else 3000, "rng": 3} | options
    f = peak(d, sigma)
    r = vq.quad(f, [0] * d, [1] * d, adapt=True, **options)
    assert r.adaptation.adapted
    assert r.n_evaluations <= options["n_points"]
    assert abs(r.integral - 1) < 0.05
    assert abs(r.integral - 1) < 6 * r.standard_error + 1e-9
    nodes = r.adaptation.nodes
    assert ((nodes > 0.1) & (nodes < 0.9)).mean() > 0.8


def test_auto_adapts_to_peaks_only():
    smooth = vq.quad(lambda x: np.exp(x[0] * x[1]), [0, 0], [1, 1], n_points=1000, adapt="auto", rng=1)
    assert not smooth.adaptation.adapted
    assert smooth.adaptation.n_pilot == 60
    assert vq.quad(peak(2), [0, 0], [1, 1], n_points=1000, adapt="auto", rng=1).adaptation.adapted
    assert vq.quad(peak(2), [0, 0], [1, 1], rng=1).adaptation is None


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
def test_unbiased_and_the_mean_of_all_rounds_is_not():
    """A narrow peak and few samples. Weighting rounds by the inverse of the variances they show is the control."""
    f, n = peak(2, 0.05), 480
    fresh, weighted = [], []
    for seed in range(2000):
        fresh.append(vq.quad(f, [0, 0], [1, 1], n_points=n, adapt=True, order=0, rng=seed).integral)
        rng = np.random.default_rng(seed)
        values = [f(rng.random((2, 80))) for _ in range(6)]
        means = np.array([v.mean() for v in values])
        weights = 1 / np.array([v.var() + 1e-300 for v in values])
        weighted.append(weights @ means / weights.sum())
    z_fresh, z_weighted = ((np.mean(e) - 1) / (np.std(e, ddof=1) / math.sqrt(len(e))) for e in (fresh, weighted))
    assert abs(z_fresh) < 4.5
    assert z_weighted < -6


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"adapt": "yes"}, "unknown adapt 'yes'; choose one of auto"),
        ({"adapt": True, "n_points": 100}, "n_points must be at least 401 to adapt, got 100"),
        ({"adapt": True, "rtol": 1e-3}, "adapt and a tolerance do not go together"),
    ],
)
def test_what_adapt_takes(options, message):
    with pytest.raises(ValueError, match=message):
        vq.quad(peak(1), 0, 1, **options)
