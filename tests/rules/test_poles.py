"""Powers of the distance from a point: the rings about it, the variance in its stratum, and intervals that hold."""

import math

import numpy as np
import pytest

import voroquad as vq
from voroquad.rules import error_bars, poles
from voroquad.rules.poles import of_poles


def distances(strata, pole, sets=1, seed=1):
    """Of samples from a point: (sets, n)."""
    points = vq.sample("multi-jittered", math.prod(strata), len(strata), sets=sets, rng=seed).points
    return np.sqrt(np.square(points - np.array(pole)).sum(axis=-1))


@pytest.mark.parametrize(
    ("strata", "pole", "stratum"),
    [((14, 16), (0, 0), 0), ((12, 12), (1, 0), 132), ((12, 12), (0.46, 0.63), 67), ((7, 7, 7), (0, 1, 1), 48)],
    ids=["corner", "other corner", "inside", "in space"],
)
def test_the_variance_is_that_within_the_stratum(strata, pole, stratum):
    """As it is over sets, whether the sample comes close to the pole or not."""
    power = -0.3 * len(strata)
    inside = 3 * distances(strata, pole, sets=4000)[:, stratum] ** power
    values = 5 - 3 * distances(strata, pole, sets=41, seed=2) ** power
    found = [of_poles(strata, f[None], f[None])[0] for f in values]
    assert 0.3 < np.median(found) / inside.var() < 3
    assert np.count_nonzero(found) > 20


@pytest.mark.parametrize(
    "f",
    [
        lambda x: np.exp(x.sum(axis=1)),
        lambda x: np.exp(-np.square(x - 0.45).sum(axis=1) / 0.02),
        lambda x: np.hypot(*(x - 0.45).T),
        lambda x: x[:, 0] ** -0.4,
        lambda x: np.cos(20 * x[:, 0] + 9 * x[:, 1]),
        lambda x: 1.0 * (x.sum(axis=1) < 0.8),
        lambda x: np.ones(len(x)),
    ],
    ids=["smooth", "peak", "cone", "face", "wave", "step", "constant"],
)
def test_what_is_no_pole_has_none(f):
    x = vq.sample("multi-jittered", 256, 2, sets=30, rng=3).points
    assert np.count_nonzero([of_poles((16, 16), f(s)[None], f(s)[None])[0] for s in x]) <= 3


def test_the_rings_are_about_the_corner_if_the_extreme_value_is_beside_it():
    rings = poles._rings((8, 9), 1 * 9 + 7)
    assert (rings.centre, rings.in_corner) == (8, True)
    assert rings.enclosed.tolist() == [1, 4, 9, 16, 25, 36, 49]
    assert sorted(rings.strata[: rings.starts[1]]) == [7, 16, 17]
    inside = poles._rings((8, 9), 3 * 9 + 3)
    assert (inside.centre, inside.in_corner) == (30, False)
    assert inside.enclosed.tolist() == [1, 9, 25, 49, 64, 72]
    assert not poles._rings((8, 9), 9 * 4).in_corner


def test_few_rings_tell_nothing():
    x = distances((4, 4), (0, 0))
    assert of_poles((4, 4), 1 / x, 1 / x)[0] == 0


def test_corrections_bound_the_variance():
    """Models that resolve a pole, or correct little about it, have little of its variance."""
    (f,) = 1 / distances((12, 12), (0.46, 0.63), seed=14)
    rings = poles._rings((12, 12), int(f.argmax()))
    near = [rings.centre, *rings.strata[: rings.starts[1]]]
    corrections = np.zeros((1, 144))
    corrections[0, near] = f[near] - f[rings.centre]
    corrections *= np.sqrt(6 * poles.UNRESOLVED)
    bound = poles.MOST_TIMES * np.square(corrections).sum()
    assert of_poles((12, 12), f[None], f[None])[0] > 2 * bound
    assert of_poles((12, 12), f[None], corrections)[0] == pytest.approx(bound)
    assert of_poles((12, 12), f[None], corrections / 3)[0] == 0


def test_each_integrand_has_its_own_pole():
    r = np.concatenate([distances((12, 12), pole) for pole in ((0, 0), (0.46, 0.63))])
    together = of_poles((12, 12), 1 / r, 1 / r)
    assert together.tolist() == [of_poles((12, 12), 1 / s[None], 1 / s[None])[0] for s in r]
    assert (together > 0).all()


@pytest.mark.parametrize(
    ("f", "integral", "least"),
    [
        (lambda x: 1 / (1 - x[0] * x[1]), math.pi**2 / 6, 0.8),
        (lambda x: 1 / (x[0] + x[1]), 2 * math.log(2), 0.85),
        (lambda x: 1 / np.hypot(x[0], x[1]), 2 * math.log(1 + math.sqrt(2)), 0.9),
    ],
    ids=["1/(1 − xy)", "1/(x + y)", "1/r"],
)
def test_intervals_hold_integrals_of_poles(f, integral, least, monkeypatch):
    def held():
        results = [vq.quad(f, [0, 0], [1, 1], n_points=250, rng=s) for s in range(80)]
        return np.mean([low <= integral <= high for low, high in (r.confidence_interval() for r in results)])

    assert held() >= least
    monkeypatch.setattr(error_bars, "of_poles", lambda strata, values, residuals: np.zeros(len(values)))
    assert held() < least
