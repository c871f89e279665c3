"""method="polynomials": Sobol' replicates that polynomials fitted to others correct."""

from __future__ import annotations

import math
import re
import warnings

import numpy as np
import pytest
import scipy.stats

import voroquad as vq
from voroquad.integrals import replicates
from voroquad.integrals.estimates import Estimate
from voroquad.integrals.evaluation import Function
from voroquad.integrals.integrand import Integrand
from voroquad.integrals.library import Library
from voroquad.integrals.regions import Box
from voroquad.rules import gauss_grid
from voroquad.study.genz import instances


def integrate(func, d: int, n: int, **how: object) -> vq.QuadResult:
    return vq.quad(func, np.zeros(d), np.ones(d), **({"n_points": n, "method": "polynomials", "rng": 1} | how))


@pytest.mark.parametrize(("d", "n"), [(1, 512), (2, 4096), (4, 16_384), (8, 8192)])
def test_polynomials_are_exact(d, n):
    """Of total degree 2, or 4 in few dimensions, up to the ridge."""
    p = 2 if d > 2 else 4
    r = integrate(lambda x: np.stack([x.sum(axis=0) ** 2, x[0] ** p, 1 + 0 * x[0]]), d, n)
    np.testing.assert_allclose(r.integral, [d / 12 + d * d / 4, 1 / (p + 1), 1], rtol=1e-9)
    assert r.n_evaluations == n
    assert r.degrees_of_freedom == (2 if (d, n) == (4, 16_384) else 3)


def test_numbers_of_points_between_powers_of_two_make_more_replicates():
    r = integrate(lambda x: np.exp(x[0] * x[1]), 4, 3700)
    assert (r.n_evaluations, r.degrees_of_freedom) == (7 * 512, 6)


@pytest.mark.parametrize("n", [64, 128, 255])
def test_nets_may_be_smaller_than_the_parts_that_judge(n):
    r = integrate(lambda x: x.sum(axis=0), 6, n)
    assert r.n_evaluations == n // (1 << (n.bit_length() - 3)) * (1 << (n.bit_length() - 3))
    assert abs(r.integral - 3) < 6 * r.standard_error < 0.6


def test_few_points_of_normal_coordinates_take_polynomials():
    m = vq.ProductMeasure(*[scipy.stats.norm(1, 2)] * 5)
    r = vq.quad(lambda x: x.sum(axis=0), measure=m, n_points=512, method="polynomials", rng=1)
    assert abs(r.integral - 5) < 6 * r.standard_error


def test_smooth_integrands_gain():
    d, n = 4, 8192
    func = lambda x: np.exp(x.sum(axis=0) / 2)  # noqa: E731
    exact = (2 * (math.exp(0.5) - 1)) ** d
    errors = {
        method: np.sqrt(
            np.mean([(integrate(func, d, n, method=method, rng=s).integral - exact) ** 2 for s in range(5)])
        )
        for method in ("polynomials", "plain")
    }
    assert errors["polynomials"] < errors["plain"] / 20


def test_the_error_is_that_of_the_spread_of_the_replicates():
    """Times a factor: the largest for small replicates in many dimensions, the least beside a grid."""
    for d, n, factor in ((8, 1024, 1.6), (8, 4096, 1.6), (8, 8192, 1.3), (4, 1024, 1.3), (4, 6000, 1.15)):
        run = run_of(lambda x: np.abs(x - 0.4).max(axis=0), d, n)
        estimate, _ = run.estimate()
        spread = math.sqrt(np.square(estimate.deviations).sum() / (run.count - 1) / run.count)
        assert estimate.error[0] == pytest.approx(factor * spread, rel=1e-6)


def test_components_choose_for_themselves():
    """What goes with a component changes nothing of it but the last digits."""
    both = integrate(lambda x: np.stack([np.exp(x[0] * x[1]), x.sum(axis=0) < 1.2]), 4, 4096)
    for i, func in enumerate([lambda x: np.exp(x[0] * x[1]), lambda x: 1.0 * (x.sum(axis=0) < 1.2)]):
        alone = integrate(func, 4, 4096)
        assert both.integral[i] == pytest.approx(alone.integral, rel=1e-12)
        assert both.standard_error[i] == pytest.approx(alone.standard_error, rel=1e-6)


def test_neither_batches_nor_threads_change_a_bit_and_points_come_in_blocks(monkeypatch):
    monkeypatch.setattr(replicates, "MOST_TERMS", 30)
    monkeypatch.setattr(replicates, "POINTS_AT_ONCE", 1024)
    sizes = []

    def func(x: np.ndarray) -> np.ndarray:
        sizes.append(x.shape[1])
        return np.exp(x[0] * x[1])

    whole = integrate(func, 5, 40_000)
    assert max(sizes) == 1024
    assert sum(sizes) == whole.n_evaluations == 6**5 + 3 * 8192
    assert integrate(func, 5, 40_000, batch=100, threads=3).integral == whole.integral
    assert max(sizes[-300:]) == 100
    # Sums over blocks are those over whole nets up to rounding
    monkeypatch.setattr(replicates, "POINTS_AT_ONCE", 1 << 15)
    assert integrate(func, 5, 40_000).integral == pytest.approx(whole.integral, rel=1e-13)
    assert max(sizes[-20:]) == 6**5


@pytest.mark.parametrize("power", [-900, 900])
@pytest.mark.parametrize("n", [512, 6000])
def test_no_scale_of_the_integrand_changes_a_digit(power, n):
    one, other = (integrate(lambda x, p=p: np.ldexp(np.exp(x[0] * x[1]), p), 4, n) for p in (0, power))
    assert n == 512 or one.rule.startswith("polynomials")
    assert other.integral == math.ldexp(one.integral, power)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("first", [0.0, 1e-3, 1e-30])
def test_values_far_above_all_before_change_the_units(monkeypatch, first):
    """A spike between the points that take part in fits: no power over- or underflows, and no value is lost."""
    monkeypatch.setattr(replicates, "MOST_TERMS", 30)

    def estimate(amp: float) -> tuple[Estimate, np.ndarray]:
        func = lambda x: amp * (first * np.exp(x[1] * x[2]) + (x[0] < 1e-3) * np.exp(x[1]))  # noqa: E731
        run = run_of(func, 5, 8192)
        assert max(run._values(net, 0, run.fitted).max() for net in run.nets) <= amp * first * math.e
        return run.estimate()

    one, degrees = estimate(1.0)
    assert one.mean > 1e-3
    for amp in (1e-200, 1e200, 2.0**-900, 2.0**900):
        other, as_before = estimate(amp)
        tolerance = 0 if math.frexp(amp)[0] == 0.5 else 1e-12
        np.testing.assert_allclose(other.mean / amp, one.mean, rtol=tolerance)
        np.testing.assert_allclose(other.error / amp, one.error, rtol=tolerance)
        np.testing.assert_array_equal(as_before, degrees)
        assert [w.kind for w in other.warnings] == [w.kind for w in one.warnings]


@pytest.mark.parametrize("power", [40, 700])
def test_new_units_are_those_of_all_values_from_the_start(monkeypatch, power):
    """Sums and what takes part in fits, where blocks are far larger than those before."""
    monkeypatch.setattr(replicates, "MOST_TERMS", 30)
    jump = lambda x: np.exp(x[2] * x[1]) * np.where(x[0] < 1e-3, np.ldexp(1.0, power), 1.0)  # noqa: E731
    run = run_of(jump, 5, 8192)
    kept, sums, unit = run._evaluated()
    assert unit > power - 1
    assert max(y.max() for y in kept) < 2.0 ** (2 - power)
    for net, y, of_net in zip(run.nets, kept, sums, strict=True):
        values = jump(net.points(0, run.m))
        np.testing.assert_array_equal(y[0], np.ldexp(values[: run.fitted], -unit))
        scaled = np.ldexp(values, -unit)
        np.testing.assert_allclose(of_net.means[0], scaled.reshape(run.parts, -1).mean(axis=1), rtol=1e-12)
        np.testing.assert_allclose(of_net.absolute, np.abs(scaled).mean(), rtol=1e-12)
        np.testing.assert_allclose(of_net.square, np.square(scaled).mean(), rtol=1e-12)


def test_the_rule_tells_what_corrects_how_many_replicates():
    """By component; the sets of several estimates count together."""
    func = lambda x: np.stack([np.exp(x[0] * x[1]), np.abs(x - 0.5).max(axis=0) < 0.4])  # noqa: E731
    smooth, rough = integrate(func, 4, 8192, method="auto").rule
    assert re.fullmatch(r"polynomials of degree \d+( in [12] of 3 replicates, .* in \d)?", smooth)
    assert rough == "plain mean"
    counts = re.findall(r"in (\d+)", integrate(func, 4, 1024, n_estimates=3).rule[0])
    assert not counts or sum(map(int, counts)) == 12
    told = replicates._told(np.array([[6, 0], [6, 0], [0, 3], [6, 4]]))
    assert told[0] == "polynomials of degree 6 in 3 of 4 replicates, plain mean in 1"
    assert told[1].startswith("plain mean in 2 of 4 replicates, polynomials of degree 3 in 1")


def test_what_it_warns_of():
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert integrate(lambda x: 0 * x[0], 5, 512).integral == 0
        assert np.isnan(integrate(lambda x: np.where(x[0] < 0.5, np.nan, 1.0), 5, 512).integral)
        assert not integrate(lambda x: np.exp(-1e3 * np.square(x - 0.5).sum(axis=0)), 8, 512).success
    assert [w.message.kind for w in caught] == ["zero", "not-finite", "few-samples"]


@pytest.mark.parametrize(
    ("d", "arguments", "message"),
    [
        (21, {}, "d = 1 to 20 dimensions, got d = 21"),
        (4, {"n_points": 63}, "n_points must be at least 64"),
        (4, {"sampler": "sobol"}, "sampler='sobol' does not go"),
        (4, {"order": 2}, "order=2 does not go"),
    ],
)
def test_what_the_rule_does_not_take(d, arguments, message):
    with pytest.raises(ValueError, match=message):
        integrate(lambda x: pytest.fail("called"), d, 512, **arguments)


def scores(found: np.ndarray, truth: np.ndarray) -> float:
    """Σ z² over integrands, of estimates (repetitions, integrands)."""
    z = (found.mean(axis=0) - truth) / found.std(axis=0, ddof=1) * math.sqrt(len(found))
    return float(np.square(z).sum())


def repeated(repetitions: int, d: int) -> tuple[np.ndarray, np.ndarray]:
    members = [m for m in instances(d, 3, rng=9) if m.name not in ("peak", "jump")]  # which few samples meet
    func = lambda x: np.stack([m(x) for m in members])  # noqa: E731
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", vq.IntegrationWarning)
        found = np.array([integrate(func, d, 512, rng=s).integral for s in range(repetitions)])
    return found, np.array([m.integral for m in members])


@pytest.fixture
def many_candidates(monkeypatch):
    """The plain mean is never chosen, and every degree may be."""
    monkeypatch.setattr(replicates, "WORTH", 100)
    monkeypatch.setattr(replicates, "DEGREES_BELOW", 9)
    monkeypatch.setattr(gauss_grid, "FEWEST_NODES", 4)
    monkeypatch.setattr(gauss_grid, "SHARE", 0.5)


@pytest.mark.statistical
@pytest.mark.parametrize("d", [pytest.param(3, marks=pytest.mark.slow), 4])
def test_unbiased(many_candidates, d):
    """A bias of 0.1 standard deviations of each of the 18 would make 108 ± 20 of the sum."""
    # 18 degrees of freedom: exceeded once in 10^6
    assert scores(*repeated(500, d)) < 64


@pytest.mark.statistical
@pytest.mark.parametrize("d", [pytest.param(3, marks=pytest.mark.slow), 4])
def test_a_choice_that_knows_the_replicate_is_biased(monkeypatch, many_candidates, d):
    """The negative control: of the candidates' estimates the smallest."""

    def smallest(parts, plain):
        corrections = np.concatenate([np.zeros((len(parts), 1)), parts.mean(axis=-1)], axis=1)
        return corrections.argmax(axis=1) - 1

    monkeypatch.setattr(replicates, "_best", smallest)
    assert scores(*repeated(150, d)) > 200


def run_of(func, d: int, n: int) -> replicates._Replicates:
    library = Library.of(0, 1)
    integrand = Integrand(Function(func, library), Box([0] * d, [1] * d, library))
    rule = replicates.ReplicateEstimator(integrand, 1, np.random.default_rng(1), 1)
    sizes = replicates.Sizes.of(n, d)
    return replicates._Replicates(integrand, sizes, rule._grid(sizes), rule.rng, 1)


def test_grid_and_replicates_may_have_other_units():
    """The largest of the nodes is 0.96, and that of the samples 1.1, so that they are scaled by other powers of two."""

    def quartic(x):
        return 1.1 * x[0] ** 4

    run = run_of(quartic, 4, 6000)
    _, _, power = run._evaluated()
    assert np.frexp(np.abs(run.grid).max())[1] == 0
    assert power.tolist() == [1]
    r = vq.quad(quartic, [0] * 4, [1] * 4, n_points=6000, method="polynomials", rng=1)
    assert r.rule.startswith("polynomials")
    assert r.integral == pytest.approx(0.22, abs=1e-14)


@pytest.mark.parametrize(("d", "n"), [(3, 1024), (3, 1792), (4, 6000)])
def test_neither_fit_nor_choice_knows_the_replicate(d, n):
    """Whatever its values are, its correction keeps every bit, and that of others changes."""
    run = run_of(lambda x: np.exp(x[0] * x[1] - x[2]), d, n)
    assert (run.grid is None) == (d == 3)
    kept, sums, power = run._evaluated()
    corrections, _ = run._corrections(kept, sums, power)
    assert np.abs(corrections).min() > 1e-8
    rng = np.random.default_rng(5)
    for r in range(run.count):
        other = rng.random((1, run.m))
        other_sums = replicates._PartSums(1, run.m, run.parts)
        other_sums.add(0, other)
        with_others, _ = run._corrections(
            [*kept[:r], other[:, : run.fitted], *kept[r + 1 :]], [*sums[:r], other_sums, *sums[r + 1 :]], power
        )
        assert with_others[r] == corrections[r]
        assert np.count_nonzero(with_others != corrections) >= run.count // 2


def test_whether_a_grid_pays_is_told_by_the_others():
    """Values that are not finite forbid the grid's polynomials to all other replicates, but not to their own."""
    run = run_of(lambda x: np.exp(x[0] * x[1] - x[2]), 4, 6000)
    kept, sums, power = run._evaluated()
    _, as_before = run._corrections(kept, sums, power)
    assert (as_before > 0).all()
    sums[0].means[:] = np.nan
    _, degrees = run._corrections(kept, sums, power)
    assert degrees[0] == as_before[0]
    assert (degrees[1:] == 0).all()


@pytest.mark.filterwarnings("error")
def test_a_pole_at_the_centre_is_no_node():
    for n in (10_000, 200_000):
        r = integrate(lambda x: 1 / np.sqrt(np.square(x - 0.5).sum(axis=0)), 4, n)
        assert r.success
        assert 1.7 < r.integral < 2.1


def nodes_are(value: float, others: float):
    """`value` at the nodes of the grid of 6^4, and `others` times a smooth function elsewhere."""
    nodes = np.unique(gauss_grid.grid_points(6, 4, 0, 6**4))
    return lambda x: np.where(np.isin(x, nodes).all(axis=0), value, others * np.exp(x[0] * x[1]))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("value", "others"), [(math.nan, 1.0), (math.inf, 1.0), (1e200, 1e-200), (1e300, 1.0), (1e-200, 1e200)]
)
def test_values_at_the_nodes_alone_that_predict_nothing_do_no_harm(value, others):
    """The estimate is the plain mean of that component, and another one has its polynomials."""
    func, smooth = nodes_are(value, others), lambda x: np.exp(x[0] * x[1])
    r = integrate(lambda x: np.stack([func(x), smooth(x)]), 4, 6000)
    assert r.integral[0] / others == pytest.approx(1.3179021514544, abs=6 * r.standard_error[0] / others)
    assert r.standard_error[0] < 1e-2 * others
    assert r.integral[1] == integrate(smooth, 4, 6000).integral
    if value != 1e-200:
        assert r.rule[0] == "plain mean"


def test_part_sums_take_blocks_of_any_size():
    values = np.random.default_rng(2).random((2, 256)) - 0.5
    for sizes in ([256], [16, 16, 32, 64, 128], [128, 64, 32, 32], 16 * [16]):
        for parts in (4, 16):
            sums = replicates._PartSums(2, 256, parts)
            begin = 0
            for size in sizes:
                sums.add(begin, values[:, begin : begin + size])
                begin += size
            np.testing.assert_allclose(sums.means, values.reshape(2, parts, -1).mean(axis=2), rtol=1e-12)
            np.testing.assert_allclose(sums.absolute, np.abs(values).mean(axis=1), rtol=1e-12)
            np.testing.assert_allclose(sums.square, np.square(values).mean(axis=1), rtol=1e-12)


def test_the_choice_is_by_the_error_of_means_over_nets(monkeypatch):
    """On the others of the group, and for the plain mean unless a tenth remains."""
    monkeypatch.setattr(replicates, "WORTH", 0.1)
    plain = np.array([[1.0, -1, 1, -1], [2, -2, 2, -2], [4, -4, 4, -4]])
    # What the candidates leave: the first of net 0 nothing, of the others half; the second a quarter everywhere
    left = np.stack([np.stack([0 * plain[0], plain[1] / 2, plain[2] / 2]), plain / 4], axis=1)
    assert replicates._best(plain[:, None] - left, plain).tolist() == [1, 1, 1]
    left[1:, 0] = plain[1:] / 8
    assert replicates._best(plain[:, None] - left, plain).tolist() == [0, 0, 0]
    left[:] = plain[:, None] / 3
    assert replicates._best(plain[:, None] - left, plain).tolist() == [-1, -1, -1]
    left[0] = plain[0] / 100  # of no use to net 0 itself
    assert replicates._best((plain[:, None] - left)[:2], plain[:2]).tolist() == [-1, 0]
    # Means that are off by a constant are no error of a mean over parts
    assert replicates._best(plain[:, None] - 0.1 * left + 7, plain).tolist() == [0, 0, 0]


@pytest.mark.parametrize("factor", [1e12, 1e-12, 1e150, math.inf, math.nan])
def test_the_choice_does_not_know_the_sizes_of_a_nets_own_values(factor):
    rng = np.random.default_rng(3)
    plain = rng.standard_normal((3, 8))
    parts = plain[:, None] - np.array([0.2, 0.1, 0.15])[:, None] * rng.standard_normal((3, 3, 8))
    best = replicates._best(parts, plain)
    assert best.min() >= 0
    for r in range(3):
        with np.errstate(invalid="ignore"):
            of_net = np.where(np.arange(3) == r, factor, 1.0)
            other = replicates._best(parts, plain * of_net[:, None])
        assert other[r] == best[r]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [1e308, 1e-308])
def test_values_at_the_ends_of_the_range_overflow_nowhere(size):
    r = vq.quad(lambda x: size * (0.1 + 0.9 * x[0]), [0] * 4, [1] * 4, n_points=9000, rng=1)
    assert r.integral == pytest.approx(0.55 * size, rel=1e-12)
