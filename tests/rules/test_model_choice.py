"""Models by colour: chosen by other colours, unbiased, the best of the candidates where one is far better."""

import itertools
import math

import numpy as np
import pytest

import voroquad as vq
from voroquad.designs.multi_jittered import period
from voroquad.rules import model_choice
from voroquad.rules.global_fits import GlobalFits, degrees
from voroquad.rules.groups import Groups
from voroquad.rules.kriging import model
from voroquad.rules.kriging_rules import krige_strata, strata_in_colours
from voroquad.rules.model_choice import (
    HYSTERESIS,
    KRIGING,
    SCREENED,
    choose_in_strata,
    kriging_models,
    partners,
    scores,
)
from voroquad.rules.tiled_kriging import TiledKriging, spread_out, tiles


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
    assert choice.names == (*KRIGING, *(f"degree {p}" for p in degrees(n, d)))
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
    group, _ = strata_in_colours(samples.strata, period(d))
    f = np.stack([smooth(samples.points), edge(samples.points)], axis=1)
    return samples, group, f


def candidates_of(samples, points):
    """All candidates, and the colours."""
    group, axes = strata_in_colours(samples.strata, period(samples.d))
    groups = Groups.of(group, group.max() + 1)
    fits = GlobalFits(points, groups, axes, degrees(*points.shape))
    return [*kriging_models(points, tiles(samples.strata, period(samples.d)), len(points), 1), fits], group


def scores_of(samples, points, f):
    candidates, group = candidates_of(samples, points)
    pairs = partners(group.max() + 1, len(points))
    squares = np.concatenate([some.squares(pairs, f) for some in candidates])
    return scores(squares, pairs, group.max() + 1)


def test_neither_score_nor_prediction_knows_values_of_the_colour(two_sets):
    samples, group, f = two_sets
    before = scores_of(samples, samples.points[0], f[0])
    choice = choose_in_strata(samples.points, samples.strata, period(samples.d), f, 1)
    for c in np.unique(group):
        own = group == c
        other = f.copy()
        other[..., own] += np.random.default_rng(5).standard_normal(other[..., own].shape)
        after = scores_of(samples, samples.points[0], other[0])
        np.testing.assert_allclose(after[..., c], before[..., c], rtol=1e-4)
        assert (abs(np.delete(after - before, c, axis=-1)) > 1e-6).all(axis=0).any()
        again = choose_in_strata(samples.points, samples.strata, period(samples.d), other, 1)
        np.testing.assert_array_equal(again.chosen[..., c], choice.chosen[..., c])
        np.testing.assert_allclose((again.residuals - choice.residuals)[..., own], (other - f)[..., own], atol=1e-9)


@pytest.mark.parametrize("huge", [1e9, 1e300])
@pytest.mark.parametrize(("n", "d"), [(100, 2), (64, 3), (400, 2)])
def test_no_value_of_a_colour_enters_its_choice_or_prediction(n, d, huge):
    """Not even by rounding: to the last bit."""
    samples = vq.sample("multi-jittered", n, d, sets=1, rng=1)
    group, _ = strata_in_colours(samples.strata, period(d))
    f = np.stack([np.exp(samples.points.sum(axis=-1)), smooth(samples.points), edge(samples.points)], axis=1)
    chosen = choose_in_strata(samples.points, samples.strata, period(d), f, 1).chosen
    candidates, _ = candidates_of(samples, samples.points[0])
    for c in np.unique(group)[::3]:
        own = group == c
        none, other = (np.where(own, value, f) for value in (0.0, huge))
        other[..., np.flatnonzero(own)[0]] *= -1
        again = choose_in_strata(samples.points, samples.strata, period(d), other, 1).chosen
        np.testing.assert_array_equal(again[..., c], chosen[..., c])
        for some in candidates:
            for which in range(len(some.names)):
                predicted = -some.residuals(which, np.array([c]), none[0])[:, own]
                residuals = some.residuals(which, np.array([c]), other[0])[:, own]
                np.testing.assert_array_equal(residuals, other[0][:, own] - predicted)
            pairs = np.array([[c, (c + 1) % (group.max() + 1)]])
            of_partner = (some.squares(pairs, values[0])[..., 1] for values in (f, other))
            np.testing.assert_array_equal(*of_partner)


def test_scores_know_no_position_of_the_colour(two_sets):
    samples, group, f = two_sets
    before = scores_of(samples, samples.points[0], f[0])
    for c in np.unique(group):
        points = np.where((group == c)[:, None], samples.points[1], samples.points[0])
        after = scores_of(samples, points, f[0])
        np.testing.assert_allclose(after[..., c], before[..., c], rtol=1e-4)
        assert (abs(np.delete(after - before, c, axis=-1)) > 1e-6).any()


def test_the_estimate_is_its_definition():
    """1/n Σ_c [ ∫ f̂^(−c) dμ_c + Σ_{i∈c} (f_i − f̂^(−c)(x_i)) ] with the chosen models."""
    samples = vq.sample("multi-jittered", 49, 2, sets=1, rng=8)
    choice, f = choose(samples, smooth, edge)
    candidates, group = candidates_of(samples, samples.points[0])
    models = [(some, k) for some in candidates for k in range(len(some.names))]
    residuals = [some.residuals(k, np.arange(9), f[0]) for some, k in models]
    for i in range(2):
        estimate = 0.0
        for c in np.unique(group):
            some, k = models[choice.chosen[0, i, c]]
            estimate += some.weights(k, np.array([c]))[0] @ f[0, i] / 49
            expected = residuals[choice.chosen[0, i, c]][i, group == c]
            np.testing.assert_allclose(choice.residuals[0, i, group == c], expected)
        assert estimate == pytest.approx(choice.weights[0, i] @ f[0, i], abs=1e-11)  # some fits are ill-conditioned


class Constants:
    """Candidates that miss the values of all groups, of one sample each, by a number of their own and of the group."""

    def __init__(self, missed):
        self._missed = np.array(missed)
        self.names = tuple(f"model {m}" for m in range(len(missed)))

    def squares(self, pairs, values):
        return np.square(self._missed[:, None, pairs])

    def residuals(self, which, groups, values):
        return np.where(np.isin(np.arange(4), groups), self._missed[which], 0.0)[None]

    def weights(self, which, groups):
        return np.full((len(groups), 4), float(which))


def test_scores_add_the_squares_of_the_partners():
    """Four groups of one sample, each judged by its neighbours on either side."""
    missed = np.array([[1.0, 2, 3, 4], [5, np.nan, 7, np.inf]])
    pairs = np.array([[0, 1], [1, 2], [2, 3], [0, 3]])
    found = scores(np.square(missed[:, None, pairs]), pairs, 4)
    np.testing.assert_array_equal(found[0, 0], [4 + 16, 1 + 9, 4 + 16, 9 + 1])
    np.testing.assert_array_equal(found[1, 0], [np.inf, 25 + 49, np.inf, 49 + 25])


@pytest.mark.parametrize(
    ("shape", "pairs", "message"),
    [
        ((1, 1, 2, 2), [[0, 1]], "squares: their shape"),
        ((1, 1, 1, 3), [[0, 1]], "squares: their shape"),
        ((1, 1, 1, 2), [[0, 1, 2]], "pairs: their shape"),
        ((1, 1, 1, 2), [[0, 3]], "group: numbers"),
        ((1, 1, 1, 2), [[-1, 0]], "group: numbers"),
    ],
)
def test_pairs_that_do_not_fit_their_squares_are_an_error(shape, pairs, message):
    with pytest.raises(ValueError, match=message):
        model_choice.scores(np.zeros(shape), np.array(pairs), 3)


@pytest.mark.parametrize(("second", "chosen"), [(0.9, 0), (1.1 * HYSTERESIS, 0), (0.9 * HYSTERESIS, 1), (0.0, 1)])
def test_kriging_is_left_for_what_is_far_better(second, chosen):
    group = np.arange(4)
    candidates = Constants([[1.0] * 4, [math.sqrt(second)] * 4, [2.0] * 4])
    weights, residuals, best = model_choice._choose([candidates], np.ones((3, 1, 4), bool), group, np.zeros((1, 4)))
    assert (best == chosen).all()
    np.testing.assert_array_equal(weights, np.full((1, 4), 4.0 * chosen))
    np.testing.assert_array_equal(residuals, np.full((1, 4), [1.0, math.sqrt(second)][chosen]))


def test_a_component_takes_no_model_that_is_in_question_for_others_only():
    candidates = Constants([[1.0] * 4, [0.1] * 4, [2.0] * 4])
    in_question = np.ones((3, 2, 4), dtype=bool)
    in_question[1, 1, 2:] = False
    _, _, best = model_choice._choose([candidates], in_question, np.arange(4), np.zeros((2, 4)))
    np.testing.assert_array_equal(best, [[1, 1, 1, 1], [1, 1, 0, 0]])


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 8, 9, 16])
@pytest.mark.parametrize(("of_each", "reach"), [(3, 4), (10, 3), (15, 2), (30, 1)])
def test_partners_stand_on_either_side_in_cyclic_order(count, of_each, reach):
    pairs = partners(count, count * of_each).tolist()
    assert len(pairs) == len(set(map(frozenset, pairs)))
    for i in range(count):
        found = {*(e for c, e in pairs if c == i), *(c for c, e in pairs if e == i)}
        steps = [s for s in range(1, count) if min(s, count - s) <= reach]
        assert found == ({(i + s) % count for s in steps} if count > 2 else set())


@pytest.mark.parametrize("count", [3, 8, 9, 16])
def test_one_partner_is_enough_if_it_is_large(count):
    pairs = partners(count, 60 * count)
    assert len(pairs) == -(-count // 2)
    assert set(pairs.ravel()) == set(range(count))
    assert (pairs[:, 0] != pairs[:, 1]).all()


def kink(points):
    centres = np.array([0.4, 0.6, 0.4, 0.6])[: points.shape[-1]]
    return np.exp(-6 * abs(points - centres).sum(axis=-1))


def truth(d):
    """The integrals of smooth(3 x), edge and kink."""
    normal = np.arange(1, d + 1.0)
    of_kink = math.prod((2 - math.exp(-6 * u) - math.exp(-6 * (1 - u))) / 6 for u in (0.4, 0.6, 0.4, 0.6)[:d])
    corners = np.array(list(itertools.product((0, 1), repeat=d)))
    below = np.maximum(0, 0.4 * normal.sum() - corners @ normal) ** d
    of_edge = ((-1.0) ** corners.sum(axis=1) @ below) / (math.factorial(d) * normal.prod())
    return np.array([(math.e**3 - 1) / 3 * math.sin(6) / 6, of_edge, of_kink])


def estimates(n, d, sets, own, rng):
    """Of integrands in sets of n points, where the choice is by other colours or, as it must not be, a colour's own."""
    samples = vq.sample("multi-jittered", n, d, sets=sets, rng=rng)
    f = np.stack([smooth(3 * samples.points), edge(samples.points), kink(samples.points)], axis=1)
    if not own:
        return (choose_in_strata(samples.points, samples.strata, period(d), f, 1).weights * f).sum(axis=-1)
    found = []
    for x, values in zip(samples.points, f, strict=True):
        candidates, group = candidates_of(samples, x)
        groups = np.unique(group)
        models = [(some, k) for some in candidates for k in range(len(some.names))]
        missed = np.array([some.residuals(k, groups, values) for some, k in models])
        weights = np.array([some.weights(k, groups) for some, k in models])
        estimate = np.zeros(3)
        for c in groups:
            best = np.square(missed[..., group == c]).sum(axis=-1).argmin(axis=0)
            estimate += (weights[best, c] * values).sum(axis=-1) / n
        found.append(estimate)
    return np.array(found)


def z_scores(errors):
    return errors.mean(axis=0) / errors.std(axis=0, ddof=1) * math.sqrt(len(errors))


@pytest.mark.slow
@pytest.mark.statistical
@pytest.mark.parametrize(
    ("n", "d", "of_control"), [(16, 2, 20_000), (49, 2, 20_000), (16, 3, 80_000), (24, 4, 20_000), (54, 4, 20_000)]
)
def test_the_choice_costs_no_bias_and_one_by_own_residuals_would(n, d, of_control):
    """At the smallest sizes where there is a choice, and above: the bias of the control falls with the size.

    At 16 points in d = 3 it is .03 standard deviations, and takes more sets to be seen.
    """
    assert abs(z_scores(estimates(n, d, 20_000, False, 9) - truth(d))).max() < 4.7
    assert abs(z_scores(estimates(n, d, of_control, True, 10) - truth(d))).max() > 6


def bell(points):
    return np.exp(-(20 if points.shape[-1] == 2 else 8) * np.square(points - 0.4).sum(axis=-1))


@pytest.mark.parametrize(("n", "d"), [(400, 2), (512, 3)])
def test_smooth_bells_take_kriging_with_little_noise(n, d):
    """More than are screened: polynomials and kriging for all kinds have at least three times the error."""
    samples = vq.sample("multi-jittered", n, d, sets=4, rng=1)
    assert n > SCREENED
    choice, f = choose(samples, bell, edge)
    assert np.isin(choice.chosen[:, 0], (1, 2)).mean() > 0.9
    assert (choice.chosen[:, 1] == 0).mean() > 0.9
    kriged, _ = krige_strata(samples.points, samples.strata, period(d), f, 1)
    root = math.sqrt(20 if d == 2 else 8)
    truth = (math.sqrt(math.pi) / (2 * root) * (math.erf(root * 0.6) + math.erf(root * 0.4))) ** d
    before, after = (np.square((w * f[:, 0]).sum(axis=-1) - truth).mean() for w in (kriged, choice.weights[:, 0]))
    assert after < before / 9


def test_screening_knows_neither_values_nor_positions_of_the_colour():
    samples = vq.sample("multi-jittered", 400, 2, sets=2, rng=7)
    group, _ = strata_in_colours(samples.strata, 3)
    f = np.stack([bell(samples.points), smooth(samples.points), edge(samples.points)], axis=1)
    part = spread_out(samples.strata, 3, SCREENED)
    pairs = partners(9, SCREENED)

    def screened(points, values):
        models = kriging_models(points, [part], SCREENED, 1)
        return scores(np.concatenate([some.squares(pairs, values) for some in models]), pairs, 9)

    before = screened(samples.points[0], f[0])
    assert (before[1, 0] < before[0, 0] / 9).all()  # the bell
    assert (before[0, 2] < before[1, 2]).all()  # the edge
    for c in range(9):
        own = group == c
        values = np.where(own, np.random.default_rng(5).standard_normal(f[0].shape), f[0])
        np.testing.assert_allclose(screened(samples.points[0], values)[..., c], before[..., c], rtol=1e-3)
        points = np.where(own[:, None], samples.points[1], samples.points[0])
        np.testing.assert_allclose(screened(points, f[0])[..., c], before[..., c], rtol=1e-2)


def test_of_many_samples_only_the_model_of_the_screening_is_fitted(monkeypatch):
    """What the screening assumes for all kinds is for as many samples as it has."""
    fitted = []
    original = TiledKriging._prediction

    def counted(self, tile, points):
        fitted.append((len(points), self._assumed))
        return original(self, tile, points)

    monkeypatch.setattr(TiledKriging, "_prediction", counted)
    choose(vq.sample("multi-jittered", 512, 3, sets=1, rng=1), edge)
    assert [n for n, _ in fitted] == [SCREENED, SCREENED, SCREENED, 512]
    assert [fitted[0][1], fitted[-1][1]] == [model(SCREENED, 3), model(512, 3)]


def test_what_smooth_models_miss_at_least_knows_no_value_of_the_colour():
    """A huge value makes rounding of smooth models count for all colours but its own."""
    candidates = Constants([[1.0] * 4, [0.1] * 4, [2.0] * 4])
    values = np.array([[0.0, 0.0, 1e13, 0.0]])
    _, _, best = model_choice._choose([candidates], np.ones((3, 1, 4), bool), np.arange(4), values)
    np.testing.assert_array_equal(best[0], [0, 0, 1, 0])
