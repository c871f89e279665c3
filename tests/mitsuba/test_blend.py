"""The blend: λ where the weights help, none where they hurt, and no bias in between."""

from __future__ import annotations

import numpy as np
import pytest

from voroquad.mitsuba import blend

HEIGHT, WIDTH = 48, 64


def images(rng, *, domain, other, spread=0.3, rounds=1):
    """A and D of pixels (rounds, height, width, 1): noise of the domain, which weights remove, and of the rest.

    The weighted estimate has the noise of the rest only, 1 + `spread` times in variance.
    """
    shape = (rounds, HEIGHT, WIDTH, 1)
    y, x = np.indices((HEIGHT, WIDTH))
    truth = (np.sin(x / 9) + np.cos(y / 7))[..., None]
    of_domain = domain * (rng.exponential(size=shape) - 1)  # skewed, as of a lens that half misses a highlight
    rest = other * rng.standard_normal(shape)
    plain = truth + of_domain + rest
    difference = -of_domain + other * np.sqrt(spread) * rng.standard_normal(shape)
    return truth, plain, difference


def of_round(plain, difference):
    share = blend.Share(*plain.shape[:2])
    share.observe(plain, difference)
    return share


def blended(plain, difference):
    half = blend.checkerboard(HEIGHT, WIDTH)
    share = of_round(plain, difference).halves()
    return np.where(half == 0, *share), plain + np.where(half == 0, *share)[..., None] * difference


@pytest.mark.parametrize(
    ("domain", "other", "low", "high"), [(0.3, 0.0, 0.9, 1), (0.0, 0.3, 0, 0.1), (0.2, 0.2, 0.65, 0.9)]
)
def test_lambda_is_that_of_least_variance(domain, other, low, high):
    """λ = σ_x² / (σ_x² + .3 σ_r²): 1 without other noise, 0 without the domain's, .77 where they are equal."""
    _, plain, difference = images(np.random.default_rng(1), domain=domain, other=other)
    share, _ = blended(plain[0], difference[0])
    assert low <= share.mean() <= high


def test_an_image_in_parts_gets_lambda_in_parts():
    rng = np.random.default_rng(2)
    _, lens, d_lens = images(rng, domain=0.3, other=0.02)
    _, rest, d_rest = images(rng, domain=0.02, other=0.3)
    left = (np.arange(WIDTH) < WIDTH // 2)[:, None]
    share, _ = blended(np.where(left, lens, rest)[0], np.where(left, d_lens, d_rest)[0])
    assert share[:, : WIDTH // 2].mean() > 0.8
    assert share[:, WIDTH // 2 :].mean() < 0.3


@pytest.mark.parametrize(("domain", "other"), [(0.3, 0.02), (0.02, 0.3), (0.1, 0.1), (0.0, 0.3)])
def test_never_worse_than_without_weights(domain, other):
    """Mean over seeds: at most 1.01 × the error of the plain mean, and near that of the better of the two."""
    errors = np.zeros(3)
    for seed in range(20):
        truth, plain, difference = images(np.random.default_rng(seed), domain=domain, other=other)
        _, image = blended(plain[0], difference[0])
        errors += [np.mean((e - truth) ** 2) for e in (plain[0], plain[0] + difference[0], image)]
    assert errors[2] < 1.01 * errors[0]
    assert errors[2] < 1.02 * min(errors[:2]) + 0.01 * max(errors[:2])


@pytest.mark.statistical
def test_blend_of_one_round_is_unbiased(monkeypatch):
    """Small tiles, that trust themselves, so that λ follows its few pixels: a bias of λ D would show."""
    monkeypatch.setattr(blend, "TILE", 4)
    monkeypatch.setattr(blend, "SPREAD", (10.0, 10.0))

    def by_itself(plain, difference):
        return plain + of_round(plain, difference).map()[..., None] * difference

    errors = []
    for seed in range(800):
        truth, plain, difference = images(np.random.default_rng(seed), domain=0.3, other=0.3)
        both = blended(plain[0], difference[0])[1], by_itself(plain[0], difference[0])
        errors.append([np.mean(image - truth) for image in both])
    z, z_of_control = np.mean(errors, 0) / (np.std(errors, 0, ddof=1) / np.sqrt(len(errors)))
    assert abs(z) < 5
    # Negative control: λ by the pixels that it is for
    assert abs(z_of_control) > 20


def test_later_rounds_take_lambda_from_earlier_ones():
    """Centred on the pixel's mean so far, λ settles where it belongs, tile by tile."""
    _, plain, difference = images(np.random.default_rng(3), domain=0.2, other=0.2, rounds=12)
    share = of_round(plain[0], difference[0])
    for k in range(1, 12):
        share.observe(plain[k], difference[k], plain[:k].mean(0))
    assert np.abs(share.map() - 1 / 1.3).max() < 0.15


def test_neighbours_of_the_same_half_only():
    """A pixel's value does not enter what its own half's other pixels are compared with, were it of the other half."""
    image = np.zeros((13, 13, 1))
    image[6, 7] = 1
    touched = blend.from_neighbours(image)[..., 0] != 0
    assert touched.sum() == 8
    assert not touched[blend.checkerboard(9, 9) == 0].any()
    # Quadratic images are predicted exactly, and what varies along a diagonal only
    y, x = np.indices((13, 13))
    for smooth in (2 * x - 3 * y + x**2 + x * y - 2 * y**2 + 1.0, np.exp((x + y) / 3)):
        np.testing.assert_allclose(blend.from_neighbours(smooth[..., None])[..., 0], smooth[2:-2, 2:-2])


@pytest.mark.parametrize("seed", range(3))
def test_where_lambda_cannot_be_known_it_is_small(seed):
    """Pixels that differ much more than their noise: what neighbours say is worthless, and weights would hurt."""
    rng = np.random.default_rng(seed)
    plain = 100 * rng.standard_normal((HEIGHT, WIDTH, 1))
    share = of_round(plain, 0.5 * rng.standard_normal((HEIGHT, WIDTH, 1)))
    assert share.halves().mean() < 0.15


def test_small_and_empty_images():
    nothing = np.zeros((20, 20, 3))
    np.testing.assert_array_equal(of_round(nothing + 1, nothing).halves(), np.zeros((2, 20, 20)))
    for shape in ((1, 1), (2, 50)):
        ones = np.ones((*shape, 3))
        np.testing.assert_array_equal(of_round(ones, ones).halves(), np.zeros((2, *shape)))
