"""Models by colour: chosen by other colours, unbiased, the best of the candidates where one is far better."""

import itertools
import math

import numpy as np
import pytest

import voroquad as vq
from voroquad.designs.multi_jittered import period
from voroquad.rules import model_choice
from voroquad.rules.global_fits import GlobalFits, degrees
from voroquad.rules.kriging_rules import krige_strata, strata_in_colours
from voroquad.rules.model_choice import HYSTERESIS, KrigingCandidate, choose_in_strata, partners, scores


def smooth(points):
    return np.exp(points[..., 0]) * np.cos(2 * points[..., -1])


def edge(points):
    normal = np.arange(1, points.shape[-1] + 1.0)
    return np.where(points @ normal < 0.4 * normal.sum(), 1.0, 0.0)


def choose(samples, *fields):
    f = np.stack([field(samples.points) for field in fields], axis=1)
    return choose_in_strata(samples.points, samples.strata, period(samples.d), f, 1), f


@pytest.mark.parametrize(("n", "d"), [(100, 2), (216, 3)])
def test_smooth_integrands_take_polynomials_and_edges_kriging(n, d):
    samples = vq.sample("multi-jittered", n, d, sets=3, rng=1)
    choice, f = choose(samples, smooth, edge)
    assert choice.names == ("kriging", *(f"degree {p}" for p in degrees(n, d)))
    assert (choice.chosen[:, 0] > 0).all()
    assert (choice.chosen[:, 1] == 0).mean() > 0.8
    np.testing.assert_allclose(choice.weights.sum(axis=-1), 1, atol=1e-12)
    kriged, _ = krige_strata(samples.points, samples.strata, period(d), f, 1)
    truth = (math.e - 1) * math.sin(2) / 2
    before, after = (abs((w * f[:, 0]).sum(axis=-1) - truth).max() for w in (kriged, choice.weights[:, 0]))
    assert after < before / 3


def test_polynomials_of_the_highest_degree_are_exact():
    samples = vq.sample("multi-jittered", 128, 2, sets=2, rng=2)
    highest = max(degrees(128, 2))
    choice, f = choose(samples, lambda x: x[..., 0] ** highest)
    np.testing.assert_allclose((choice.weights * f).sum(axis=-1), 1 / (highest + 1), atol=1e-13)
    assert abs(choice.residuals).max() < 1e-12


def test_each_field_and_set_chooses_for_itself():
    samples = vq.sample("multi-jittered", 64, 2, sets=3, rng=3)
    together, f = choose(samples, smooth, edge)
    for s, i in itertools.product(range(3), range(2)):
        alone = choose_in_strata(samples.points[s : s + 1], samples.strata, 3, f[s : s + 1, i : i + 1], 1)
        np.testing.assert_array_equal(alone.chosen[0, 0], together.chosen[s, i])
        np.testing.assert_allclose(alone.weights[0, 0], together.weights[s, i], atol=1e-13)
        np.testing.assert_allclose(alone.residuals[0, 0], together.residuals[s, i], atol=1e-13)


@pytest.fixture(params=[(49, 2), (64, 3), (81, 4)], ids=["d=2", "d=3", "d=4"])
def two_sets(request):
    """Points and values of two sets, and the colours of both."""
    n, d = request.param
    samples = vq.sample("multi-jittered", n, d, sets=2, rng=4)
    group, axes = strata_in_colours(samples.strata, period(d))
    f = np.stack([smooth(samples.points), edge(samples.points)], axis=1)
    return samples, group, axes, f


def scores_of(points, group, axes, f):
    tried = degrees(*points.shape)
    candidates = [KrigingCandidate(points, group, axes, 1), GlobalFits(points, group, axes, tried)]
    return scores(candidates, np.unique(group), group, f)


def test_neither_score_nor_prediction_knows_values_of_the_colour(two_sets):
    samples, group, axes, f = two_sets
    before = scores_of(samples.points[0], group, axes, f[0])
    choice = choose_in_strata(samples.points, samples.strata, period(samples.d), f, 1)
    for c in np.unique(group):
        own = group == c
        other = f.copy()
        other[..., own] += np.random.default_rng(5).standard_normal(other[..., own].shape)
        after = scores_of(samples.points[0], group, axes, other[0])
        np.testing.assert_allclose(after[..., c], before[..., c], rtol=1e-9)
        assert (abs(np.delete(after - before, c, axis=-1)) > 1e-6).all(axis=0).any()
        again = choose_in_strata(samples.points, samples.strata, period(samples.d), other, 1)
        np.testing.assert_array_equal(again.chosen[..., c], choice.chosen[..., c])
        np.testing.assert_allclose((again.residuals - choice.residuals)[..., own], (other - f)[..., own], atol=1e-9)


def test_scores_know_no_position_of_the_colour(two_sets):
    samples, group, axes, f = two_sets
    before = scores_of(samples.points[0], group, axes, f[0])
    for c in np.unique(group):
        points = np.where((group == c)[:, None], samples.points[1], samples.points[0])
        after = scores_of(points, group, axes, f[0])
        np.testing.assert_allclose(after[..., c], before[..., c], rtol=1e-8)
        assert (abs(np.delete(after - before, c, axis=-1)) > 1e-6).any()


def test_the_estimate_is_its_definition():
    """1/n Σ_c [ ∫ f̂^(−c) dμ_c + Σ_{i∈c} (f_i − f̂^(−c)(x_i)) ] with the chosen models."""
    samples = vq.sample("multi-jittered", 49, 2, sets=1, rng=8)
    group, axes = strata_in_colours(samples.strata, 3)
    choice, f = choose(samples, smooth, edge)
    x, values = samples.points[0], f[0]
    candidates = [KrigingCandidate(x, group, axes, 1), GlobalFits(x, group, axes, degrees(49, 2))]
    for i in range(2):
        estimate = 0.0
        for c in np.unique(group):
            by_model = np.concatenate([some.weights(c) for some in candidates])
            missed = np.concatenate([some.left_out((c,), values) for some in candidates])
            estimate += by_model[choice.chosen[0, i, c]] @ values[i] / 49
            np.testing.assert_allclose(choice.residuals[0, i, group == c], missed[choice.chosen[0, i, c], i])
        assert estimate == pytest.approx(choice.weights[0, i] @ values[i], abs=1e-13)


class Constants:
    """Candidates that miss all values by a number of their own, and that of each group by its number more."""

    def __init__(self, missed):
        self._missed = missed
        self.names = tuple(f"model {m}" for m in range(len(missed)))

    def left_out(self, groups, values):
        return np.array([[[missed[g] for g in sorted(groups)]] for missed in self._missed])

    def weights(self, group):
        return np.arange(float(len(self._missed)))[:, None] * np.ones(4)


def test_scores_add_the_squares_of_the_partners(monkeypatch):
    """Four groups of one sample, each judged by its neighbours on either side."""
    monkeypatch.setattr(model_choice, "PARTNERS", 1)
    group, missed = np.arange(4), [[1.0, 2, 3, 4], [5, np.nan, 7, np.inf]]
    found = scores([Constants(missed)], group, group, np.zeros((1, 4)))
    np.testing.assert_array_equal(found[0, 0], [4 + 16, 1 + 9, 4 + 16, 9 + 1])
    np.testing.assert_array_equal(found[1, 0], [np.inf, 25 + 49, np.inf, 49 + 25])


@pytest.mark.parametrize(("second", "chosen"), [(0.9, 0), (1.1 * HYSTERESIS, 0), (0.9 * HYSTERESIS, 1), (0.0, 1)])
def test_kriging_is_left_for_what_is_far_better(second, chosen):
    group = np.arange(4)
    candidates = Constants([[1.0] * 4, [math.sqrt(second)] * 4, [2.0] * 4])
    weights, residuals, best = model_choice._choose([candidates], group, np.zeros((1, 4)))
    assert (best == chosen).all()
    np.testing.assert_array_equal(weights, np.full((1, 4), 4.0 * chosen))
    np.testing.assert_array_equal(residuals, np.full((1, 4), [1.0, math.sqrt(second)][chosen]))


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 8, 9, 16])
@pytest.mark.parametrize(("of_each", "reach"), [(3, 4), (10, 3), (15, 2), (30, 1), (200, 1)])
def test_partners_stand_on_either_side_in_cyclic_order(count, of_each, reach):
    groups = np.arange(count) * 2
    pairs = partners(groups, count * of_each)
    assert len(pairs) == len(set(map(frozenset, pairs)))
    for i in range(count):
        found = {*(e for c, e in pairs if c == groups[i]), *(c for c, e in pairs if e == groups[i])}
        steps = [s for s in range(1, count) if min(s, count - s) <= reach]
        assert found == ({groups[(i + s) % count] for s in steps} if count > 2 else set())


def kink(points):
    return np.exp(-6 * abs(points - np.array([0.4, 0.6])).sum(axis=-1))


def estimates(sets, own, rng):
    """Of integrands at 7 × 7 points, where the choice is by other colours or, as it must not be, by a colour's own."""
    samples = vq.sample("multi-jittered", 49, 2, sets=sets, rng=rng)
    group, axes = strata_in_colours(samples.strata, 3)
    f = np.stack([smooth(3 * samples.points), edge(samples.points), kink(samples.points)], axis=1)
    if not own:
        return (choose_in_strata(samples.points, samples.strata, 3, f, 1).weights * f).sum(axis=-1)
    found = []
    for x, values in zip(samples.points, f, strict=True):
        candidates = [KrigingCandidate(x, group, axes, 1), GlobalFits(x, group, axes, degrees(49, 2))]
        estimate = np.zeros(3)
        for c in np.unique(group):
            missed = np.concatenate([some.left_out((c,), values) for some in candidates])
            best = np.square(missed).sum(axis=-1).argmin(axis=0)
            weights = np.concatenate([some.weights(c) for some in candidates])[best]
            estimate += (weights * values).sum(axis=-1) / 49
        found.append(estimate)
    return np.array(found)


def z_scores(errors):
    return errors.mean(axis=0) / errors.std(axis=0, ddof=1) * math.sqrt(len(errors))


@pytest.mark.slow
@pytest.mark.statistical
def test_the_choice_costs_no_bias_and_one_by_own_residuals_would():
    of_kink = math.prod((2 - math.exp(-6 * u) - math.exp(-6 * (1 - u))) / 6 for u in (0.4, 0.6))
    truth = np.array([(math.e**3 - 1) / 3 * math.sin(6) / 6, 0.35, of_kink])
    assert abs(z_scores(estimates(20_000, False, 9) - truth)).max() < 4.7
    assert abs(z_scores(estimates(5_000, True, 10) - truth)).max() > 8
