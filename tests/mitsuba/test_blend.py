"""The blend: λ where the weights help, none where they hurt, and no bias in between."""

from __future__ import annotations

import numpy as np
import pytest

from voroquad.mitsuba import blend

HEIGHT, WIDTH = 48, 64


def images(rng, *, domain, other, spread=0.3, rounds=1, height=HEIGHT, width=WIDTH):
    """The truth, and A, D and E of pixels (rounds, height, width, 1): noise of the domain, and of the rest.

    The weighted estimate has the noise of the rest only, 1 + `spread` times in variance, which E estimates.
    """
    shape = (rounds, height, width, 1)
    y, x = np.indices((height, width))
    truth = (np.sin(x / 9) + np.cos(y / 7))[..., None]
    of_domain = domain * (rng.exponential(size=shape) - 1)  # skewed, as of a lens that half misses a highlight
    rest = other * rng.standard_normal(shape)
    plain = truth + of_domain + rest
    added = other * np.sqrt(spread) * rng.standard_normal((2, *shape))
    return truth, plain, -of_domain + added[0], added[1]


def of_round(plain, difference, noise):
    share = blend.Share(*plain.shape[:2])
    share.observe_noise(plain, difference, noise)
    return share


def blended(plain, difference, noise):
    half = blend.checkerboard(*plain.shape[:2])
    share = of_round(plain, difference, noise).halves()
    return np.where(half == 0, *share), plain + np.where(half == 0, *share)[..., None] * difference


def test_each_pixel_has_the_value_of_its_own_half():
    halves = np.stack([np.zeros((5, 7)), np.ones((5, 7))])
    np.testing.assert_array_equal(blend.of_own_half(halves), blend.checkerboard(5, 7))


@pytest.mark.parametrize(
    ("domain", "other", "low", "high"), [(0.3, 0.0, 0.9, 1), (0.0, 0.3, 0, 0.1), (0.2, 0.2, 0.65, 0.9)]
)
def test_lambda_is_that_of_least_variance(domain, other, low, high):
    """λ = σ_x² / (σ_x² + .3 σ_r²): 1 without other noise, 0 without the domain's, .77 where they are equal."""
    _, *of_pass = images(np.random.default_rng(1), domain=domain, other=other)
    share, _ = blended(*(each[0] for each in of_pass))
    assert low <= share.mean() <= high


def test_an_image_in_parts_gets_lambda_in_parts():
    rng = np.random.default_rng(2)
    _, *lens = images(rng, domain=0.3, other=0.02)
    _, *rest = images(rng, domain=0.02, other=0.3)
    left = (np.arange(WIDTH) < WIDTH // 2)[:, None]
    share, _ = blended(*(np.where(left, a, b)[0] for a, b in zip(lens, rest, strict=True)))
    assert share[:, : WIDTH // 2].mean() > 0.8
    assert share[:, WIDTH // 2 :].mean() < 0.3


@pytest.mark.parametrize(("domain", "other"), [(0.3, 0.02), (0.02, 0.3), (0.1, 0.1), (0.0, 0.3)])
def test_never_worse_than_without_weights(domain, other):
    """Mean over seeds: at most 1.01 × the error of the plain mean, and near that of the better of the two."""
    errors = np.zeros(3)
    for seed in range(20):
        truth, plain, difference, noise = images(np.random.default_rng(seed), domain=domain, other=other)
        _, image = blended(plain[0], difference[0], noise[0])
        errors += [np.mean((e - truth) ** 2) for e in (plain[0], plain[0] + difference[0], image)]
    assert errors[2] < 1.01 * errors[0]
    assert errors[2] < 1.02 * min(errors[:2]) + 0.01 * max(errors[:2])


@pytest.mark.statistical
def test_blend_of_one_round_is_unbiased(monkeypatch):
    """Small tiles, that trust themselves, so that λ follows its few pixels: a bias of λ D would show."""
    monkeypatch.setattr(blend, "TILE", 4)
    monkeypatch.setattr(blend, "SPREAD", (10.0, 10.0))

    def by_itself(plain, difference, noise):
        return plain + of_round(plain, difference, noise).map()[..., None] * difference

    errors = []
    for seed in range(800):
        truth, *of_pass = images(np.random.default_rng(seed), domain=0.3, other=0.3)
        first = [each[0] for each in of_pass]
        both = blended(*first)[1], by_itself(*first)
        errors.append([np.mean(image - truth) for image in both])
    z, z_of_control = np.mean(errors, 0) / (np.std(errors, 0, ddof=1) / np.sqrt(len(errors)))
    assert abs(z) < 5
    # Negative control: λ by the pixels that it is for
    assert abs(z_of_control) > 20


def test_later_rounds_take_lambda_from_earlier_ones():
    """Centred on the pixel's mean so far, λ settles where it belongs, tile by tile."""
    _, plain, difference, noise = images(np.random.default_rng(3), domain=0.2, other=0.2, rounds=12)
    share = of_round(plain[0], difference[0], noise[0])
    for k in range(1, 12):
        share.observe_deviation(plain[k], difference[k], plain[:k].mean(0))
    assert np.abs(share.map() - 1 / 1.3).max() < 0.15


def test_rounds_of_one_pixel():
    """Rounds stand for pixels where there is one: λ is learned, high where weights help and low where they do not."""
    means = []
    for domain, other in ((0.3, 0.03), (0.03, 0.3)):
        _, plain, difference, noise = images(
            np.random.default_rng(3), domain=domain, other=other, rounds=32, height=1, width=1
        )
        share = of_round(plain[0], difference[0], noise[0])
        assert share.map()[0, 0] == 0  # one pixel of one round tells nothing
        for k in range(1, 32):
            share.observe_deviation(plain[k], difference[k], plain[:k].mean(0))
        means.append(share.map()[0, 0])
    assert means[0] > 0.8
    assert means[1] < 0.4


@pytest.mark.parametrize("size", [(16, 16), (64, 2), (4, 4)])
def test_small_images_have_a_share_too(size):
    shares = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        _, *of_pass = images(rng, domain=0.3, other=0.05, height=size[0], width=size[1])
        shares.append(blended(*(each[0] for each in of_pass))[0].mean())
    assert np.mean(shares) > (0.85 if size == (16, 16) else 0.6)


def test_each_half_takes_the_share_of_the_other():
    """Pixels of half 0 say that weights help, those of half 1 that they do not."""
    half = blend.checkerboard(HEIGHT, WIDTH)[..., None]
    difference = np.random.default_rng(1).standard_normal((HEIGHT, WIDTH, 1))
    share = of_round(np.zeros_like(difference), difference, np.where(half == 0, 0, difference)).halves()
    assert share[0].max() < 0.05
    assert share[1].min() > 0.95


def test_one_bright_pixel_is_no_evidence():
    """A tile whose D comes from one pixel has no degree of freedom to judge its λ by."""
    difference = np.full((16, 16, 1), 1e-2)
    difference[5, 5] = 10
    noise = np.where(difference > 1, 0, difference)  # the bright pixel says that weights help, the others do not
    assert of_round(np.zeros_like(difference), difference, noise).map().max() < 0.5


def test_noise_of_estimates_is_no_difference_between_tiles():
    """All tiles have the λ ½; each estimates it with a standard deviation of about ½, so they learn from each other."""
    rng = np.random.default_rng(7)
    shape = (12 * blend.TILE, 12 * blend.TILE, 1)
    # Sixteen pixels of a tile have a D
    seen = rng.random((12, 12, blend.TILE**2)).argsort(-1) < 16
    seen = seen.reshape(12, 12, blend.TILE, blend.TILE).swapaxes(1, 2).reshape(shape)
    difference = np.where(seen, rng.choice([-1.0, 1.0], shape), 0)
    centre = 0.5 * difference + 2 * rng.standard_normal(shape)  # c − A, with A = 0
    share = blend.Share(*shape[:2])
    share.observe_deviation(np.zeros(shape), difference, centre)
    of_tiles = share.map()[:: blend.TILE, :: blend.TILE]
    assert abs(of_tiles.mean() - 0.5) < 0.1
    assert of_tiles.std() < 0.17


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["plain", "difference", "noise", "centre"])
def test_a_pixel_that_is_not_finite_is_left_out(bad, where):
    _, *of_pass = images(np.random.default_rng(1), domain=0.3, other=0.1)
    plain, difference, noise = (each[0] for each in of_pass)
    arrays = {"plain": plain, "difference": difference, "noise": noise, "centre": plain + 0.1 * difference}
    good = both_observed(**arrays)
    arrays[where][20, 30] = bad
    share = both_observed(**arrays)
    assert np.isfinite(share.moments).all()
    np.testing.assert_allclose(share.map(), good.map(), atol=0.05)
    assert share.map().mean() > 0.5


def both_observed(plain, difference, noise, centre):
    share = of_round(plain, difference, noise)
    share.observe_deviation(plain, difference, centre)
    return share


def test_huge_values_do_not_overflow():
    """Squares of float32 of 10³⁰ are above its range."""
    _, *of_pass = images(np.random.default_rng(1), domain=0.3, other=0.05)
    first = [(each[0] * 1e30).astype(np.float32) for each in of_pass]
    assert of_round(*first).map().min() > 0.8


@pytest.mark.parametrize("seed", range(3))
def test_where_the_weights_only_add_noise_lambda_is_small(seed):
    rng = np.random.default_rng(seed)
    plain = 100 * rng.standard_normal((HEIGHT, WIDTH, 1))
    noise, difference = 0.5 * rng.standard_normal((2, HEIGHT, WIDTH, 1))
    assert of_round(plain, difference, noise).halves().mean() < 0.15


def test_small_and_empty_images():
    nothing = np.zeros((20, 20, 3))
    np.testing.assert_array_equal(of_round(nothing + 1, nothing, nothing).halves(), np.zeros((2, 20, 20)))
    ones = np.ones((1, 1, 3))
    np.testing.assert_array_equal(of_round(ones, ones, 0 * ones).halves(), np.zeros((2, 1, 1)))
