"""Kriging by tiles: each predicts its own strata from its samples, and from those of no group that is left out."""

import math

import numpy as np
import pytest

import voroquad as vq
from voroquad.designs.multi_jittered import period
from voroquad.rules.kriging import Kriging, model, smooth_models
from voroquad.rules.kriging_rules import krige_strata, strata_in_colours
from voroquad.rules.tiled_kriging import MARGIN, SIDE, TiledKriging, tile_model, tiles


def tiled_kriging(x, strata):
    """The model for all kinds of integrands, by tiles."""
    return TiledKriging("kriging", model(*x.shape), x, tiles(strata, period(len(strata))), 1)


@pytest.mark.parametrize(("n", "d"), [(56, 2), (60, 3), (108, 4)])
def test_a_single_tile_is_kriging(n, d):
    samples = vq.sample("multi-jittered", n, d, sets=1, rng=1)
    f = np.stack([np.exp(samples.points.sum(axis=-1)), 1.0 * (samples.points[..., 0] < 0.4)], axis=1)
    weights, residuals = krige_strata(samples.points, samples.strata, period(d), f, 1)
    tiled = tiled_kriging(samples.points[0], samples.strata)
    groups = np.arange(period(d) ** d)
    np.testing.assert_allclose(tiled.weights(0, groups).sum(axis=0) / n, weights[0], atol=1e-12)
    np.testing.assert_allclose(tiled.residuals(0, groups, f[0]), residuals[0], atol=1e-10)


@pytest.mark.parametrize("strata", [(32, 16), (33, 49), (40, 47), (8, 8, 16), (4, 4, 8, 8)])
def test_tiles_predict_each_stratum_once_from_those_around(strata):
    predicted = np.zeros(np.prod(strata))
    group, _ = strata_in_colours(strata, period(len(strata)))
    by_colour = np.zeros(group.max() + 1)
    for tile in tiles(strata, period(len(strata))):
        own = tile.own.astype(bool)
        predicted[tile.strata[own]] += 1
        inside, around = (np.array(np.unravel_index(some, strata)) for some in (tile.strata[own], tile.strata))
        for a, k in enumerate(strata):
            assert around[a].min() == max(0, inside[a].min() - MARGIN)
            assert around[a].max() == min(k - 1, inside[a].max() + MARGIN)
            assert np.ptp(inside[a]) + 1 >= min(k, SIDE.get(len(strata), k))
        shares = [axis.share.sum(axis=1) for axis in tile.axes]
        by_colour += np.ravel(np.multiply.outer(shares[0], shares[1])) if len(shares) == 2 else 0
        members = tile.groups.members[tile.groups.real.astype(bool)]
        np.testing.assert_array_equal(np.sort(members), np.arange(len(tile.strata)))
    assert (predicted == 1).all()
    if len(strata) == 2:
        np.testing.assert_array_equal(by_colour, np.bincount(group))


@pytest.mark.parametrize(
    ("assumed", "rounding"),
    list(zip([model(512, 2), *smooth_models(512).values()], [1e-8, 1e-3, 1e-2], strict=True)),
    ids=["rough", "smooth", "analytic"],
)
def test_what_a_tile_predicts_is_kriging_from_its_other_samples(assumed, rounding):
    """The less noise, the more of what is missed is rounding."""
    samples = vq.sample("multi-jittered", 512, 2, sets=1, rng=2)
    x, strata = samples.points[0], samples.strata
    f = np.stack([np.exp(x[:, 0]) * np.sin(9 * x[:, 1]), 1.0 * (x.sum(axis=1) < 0.8)])
    group, _ = strata_in_colours(strata, 3)
    pairs = np.array([[0, 4], [2, 7]])
    tiled = TiledKriging("any name", assumed, x, tiles(strata, 3), 1)
    squares, residuals = tiled.squares(pairs, f), tiled.residuals(0, np.array([4]), f)
    assert (residuals[:, group != 4] == 0).all()
    (weights,) = tiled.weights(0, np.array([4]))
    estimate, expected = np.zeros(2), np.zeros((2, 2))
    for tile in tiles(strata, 3):
        colours, own = group[tile.strata], tile.own.astype(bool)

        def without(out, tile=tile, colours=colours):
            """Prediction from the tile's samples of other colours, and the values of these."""
            kept = tile.strata[~np.isin(colours, out)]
            return Kriging(x[kept], tile_model(assumed, len(tile.strata), 2)), f[:, kept]

        kriging, known = without([4])
        own_4 = tile.strata[own & (colours == 4)]
        missed = f[:, own_4] - kriging.integrate(kriging.at_points(x[own_4]), known)
        scale = abs(missed).max(axis=1)
        np.testing.assert_allclose(residuals[:, own_4] / scale[:, None], missed / scale[:, None], atol=rounding)
        estimate += missed.sum(axis=1) + kriging.integrate(kriging.over_boxes(tile.axes), known)[:, 4]
        kriging, known = without([2, 7])
        for one, c in enumerate((2, 7)):
            judged = tile.strata[own & (colours == c)]
            missed = f[:, judged] - kriging.integrate(kriging.at_points(x[judged]), known)
            expected[:, one] += np.square(missed).sum(axis=1)
    np.testing.assert_allclose(f @ weights, estimate, rtol=rounding)
    np.testing.assert_allclose(squares[0, :, 1], expected, rtol=10 * rounding)


def test_tiles_lose_nothing_to_kriging_from_all_samples():
    """On a narrow bell, a wave and an edge, the squared error over 16 sets."""
    samples = vq.sample("multi-jittered", 512, 2, sets=16, rng=3)
    x = samples.points
    bell = np.exp(-((10 * (x - [0.4, 0.6])) ** 2).sum(axis=-1))
    wave = np.cos(15 * x[..., 0] + 9 * x[..., 1])
    f = np.stack([bell, wave, 1.0 * (x[..., 0] + 2 * x[..., 1] < 1.3)], axis=1)
    of_wave = (np.exp(15j) - 1) / 15j * (np.exp(9j) - 1) / 9j
    of_bell = math.pi / 400 * math.prod(math.erf(10 * (1 - c)) + math.erf(10 * c) for c in (0.4, 0.6))
    truth = np.array([of_bell, of_wave.real, 0.4])
    whole, _ = krige_strata(x, samples.strata, 3, f, 1)
    errors = []
    for one, values in zip(x, f, strict=True):
        tiled = tiled_kriging(one, samples.strata)
        errors.append(values @ tiled.weights(0, np.arange(9)).sum(axis=0) / 512 - truth)
    before = np.square((whole[:, None] * f).sum(axis=-1) - truth).mean(axis=0)
    assert (np.square(errors).mean(axis=0) < 1.5 * before).all()
