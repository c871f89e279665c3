"""Sharing samples out: the budget, whole powers of two, and no pixel that decides for itself."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from voroquad.mitsuba.allocation import KINDS, RATE, Sharing, of_a_sample
from voroquad.mitsuba.blend import checkerboard


def counts(mean, variance, budget, least=16, most=256, kind="absolute", target=0.0):
    return Sharing(kind, least, most, target).counts(mean, variance, budget)


def pilot(rng, shape=(12, 16)):
    """Skewed noise of very different strength."""
    scale = np.exp(2 * rng.standard_normal((*shape, 1)))
    return scale * rng.random((*shape, 3)), scale * rng.standard_exponential((*shape, 3))


@settings(max_examples=30, deadline=None)
@given(
    st.integers(0, 2**32 - 1), st.integers(1, 9), st.integers(1, 9), st.floats(4, 80), st.sampled_from([4, 16, 64]),
    st.sampled_from(KINDS), st.sampled_from([0.0, 0.1]),
)  # fmt: skip
def test_powers_of_two_within_the_budget(seed, height, width, budget, most, kind, target):
    mean, variance = pilot(np.random.default_rng(seed), (height, width))
    n = counts(mean, variance, budget=budget, least=4, most=most, kind=kind, target=target)
    assert n.shape == (height, width)
    assert set(np.log2(n / 4).ravel()) <= set(range(int(np.log2(most / 4)) + 1))
    assert n.mean() <= budget


def test_the_budget_is_spent():
    mean, variance = pilot(np.random.default_rng(1))
    n = counts(mean, variance, budget=64, least=16, most=256)
    assert 63 < n.mean() <= 64


@pytest.mark.parametrize("kind", KINDS)
def test_no_half_decides_for_itself(kind):
    """Whatever a half's samples are, also not finite, its own numbers stay; those of the other change."""
    rng = np.random.default_rng(2)
    (mean, variance), (other_mean, other_variance) = pilot(rng), pilot(rng)
    other_variance[3, 4] = np.nan
    half = checkerboard(12, 16, 0)
    before = counts(mean, variance, budget=64, kind=kind)
    for own in (0, 1):
        changed = [np.where(half[..., None] == own, b, a) for a, b in ((mean, other_mean), (variance, other_variance))]
        after = counts(*changed, budget=64, kind=kind)
        np.testing.assert_array_equal(after[half == own], before[half == own])
        assert (after != before).any()


def test_samples_go_with_the_power_of_the_noise_that_minimises_the_error():
    """Numbers of samples in the ratio 1 : 4 : 16 minimise Σ V / n^r for V in the ratio of their powers r + 1."""
    variance = np.broadcast_to(np.repeat([1.0, 4.0, 16.0], 20)[None, :, None] ** (RATE + 1), (6, 60, 1))
    n = counts(np.ones((6, 60, 1)), variance, budget=112, least=16, most=1024)[3]
    assert [n[10], n[30], n[50]] == [16, 64, 256]


def test_relative_errors_ask_for_brightness():
    """A part with three times the noise and eight times the light has less relative error."""
    variance = np.ones((8, 40, 1))
    variance[:, 20:] = 9
    mean = np.where(np.arange(40) < 20, 1.0, 8.0)[None, :, None] * np.ones((8, 1, 1))
    absolute, relative = (counts(mean, variance, budget=32, kind=kind)[4] for kind in ("absolute", "relative"))
    assert absolute[35] > absolute[5]
    assert relative[35] < relative[5]


def test_balanced_errors_count_by_the_power_of_the_brightness():
    """Noise that grows with that power is the same everywhere; with another it is not."""
    brightness = np.where(np.arange(40) < 20, 1.0, 4.0)[None, :, None] * np.ones((8, 1, 1))
    even, uneven = (counts(brightness, brightness**power, budget=48, kind="balanced")[4] for power in (0.75, 1.75))
    assert abs(even[:20].mean() - even[20:].mean()) < 16
    assert uneven[25:].mean() > uneven[:15].mean() + 16


def test_the_variance_of_a_sample_is_that_of_samples_and_of_blocks():
    """Of independent samples both are; of blocks that have the same mean, half of it is left."""
    samples = np.random.default_rng(3).standard_exponential((40000, 4, 4))
    squares = (samples**2).mean((1, 2))[:, None]
    mean, variance = of_a_sample(samples.mean(-1, keepdims=True), squares, 16)
    np.testing.assert_allclose(mean[:, 0], samples.mean((1, 2)))
    assert variance.mean() == pytest.approx(1, abs=0.04)
    even = np.broadcast_to(samples.mean((1, 2))[:, None, None], (40000, 4, 1))
    assert of_a_sample(even, squares, 16)[1].mean() == pytest.approx(0.5, abs=0.02)


def test_a_target_ends_it():
    variance = np.ones((8, 40, 1))
    variance[:, 20:] = 0.01
    n = counts(np.ones((8, 40, 1)), variance, budget=256, target=0.1)[4]
    assert n[5] == 128  # the first power of two of which 1/√n is below .1
    assert n[35] == 16


@pytest.mark.parametrize(("kind", "expected"), [("absolute", 128), ("balanced", 128), ("relative", 16)])
def test_a_target_is_in_the_unit_of_the_image_or_relative(kind, expected):
    """Standard errors of 1/√n, where the brightness is 8: an eighth of that is below .1 for any number."""
    shape = (8, 8, 1)
    assert (counts(np.full(shape, 8.0), np.ones(shape), budget=256, kind=kind, target=0.1) == expected).all()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("most", [0, 64])
def test_light_may_be_negative(kind, most):
    mean, variance = pilot(np.random.default_rng(6))
    n = counts(-mean, variance, budget=32, most=most, kind=kind)
    np.testing.assert_array_equal(n, counts(mean, variance, budget=32, most=most, kind=kind))
    assert n.max() > 16
    apart = [Sharing(kind, 16, most).counts_apart(sign * mean, variance, 32) for sign in (1, -1)]
    np.testing.assert_array_equal(*apart)
    even = counts(np.full((4, 4, 3), -1.0), np.ones((4, 4, 3)), budget=32, most=64, kind=kind)
    assert even.mean() == 32


@pytest.mark.parametrize(("budget", "expected"), [(17, 16), (64, 64), (100, 64), (600, 256)])
def test_pixels_of_whose_noise_nothing_is_known_have_the_budget(budget, expected):
    """An image of a pixel has no other half, and where no sample is finite nothing is known either."""
    assert counts(np.ones((1, 1, 3)), np.ones((1, 1, 3)), budget).tolist() == [[expected]]
    unknown = np.full((3, 4, 3), np.nan)
    assert (counts(unknown, unknown, budget) == expected).all()
    assert (Sharing("absolute", 16, 256).counts_apart(unknown, unknown, budget) == expected).all()


def test_pixels_with_none_near_have_the_mean_noise_of_the_others():
    """Not none: those on the left need more samples than those between, of which nothing is known, the right fewer."""
    variance = np.full((12, 40, 1), 0.1)
    variance[:, :4], variance[:, 4:18] = 100.0, np.inf
    light = np.ones(variance.shape)
    for n in (counts(light, variance, budget=64), Sharing("absolute", 16, 256).counts_apart(light, variance, 64)):
        assert n[:, 1].min() > n[:, 10].max()
        assert n[:, 10].min() > n[:, 30].max()


def test_samples_that_are_not_finite_have_no_finite_variance():
    blocks, squares = np.ones((3, 4, 1)), np.full((3, 1), 2.0)
    blocks[1, 2], squares[1] = np.inf, np.inf
    mean, variance = of_a_sample(blocks, squares, 16)
    np.testing.assert_array_equal(np.isfinite(variance[:, 0]), [True, False, True])
    np.testing.assert_array_equal(np.isfinite(mean[:, 0]), [True, False, True])


@pytest.mark.statistical
@pytest.mark.parametrize("own", [False, True])
def test_the_mean_is_unbiased_unless_pixels_decide_for_themselves(own):
    """Rare bright samples: where there was none, the pixel seems to be without noise. The control is biased."""
    rng = np.random.default_rng(5)
    excess = []
    for _ in range(300):
        samples = (rng.random((16, 16, 64)) < 0.1).astype(float)
        variance = samples[..., :4].var(-1, ddof=1)
        if own:
            n = np.where(variance > np.quantile(variance, 0.6), 64, 4)
        else:
            n = counts(samples[..., :4].mean(-1)[..., None], variance[..., None], budget=24, least=4, most=64)
        kept = np.arange(64) < n[..., None]
        excess.append(((samples * kept).sum(-1) / n).mean() - 0.1)
    z = np.mean(excess) / (np.std(excess, ddof=1) / np.sqrt(len(excess)))
    assert (abs(z) > 8) == own
    assert own or abs(z) < 4.5
