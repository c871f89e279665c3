"""Error bars from corrections: the parts by their definitions, the intervals by what they hold."""

import math

import numpy as np
import pytest
from scipy import stats

import voroquad as vq
from voroquad.rules import error_bars
from voroquad.rules.ends import deviations
from voroquad.rules.error_bars import LEVEL, NORMAL, in_plane, of_corrections, on_line
from voroquad.rules.kriging_rules import strata_in_colours
from voroquad.rules.line_fits import choose_on_line


def half_width(bar):
    return stats.t.ppf(LEVEL, bar.degrees_of_freedom) * bar.error


def test_equal_corrections_have_as_many_degrees_of_freedom():
    bar = of_corrections(np.array([[3.0] * 5 + [0.0] * 11, [2.0] + [0.0] * 15, [0.0] * 16]), scale=1.5)
    np.testing.assert_allclose(bar.degrees_of_freedom, [5, 1, np.inf])
    np.testing.assert_allclose(bar.error, np.array([1.5 * 3 * math.sqrt(5), 1.5 * 2, 0]) / 16)


def test_the_scale_of_the_corrections_matters_to_no_degree():
    r = np.random.default_rng(1).standard_normal((1, 30))
    for scale in (1e-200, 1e200):
        bar = of_corrections(np.float64(scale) ** 0.5 * r)
        np.testing.assert_allclose(bar.degrees_of_freedom, of_corrections(r).degrees_of_freedom)


def test_parabolas_have_the_variance_that_a_fine_grid_gives():
    n = 6
    x = vq.sample("stratified", n, 1, rng=2).points[:, 0]
    polynomials = [np.polynomial.Polynomial(c) for c in np.random.default_rng(3).standard_normal((n, 3))]
    near = np.clip(np.arange(n), 1, n - 2)[:, None] + np.arange(-1, 2)
    around = np.array([[p(x[j]) for p, j in zip(polynomials, near, strict=True)]])
    expected = [p((i + (np.arange(4000) + 0.5) / 4000) / n).var() for i, p in enumerate(polynomials)]
    np.testing.assert_allclose(error_bars._variances_of_parabolas(x, around)[0], expected, rtol=1e-5)


def test_many_equal_corrections_make_a_normal_interval_on_the_line():
    """Independent corrections of a rough integrand: 0.9 of what independence gives."""
    n = 400
    x = vq.sample("stratified", n, 1, rng=2).points[:, 0]
    r = np.where(np.arange(n) % 2, 1.0, -1.0)[None]
    bar = on_line(x, 0 * r, r, np.zeros((1, n, 3)), r)
    assert bar.degrees_of_freedom == np.inf
    np.testing.assert_allclose(bar.error, 0.9 / math.sqrt(n))


def test_one_correction_at_an_end_of_the_line_has_few_degrees_of_freedom():
    """Its half of (V = r²/4)^½ counts with Student's t of one degree; three are told, and the interval is as wide."""
    n = 40
    x = vq.sample("stratified", n, 1, rng=2).points[:, 0]
    r = np.where(np.arange(n) == 0, 1.0, 0.0)[None]
    bar = on_line(x, 0 * r, r, np.zeros((1, n, 3)), r)
    assert bar.degrees_of_freedom == 3
    np.testing.assert_allclose(half_width(bar), stats.t.ppf(LEVEL, 1) / 2 / n)


def test_curves_at_the_ends_widen_the_interval():
    n = 40
    x = vq.sample("stratified", n, 1, rng=2).points[:, 0]
    r = np.where(np.arange(n) == 0, 1.0, 0.0)[None]
    around = np.zeros((1, n, 3))
    around[0, 0] = 1, 0.5, 0.3
    power = (x**-0.4)[None]
    bar = on_line(x, power, 1e-3 * r, around, r)
    left = deviations(x, power, around)[0, 0]
    assert left > 0
    without = on_line(x, 0 * power, 1e-3 * r, around, r)
    np.testing.assert_allclose(half_width(bar), max(half_width(without)[0], 1.5 * left / n))


def test_orders_that_adapted_count_for_more_degrees():
    n = 40
    x = vq.sample("stratified", n, 1, rng=2).points[:, 0]
    r = np.where(np.arange(n) < 3, 1.0, 0.0)[None]
    around = np.stack([-r, 0 * r, r], axis=-1)
    alike, adapted = (on_line(x, 0 * r, r, around, factor * r) for factor in (1, 100))
    assert adapted.degrees_of_freedom > alike.degrees_of_freedom + 1
    assert half_width(adapted) < half_width(alike)


def plane(k=12):
    samples = vq.sample("multi-jittered", k * k, 2, rng=4)
    colours, _ = strata_in_colours((k, k), 3)
    return samples.points, samples.strata, colours


def test_corrections_that_follow_one_coordinate_make_a_tenth_of_the_variance():
    """As beside an edge along an axis; corrections at random make all of it."""
    x, strata, colours = plane(30)
    along = (x[:, 0] * 30) % 1 - 0.5
    left = error_bars._spread(x, strata, colours, np.stack([along, np.random.default_rng(1).standard_normal(900)]))
    assert left[0].max() < 0.5
    assert left[0].mean() < 0.2
    assert left[1].mean() > 0.6
    assert left.min() >= 0.1
    assert left.max() <= 1


def test_the_spread_is_that_of_its_definition():
    x, strata, colours = plane(8)
    r = np.random.default_rng(2).standard_normal((1, 64))
    found = error_bars._spread(x, strata, colours, r)[0]
    index = np.indices(strata).reshape(2, -1)
    for i in range(64):
        parts = []
        for a in range(2):
            slab = np.flatnonzero((colours == colours[i]) & (index[a] == index[a, i]))
            slab = slab[np.argsort(x[slab, a])]
            m, squares = len(slab), np.square(r[0, slab]).sum()
            parts.append(m / (m - 1) / 2 * np.square(np.diff(r[0, slab])).sum() / squares)
        assert found[i] == pytest.approx(np.clip(min(parts), 0.1, 1))


def test_corrections_at_the_border_count_by_their_place():
    x = np.array([[0.125, 0.5], [0.5, 0.5], [0.99, 0.01], [0.26, 0.7]])
    slack, found = 0.3, error_bars._border(x, (4, 4))
    whole = (1.3**3 - 0.3**3) / 3
    assert found[0] == pytest.approx(np.clip(whole / (1 + slack - 0.5) ** 2, 1, 9))
    assert np.isnan(found[[1, 3]]).all()
    assert found[2] == pytest.approx(1)


def test_many_corrections_in_the_plane_make_a_normal_interval():
    x, strata, colours = plane(24)
    r = np.random.default_rng(5).standard_normal((1, 576))
    bar = in_plane(x, strata, colours, r, r)
    assert bar.degrees_of_freedom == np.inf
    assert 0.6 < bar.error[0] * 24 < 1.05


def test_a_correction_in_a_corner_has_few_degrees_of_freedom():
    x, strata, colours = plane()
    r = np.where(np.arange(144) == 0, 1.0, 0.0)[None]
    bar = in_plane(x, strata, colours, r, r)
    assert bar.degrees_of_freedom == 3
    factor = error_bars._border(x, strata)[0]
    np.testing.assert_allclose(half_width(bar), max(stats.t.ppf(LEVEL, 1) * math.sqrt(factor), NORMAL) / 144)


@pytest.mark.statistical
@pytest.mark.parametrize("n", [64, 512])
def test_intervals_on_the_line_hold_ends_edges_and_waves(n):
    """Of 200 sets, 180 at least; a correct bar of 95 % fails less than once in 10⁵."""
    x = vq.sample("multi-jittered", n, 1, sets=200, rng=6).points[..., 0]
    functions = [
        np.sqrt(x),
        -np.log(x),
        x**-0.3,
        abs(x - 0.37),
        np.where(x < 0.37, 1.0, 0.0),
        np.exp(x),
        np.cos(777.7 * x),
    ]
    truth = [2 / 3, 1, 1 / 0.7, (0.37**2 + 0.63**2) / 2, 0.37, math.e - 1, math.sin(777.7) / 777.7]
    f = np.stack(functions, axis=1)
    choice = choose_on_line(x, f)
    errors = abs((choice.weights * f).sum(axis=-1) - truth)
    bars = [on_line(*one) for one in zip(x, f, choice.residuals, choice.around, choice.reference, strict=True)]
    held = (errors <= np.array([half_width(bar) for bar in bars]) + 1e-15).sum(axis=0)
    assert (held >= 172).all()
    alone = np.array([NORMAL * of_corrections(r, 0.5).error for r in choice.residuals])
    assert ((errors <= alone)[:, :2].sum(axis=0) < 150).all()  # half the corrections' size, as if normal: too narrow
