"""Error bars from corrections: the parts by their definitions, the intervals by what they hold."""

import math

import numpy as np
import pytest
from scipy import stats

import voroquad as vq
from voroquad.rules import error_bars
from voroquad.rules.cusps import of_cusps
from voroquad.rules.ends import at_faces, deviations
from voroquad.rules.error_bars import LEAST_SPREAD, LEVEL, NORMAL, OF_ALL, ErrorBar, in_box, of_corrections, on_line
from voroquad.rules.faces import of_faces
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


def test_many_rough_corrections_make_a_normal_interval_on_the_line():
    """Where second differences exceed the corrections, these count: 0.95 of what independence gives."""
    n = 400
    x = vq.sample("stratified", n, 1, rng=2).points[:, 0]
    r = np.where(np.arange(n) % 2, 1.0, -1.0)[None]
    bar = on_line(x, 0 * r, r, np.stack([-r, r, -r], axis=-1), r)
    assert bar.degrees_of_freedom == np.inf
    np.testing.assert_allclose(bar.error, 0.95 / math.sqrt(n))


def test_corrections_that_are_alike_around_make_no_error():
    """What predictions miss by the same amount all over a stratum, its sample corrects."""
    n = 40
    x = vq.sample("stratified", n, 1, rng=2).points[:, 0]
    r = np.where((np.arange(n) > 0) & (np.arange(n) < n - 1), 1.0, 0.0)[None]
    np.testing.assert_array_equal(on_line(x, 0 * r, r, np.stack([r] * 3, axis=-1), r).error, 0)


@pytest.mark.parametrize(("rough", "count"), [(1, 1), (10, 10), (30, 20)])
def test_second_differences_and_parabolas_make_a_normal_interval(monkeypatch, rough, count):
    """The more strata, the larger the factor: from 0.88 to 0.95."""
    n = 40
    x = vq.sample("stratified", n, 1, rng=2).points[:, 0]
    r = np.where((np.arange(n) >= 5) & (np.arange(n) < 5 + rough), 1.0, 0.0)[None]
    around = np.stack([0.2 * r, 0 * r, 0.1 * r], axis=-1)
    monkeypatch.setattr(error_bars, "_variances_of_parabolas", lambda points, around: 0.01 * r)
    bar = on_line(x, 0 * r, r, around, 1e9 * r)
    error = (0.88 + 0.07 * count / 20) * math.sqrt(rough * (0.01 + 0.3**2 / 6)) / n
    student = stats.t.ppf(LEVEL, 1 + 0.45 * (5 * 1.5 * rough - 1)) * math.sqrt(rough * 0.01) / n
    np.testing.assert_allclose(half_width(bar), max(NORMAL * error, student), rtol=1e-12)
    assert (NORMAL * error > student) == (rough > 1)


@pytest.mark.parametrize(("strata", "freedom"), [([0], 1), ([0, 39], 1.45), ([39, 20], 1.675), ([20], 1.225)])
def test_few_variances_have_few_degrees_of_freedom(monkeypatch, strata, freedom):
    """Those at the ends of the line count less. Three degrees are told, and the interval is as wide."""
    n = 40
    x = vq.sample("stratified", n, 1, rng=2).points[:, 0]
    r = np.zeros((1, n))
    r[0, strata] = 1
    monkeypatch.setattr(error_bars, "_variances_of_parabolas", lambda points, around: 0.2 * r)
    bar = on_line(x, 0 * r, r, np.zeros((1, n, 3)), 0 * r)
    if strata == [39, 20]:  # (1 + 1)² / (1 + 1 / 1.5)
        freedom = 1 + 0.45 * (4 / (1 + 1 / 1.5) - 1)
    assert bar.degrees_of_freedom == 3
    np.testing.assert_allclose(half_width(bar), stats.t.ppf(LEVEL, freedom) * math.sqrt(0.2 * len(strata)) / n)


@pytest.mark.parametrize("end", [0, 39])
def test_a_correction_at_an_end_counts_a_fifth_of_its_square_at_least(end):
    n = 40
    x = vq.sample("stratified", n, 1, rng=2).points[:, 0]
    r = np.where(np.arange(n) == end, 1.0, 0.0)[None]
    bar = on_line(x, 0 * r, r, np.zeros((1, n, 3)), r)
    np.testing.assert_allclose(half_width(bar), stats.t.ppf(LEVEL, 1) * math.sqrt(0.2) / n)


def test_fields_keep_their_intervals_with_the_fewest_degrees_of_freedom_of_any():
    bar = ErrorBar(np.array([1.0, 2.0, 3.0]), np.array([3.0, np.inf, 10.0]))
    error, fewest = bar.with_equal_freedom()
    assert fewest == 3
    np.testing.assert_allclose(half_width(ErrorBar(error, np.array(3.0))), half_width(bar))


def test_components_do_not_widen_each_other():
    """A step has three degrees of freedom; the interval of a smooth component is as wide as without it."""
    alone = vq.quad(lambda x: np.exp(x[0]), 0, 1, n_points=64, rng=1)
    both = vq.quad(lambda x: np.stack([np.exp(x[0]), np.where(x[0] < 0.37, 1.0, 0.0)]), 0, 1, n_points=64, rng=1)
    low, high = both.confidence_interval()
    np.testing.assert_allclose((high - low)[0], -np.subtract(*alone.confidence_interval()), rtol=1e-9)


def test_cusps_widen_the_interval():
    x = vq.sample("stratified", 40, 1, rng=2).points[:, 0]
    f = np.log(abs(x - 0.512))[None]
    bar = on_line(x, f, 0 * f, np.zeros((1, 40, 3)), f)
    assert bar.degrees_of_freedom == np.inf
    np.testing.assert_allclose(bar.error, np.sqrt(of_cusps(x, f)) / 40)


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


def test_corrections_that_follow_one_coordinate_make_little_of_the_variance():
    """As beside an edge along an axis; corrections at random make all of it."""
    x, strata, colours = plane(30)
    along = (x[:, 0] * 30) % 1 - 0.5
    left = error_bars._spread(x, strata, colours, np.stack([along, np.random.default_rng(1).standard_normal(900)]))
    assert left[0].max() == LEAST_SPREAD
    assert 0.7 < left[1].mean() < 1
    assert left.min() >= LEAST_SPREAD
    assert left.max() <= 1


def by_definition(x, colours, index, r, k):
    """Squared second differences of the colours in a row, what is expected of them, and their number."""
    seconds, expected, count = np.zeros(2), np.zeros(2), 0
    for c in np.unique(colours):
        slab = np.flatnonzero((colours == c) & (index == k))
        slab = slab[np.argsort(x[slab])]
        for j in range(len(slab) - 2):
            three = r[:, slab[j : j + 3]]
            seconds = seconds + np.square(three @ [1, -2, 1])
            expected = expected + np.square(three) @ [1, 4, 1]
            count += 1
    return seconds, expected, count


@pytest.mark.parametrize(("strata", "period"), [((8, 9), 3), ((5, 6, 4), 2)])
def test_the_spread_is_that_of_its_definition(strata, period):
    d = len(strata)
    x = vq.sample("multi-jittered", math.prod(strata), d, rng=4).points
    colours, _ = strata_in_colours(strata, period)
    r = np.random.default_rng(2).standard_normal((2, len(x))) * (1 + np.arange(len(x)))
    found = error_bars._spread(x, strata, colours, r)
    index = np.indices(strata).reshape(d, -1)
    of_rows = [[by_definition(x[:, a], colours, index[a], r, k) for k in range(n)] for a, n in enumerate(strata)]
    for i in range(len(x)):
        parts = []
        for a, rows in enumerate(of_rows):
            of_axis = sum(row[0] for row in rows) / sum(row[1] for row in rows)
            seconds, expected, count = rows[index[a, i]]
            more = OF_ALL / max(count, 1)
            parts.append((seconds + more * of_axis * expected) / ((1 + more) * expected) if count else np.ones(2))
        np.testing.assert_allclose(found[:, i], np.clip(np.min(parts, axis=0), LEAST_SPREAD, 1))


def test_many_corrections_in_the_plane_make_a_normal_interval():
    x, strata, colours = plane(24)
    r = np.random.default_rng(5).standard_normal((1, 576))
    bar = in_box(x, strata, colours, 0 * r, r)
    assert bar.degrees_of_freedom > 100
    assert 0.75 < bar.error[0] * 24 < 1.05


def test_a_single_correction_has_few_degrees_of_freedom():
    x, strata, colours = plane()
    r = np.where(np.arange(144) == 40, 1.0, 0.0)[None]
    bar = in_box(x, strata, colours, 0 * r, r)
    assert bar.degrees_of_freedom == 3
    left = error_bars._spread(x, strata, colours, r)[0, 40]
    np.testing.assert_allclose(half_width(bar), stats.t.ppf(LEVEL, 1) * math.sqrt(left) / 144)


def test_curves_at_the_faces_widen_the_interval(monkeypatch):
    x, strata, colours = plane()
    f = (x[:, 1] ** -0.4)[None]
    left = at_faces(x, strata, colours, f, f)
    monkeypatch.setattr(error_bars, "at_faces", lambda *given: 100 * at_faces(*given))
    bar = in_box(x, strata, colours, f, f)
    assert bar.degrees_of_freedom == np.inf
    np.testing.assert_allclose(half_width(bar), 150 * left / 144)


def test_powers_at_faces_widen_the_interval():
    x, strata, colours = plane()
    f = (x[:, 1] ** -0.2)[None]
    r = np.where(x[:, 1] < 1 / 12, 0.3 * f, 0)
    bar = in_box(x, strata, colours, f, r)
    assert bar.degrees_of_freedom == np.inf
    np.testing.assert_allclose(bar.error, np.sqrt(of_faces(x, strata, colours, f, r)) / 144)


def test_where_models_resolve_the_integrand_degrees_of_freedom_count_twice():
    x, strata, colours = plane()
    r = np.where(np.arange(144) == 40, 1.0, 0.0)[None]
    f = np.repeat(np.arange(12.0), 12)[None]  # steps of 1 between 132 neighbours along one axis
    left = error_bars._spread(x, strata, colours, r)[0, 40]
    for size, freedom in ((1e9, 2), (math.sqrt(1000 / 132 / 0.75), 1.25), (1, 1)):
        bar = in_box(x, strata, colours, size * f, r)
        np.testing.assert_allclose(half_width(bar), stats.t.ppf(LEVEL, freedom) * math.sqrt(left) / 144)


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
