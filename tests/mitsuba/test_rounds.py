"""Rounds: their mean, its variance, and a state that goes on where it ended."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from voroquad.mitsuba.accumulation import Pass
from voroquad.mitsuba.blend import checkerboard
from voroquad.mitsuba.rounds import Rounds

SHAPE = (20, 24)
TRUTH = np.linspace(1, 2, 20 * 24).reshape(*SHAPE, 1) * [1.0, 0.5, 2.0]


def pass_(rng, domain=0.3, other=0.3):
    """A round: noise of the domain, which the weights remove, and of the rest, which they raise."""
    of_domain = domain * (rng.exponential(size=(*SHAPE, 3)) - 1)
    plain = TRUTH + of_domain + other * rng.standard_normal((*SHAPE, 3))
    difference = -of_domain + 0.5 * other * rng.standard_normal((*SHAPE, 3))
    added = 0.5 * other * rng.standard_normal((*SHAPE, 3))  # to the noise of the rest, as contrasts tell it
    half = checkerboard(*SHAPE)[..., None]
    alpha = np.full((*SHAPE, 1), 0.5)
    halves = np.stack([difference * (half == h) for h in (0, 1)])
    return Pass(np.concatenate([plain, alpha], -1), halves, plain, difference, added)


def render(seed, count, blend=True, **noise):
    rng = np.random.default_rng(seed)
    rounds = Rounds((*SHAPE, 4), blend=blend)
    for _ in range(count):
        rounds.add(pass_(rng, **noise))
    return rounds


def test_a_round_is_compared_with_pixels_before_the_films_filter():
    rng = np.random.default_rng(1)
    passes = [pass_(rng) for _ in range(2)]
    passes = [dataclasses.replace(done, plain=done.plain + 9) for done in passes]  # what a filter makes of it
    rounds = Rounds((*SHAPE, 4))
    for done in passes:
        rounds.add(done)
    np.testing.assert_allclose(rounds.plain, passes[0].pixel_plain + passes[1].pixel_plain)


def test_without_blend_it_is_the_weighted_mean():
    rng = np.random.default_rng(1)
    passes = [pass_(rng) for _ in range(5)]
    rounds = Rounds((*SHAPE, 4), blend=False)
    for done in passes:
        rounds.add(done)
    weighted = [done.plain[..., :3] + done.differences.sum(0) for done in passes]
    np.testing.assert_allclose(rounds.image[..., :3], np.mean(weighted, 0))
    np.testing.assert_allclose(rounds.image[..., 3], 0.5)
    np.testing.assert_allclose(rounds.variance, np.var(weighted, 0, ddof=1) / 5, rtol=1e-9)
    np.testing.assert_array_equal(rounds.mean_lambda, 1)


@pytest.mark.statistical
@pytest.mark.parametrize("count", [1, 2, 6])
def test_blended_rounds_are_unbiased_and_know_their_error(count):
    """Over 400 renders: the mean is the truth, and the mean estimated variance is the true one."""
    images, variances = [], []
    for seed in range(400):
        rounds = render(seed, count)
        images.append(rounds.image[..., :3])
        variances.append(rounds.variance if count > 1 else np.nan)
    images = np.stack(images)
    z = (images.mean(0) - TRUTH) / (images.std(0, ddof=1) / np.sqrt(400))
    # 1440 independent values: the mean of z is 0 ± .026, of z² 1 ± .037
    assert abs(z.mean()) < 5 * 0.026
    assert abs(np.mean(z**2) - 1) < 5 * 0.037
    if count > 1:
        assert np.mean(variances) == pytest.approx(images.var(0, ddof=1).mean(), rel=0.05)


def test_blend_is_no_worse_than_either_way():
    for noise in ({"domain": 0.5, "other": 0.05}, {"domain": 0.05, "other": 0.5}, {"domain": 0.3, "other": 0.3}):
        errors = np.zeros(3)
        for seed in range(10):
            rounds, weighted = (render(seed, 8, blend=blend, **noise) for blend in (True, False))
            images = rounds.image[..., :3], rounds.plain / 8, weighted.image[..., :3]
            errors += [np.mean((image - TRUTH) ** 2) for image in images]
        assert errors[0] < 1.02 * errors[1:].min() + 0.01 * errors[1:].max()


def test_a_rounds_lambda_does_not_know_that_round():
    """Two renders that differ in the third round only have the same λ in it."""
    totals = []
    for last in (5, 6):
        rounds, rng = Rounds((*SHAPE, 4)), np.random.default_rng(1)
        for _ in range(2):
            rounds.add(pass_(rng))
        before = rounds.lambdas.copy()
        rounds.add(pass_(np.random.default_rng(last), domain=0.01, other=1))
        totals.append(rounds.lambdas - before)
        rounds.add(pass_(rng))  # but the next round's does
        totals.append(rounds.lambdas - before - totals[-1])
    np.testing.assert_array_equal(totals[0], totals[2])
    assert np.abs(totals[1] - totals[3]).max() > 1e-3


def test_a_pixel_that_is_not_finite_stays_one():
    """Mean and error are those of the others, and the number of those that are not finite is known."""
    whole, marred = (Rounds((*SHAPE, 4)) for _ in range(2))
    rng = np.random.default_rng(1)
    for k in range(6):
        done = pass_(rng)
        whole.add(done)
        if k == 2:
            for image in (done.plain, done.differences[0], done.pixel_plain, done.pixel_difference, done.pixel_noise):
                image[4, 6, 1] = np.nan
                image[9, 9, 0] = np.inf
        marred.add(done)
    finite = np.ones(SHAPE, bool)
    finite[4, 6] = finite[9, 9] = False
    np.testing.assert_array_equal(marred.finite, finite)
    np.testing.assert_array_equal(np.isfinite(marred.image).all(-1), finite)
    np.testing.assert_allclose(marred.image[finite], whole.image[finite], atol=0.02)
    assert marred.error == pytest.approx(whole.error, rel=0.02)
    assert marred.mean == pytest.approx(whole.image[..., :3].mean(), rel=0.01)


def test_no_error_can_be_told_of_a_black_image():
    nothing = np.zeros((*SHAPE, 3))
    rounds = Rounds((*SHAPE, 3))
    for _ in range(3):
        rounds.add(Pass(nothing, nothing[None], nothing, nothing, nothing))
    assert np.isnan(rounds.error)
    for _ in range(3):
        rounds.add(Pass(nothing + np.nan, nothing[None], nothing, nothing, nothing))
    assert np.isnan(rounds.error)
    assert not rounds.finite.any()


def test_error_falls_with_the_rounds():
    assert render(1, 1).error == np.inf
    assert render(1, 32).error == pytest.approx(render(1, 8).error / 2, rel=0.1)
    with pytest.raises(ValueError, match="two rounds or more"):
        render(1, 1).variance  # noqa: B018


KEY = {"domain": "lens", "seed": 3, "size": [24, 20]}


@pytest.mark.parametrize("at", [1, 3])
def test_a_saved_state_goes_on_with_the_same_bits(tmp_path, at):
    rng = np.random.default_rng(5)
    passes = [pass_(rng) for _ in range(6)]
    whole, first = Rounds((*SHAPE, 4)), Rounds((*SHAPE, 4))
    for done in passes:
        whole.add(done)
    for done in passes[:at]:
        first.add(done)
    first.save(tmp_path / "s.npz", KEY)
    second = Rounds.load(tmp_path / "s.npz", KEY)
    for done in passes[at:]:
        second.add(done)
    for name in ("image", "variance", "mean_lambda"):
        assert getattr(second, name).tobytes() == getattr(whole, name).tobytes()
    assert (second.count, second.error) == (whole.count, whole.error)
    assert [p.name for p in tmp_path.iterdir()] == ["s.npz"]


def test_states_that_cannot_be_resumed(tmp_path):
    path = tmp_path / "s.npz"
    with pytest.raises(ValueError, match=r"there is no .*leave --resume out"):
        Rounds.load(path, KEY)
    render(1, 2).save(path, KEY)
    with pytest.raises(ValueError, match=r"seed is 4, was 3.*leave --resume out"):
        Rounds.load(path, KEY | {"seed": 4})
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(ValueError, match=r"is no state of a render or is damaged .*leave --resume out"):
        Rounds.load(path, KEY)
