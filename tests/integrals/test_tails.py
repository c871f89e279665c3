"""What the largest values of an integrand tell of its tail."""

import math
import warnings

import numpy as np
import pytest

import voroquad as vq
from voroquad.integrals.tails import FEWEST_VALUES, MOST_EVEN, heavy_tail, largest_sizes, tail_index
from voroquad.study.genz import instances


def kinds(func, d, n, seed, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        r = vq.quad(func, [0] * d, [1] * d, n_points=n, rng=seed, **options)
    return {w.kind for w in r.warnings}


#: Singular integrands, by name: dimension and function.
SINGULAR = {
    "1/x": (1, lambda x: 1 / x[0]),
    "x^-2": (1, lambda x: x[0] ** -2),
    "|x - 0.3|^-0.9": (1, lambda x: abs(x[0] - 0.3) ** -0.9),
    "1/(x - 0.3)": (1, lambda x: 1 / (x[0] - 0.3)),
    "1/r^2": (2, lambda x: 1 / np.square(x).sum(axis=0)),
    "1/x in space": (3, lambda x: 1 / x[0]),
    "1/r^2.9 in space": (3, lambda x: np.square(x).sum(axis=0) ** -1.45),
}


@pytest.mark.parametrize(
    ("name", "n"), [(name, n) for name in SINGULAR for n in (4096, 20_000) if (name, n) != ("1/x in space", 20_000)]
)
def test_singular_integrands_warn(name, n):
    """In nearly every set. A grid in space has few layers, so its values do not show the tail of 1/x."""
    d, func = SINGULAR[name]
    found = [kinds(func, d, n, seed) & {"heavy-tail", "few-samples"} for seed in range(4)]
    assert sum(map(bool, found)) >= 3


@pytest.mark.parametrize("method", ["plain", "local", "kriging", "polynomials", "pilot"])
def test_every_method_warns(method):
    found = [kinds(lambda x: 1 / np.square(x).sum(axis=0), 2, 4096, seed, method=method) for seed in range(3)]
    assert all(found_ & {"heavy-tail", "few-samples"} for found_ in found)
    assert any("heavy-tail" in found_ for found_ in found)


def test_replicates_warn():
    """Of an integral that is infinite in five dimensions."""
    found = [kinds(lambda x: np.square(x).sum(axis=0) ** -2.5, 5, 40_000, seed) for seed in range(4)]
    assert sum(bool(found_ & {"heavy-tail", "few-samples"}) for found_ in found) >= 3


def test_components_are_judged_apart():
    """A peak that few samples see does not hide another component's singularity."""

    def func(x):
        return np.stack([np.exp(-np.square((x[0] - 0.5) * 3e3)), 1 / x[0]])

    assert {"few-samples", "heavy-tail"} <= set.union(*(kinds(func, 1, 1500, seed) for seed in range(3)))


def test_ratios_may_overflow():
    with np.errstate(all="raise"):
        assert tail_index(np.concatenate([np.full(25, 1e-310), np.geomspace(1, 1e308, 8)])) > 100


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_regular_integrands_do_not(d):
    smooth = [f for f in instances(d, 8, rng=[5, d]) if f.name != "corner"]
    assert not [f.name for f in smooth if "heavy-tail" in kinds(f, d, 600, 2)]
    assert "heavy-tail" not in kinds(lambda x: np.prod(x**-0.4, axis=0), d, 4096, 3)


@pytest.mark.parametrize(("d", "n", "width"), [(2, 1024, 0.04), (2, 16_384, 0.01), (3, 16_384, 0.02)])
def test_a_resolved_peak_does_not(d, n, width):
    """The grid of the pilot rule sees little of the last two, but the samples do."""
    found = kinds(lambda x: np.exp(-np.square((x - 0.4321) / width).sum(axis=0) / 2), d, n, 1)
    assert not found


@pytest.mark.parametrize("index", [0.5, 0.8, 1.0, 2.0])
def test_the_index_of_powers(index):
    """Of the values of x^-k at the points of a grid all three estimates are close to k."""
    x = (np.arange(10_000) + 0.5) / 10_000
    assert tail_index(largest_sizes([x**-index])) == pytest.approx(index, abs=0.06)


def test_the_least_estimate_decides():
    steep = np.concatenate([np.ones(49), np.geomspace(2, 2e6, 16)])  # few values far above all others
    assert tail_index(steep) == pytest.approx(np.log(steep[1:]).mean())  # Hill's
    even = np.exp(np.linspace(0, 1, 65) ** 8)  # the upper quarter alone is heavy
    assert tail_index(even) < 0.3


@pytest.mark.parametrize("d", [1, 2, 3, 4, 5, 6])
def test_tails_of_peaks_get_lighter(d):
    """Of a Gaussian that few samples meet, log f is −r², and a share u of them has r² below u^(2/d)."""
    largest = np.exp(-9 * ((np.arange(65)[::-1] + 0.5) / 65) ** (2 / d))
    assert np.log(largest[1:] / largest[0]).mean() > 2
    assert tail_index(largest) == -math.inf


def test_degenerate_values_have_no_tail():
    assert tail_index(np.zeros(5)) == tail_index(np.ones(5)) == -math.inf
    assert heavy_tail({}) is heavy_tail({0: [np.ones(100)]}) is heavy_tail({0: [np.full(100, np.nan)]}) is None
    few = 1 / (np.arange(FEWEST_VALUES - 1) + 0.5)
    assert heavy_tail({0: [few]}) is None
    assert heavy_tail({0: [1 / (np.arange(FEWEST_VALUES) + 0.5)]}) is not None


def test_parts_of_values_are_one_sample():
    values = 1 / (np.random.default_rng(0).permutation(3000) + 0.5)
    whole, parts = heavy_tail({0: [values]}), heavy_tail({0: [values[:17], values[17:1700], values[1700:]]})
    assert whole is not None
    assert parts is not None
    assert whole.details == parts.details
    np.testing.assert_array_equal(largest_sizes([values]), np.sort(values)[-55:])


def test_the_component_is_told():
    tail = 1 / (np.arange(500) + 0.5)
    found = heavy_tail({0: [np.ones(500)], 3: [tail], 4: [np.sqrt(tail)]})
    assert found is not None
    assert found.details["components"] == [3]
    assert found.details["tail_index"] == pytest.approx(1, abs=0.1)


def test_heavy_tails_are_far_from_even():
    """The quick test lets every tail of the index 0.8 pass on to the estimates."""
    for n in (64, 1024, 100_000):
        values = ((np.arange(n) + 0.5) / n) ** -0.8
        assert values.sum() ** 2 / (n * (values**2).sum()) < MOST_EVEN
