"""Chosen models as the rule of quad: for which sets, with which error bar, and what is told of them."""

import numpy as np
import pytest

import voroquad as vq
from voroquad.designs.multi_jittered import period
from voroquad.rules.chosen_fits import MOST_ON_LINE, chooses, fit_by_choice
from voroquad.rules.error_bars import in_box, on_line
from voroquad.rules.kriging_rules import strata_in_colours
from voroquad.rules.line_fits import choose_on_line
from voroquad.rules.method import CHOICE
from voroquad.rules.model_choice import choose_in_strata


@pytest.mark.parametrize(
    ("n", "d", "expected"),
    [
        (4, 1, False), (5, 1, True), (MOST_ON_LINE + 1, 1, False), (4, 2, False), (9, 2, True), (2025, 2, True),
        (2116, 2, False), (8, 3, True), (16, 4, True), (64, 6, False),
    ],
)  # fmt: skip
def test_models_are_chosen_where_there_are_colours_and_one_system(n, d, expected):
    assert chooses(vq.sample("multi-jittered", n, d, rng=1).kind) is expected
    assert not chooses(vq.sample("stratified", n, d, rng=1).kind)


def values_of(samples):
    x = samples.batch
    return np.stack([np.exp(x.sum(axis=-1)), np.where(x[..., 0] < 0.4, 1.0, 0.0)], axis=1)


def test_the_bar_of_a_line():
    samples = vq.sample("multi-jittered", 40, 1, sets=2, rng=1)
    f, x = values_of(samples), samples.points[..., 0]
    fit, choice = fit_by_choice(samples, CHOICE, 1, f), choose_on_line(x, f)
    np.testing.assert_array_equal(fit.weights, choice.weights)
    expected = on_line(x[0], f[0], choice.residuals[0], choice.around[0], choice.reference[0])
    found = fit.bar(fit.residuals[0])
    np.testing.assert_array_equal(found.error, expected.error)
    np.testing.assert_array_equal(found.degrees_of_freedom, expected.degrees_of_freedom)


@pytest.mark.parametrize(("n", "d"), [(64, 2), (64, 3), (256, 4)])
def test_the_bar_of_a_box(n, d, monkeypatch):
    monkeypatch.setattr("voroquad.rules.error_bars.OF_CURVES", 1e3)  # where there is a face, it decides
    samples = vq.sample("multi-jittered", n, d, sets=2, rng=1)
    f = np.concatenate([values_of(samples), samples.points[:, None, :, 0] ** -0.4], axis=1)
    fit, choice = (
        fit_by_choice(samples, CHOICE, 1, f),
        choose_in_strata(samples.points, samples.strata, period(d), f, 1),
    )
    np.testing.assert_array_equal(fit.residuals, choice.residuals)
    colours, _ = strata_in_colours(samples.strata, period(d))
    expected = in_box(samples.points[0], samples.strata, colours, f[0], choice.residuals[0])
    np.testing.assert_array_equal(fit.bar(fit.residuals[0]).error, expected.error)


def test_without_values_there_is_nothing_to_choose():
    with pytest.raises(ValueError, match="values: the integrand's values choose"):
        fit_by_choice(vq.sample("multi-jittered", 64, 2, rng=1), CHOICE, 1)


def test_quad_tells_what_was_chosen_by_component():
    def f(x):
        return {"smooth": np.exp(x[0]), "rough": np.stack([1.0 * (x[0] + x[1] < 0.9), np.exp(1j * x[1])])}

    r = vq.quad(f, [0, 0], [1, 1], n_points=100, rng=1)
    assert r.rule["smooth"].startswith("degree")
    assert r.rule["rough"].shape == (2,)
    assert "kriging" in r.rule["rough"][0]
    assert vq.quad(lambda x: np.exp(x[0]), 0, 1, n_points=64, rng=1).rule.startswith("order 8")
    assert vq.quad(lambda x: x[0], [0, 0], [1, 1], n_points=64, order=2, rng=1).rule == "order 2"
    assert vq.quad(lambda x: x[0], [0] * 5, [1] * 5, n_points=64, rng=1).rule == "kriging across 4 sets"
    assert vq.quad(lambda x: x[0], [0, 0], [1, 1], n_points=64, order="kriging", rng=1).rule == "kriging"


def test_components_do_not_depend_on_those_beside_them():
    def both(x):
        return np.stack([np.exp(x[0] * x[1]), 1.0 * (x[0] < x[1] ** 2)])

    r = vq.quad(both, [0, 0], [1, 1], n_points=121, rng=5)
    for i in range(2):
        alone = vq.quad(lambda x, i=i: both(x)[i], [0, 0], [1, 1], n_points=121, rng=5)
        assert alone.integral == pytest.approx(r.integral[i], rel=1e-13)
        half = np.subtract(*alone.confidence_interval()[::-1]) / 2
        half_beside = np.subtract(*(bound[i] for bound in r.confidence_interval()[::-1])) / 2
        assert half == pytest.approx(half_beside, rel=1e-9)
        assert alone.rule == r.rule[i]
        assert alone.degrees_of_freedom >= r.degrees_of_freedom * (1 - 1e-6)
