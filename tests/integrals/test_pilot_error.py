"""The error bar of the pilot rule: exact where nets fall by a power, and how often its intervals hold."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable

import numpy as np
import pytest
from pilot_reference import differences_of_halves
from scipy.special import stdtrit
from scipy.stats import qmc

import voroquad as vq
from voroquad.integrals.pilot_error import MOST_DIFFERENCES, SHARE_OF_SLOPE, variance


def sums(residuals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of residuals (cells, 2^level), as of one field."""
    level = int(math.log2(residuals.shape[1]))
    powers = np.zeros((2, 1, 15, 15))
    for cell in residuals:
        for scale, difference in differences_of_halves(cell):
            powers[:, 0, level, scale] += difference**2, difference**4
    return powers[0], powers[1]


def of_power(a: float, level: int, count: float = 1e3) -> tuple[np.ndarray, np.ndarray]:
    """Sums of `count` equal differences for a variance that falls by 2^−a from scale to scale to 1."""
    squares = np.zeros((1, 15, 15))
    scales = np.arange(1, level + 1)
    squares[0, level, scales] = 4.0**level * (2 ** (1 + a) - 1) * 2.0 ** (a * (level - scales))
    return squares, np.square(squares) / count


@pytest.mark.parametrize("level", [1, 2, 5, 14])
def test_a_power_law_is_continued(level):
    assert variance(*of_power(0.0, level))[0] == pytest.approx(1)
    for a in (0.5, 1.0, 2.0):
        found = float(variance(*of_power(a, level))[0][0])
        known = SHARE_OF_SLOPE * a if level > 1 else 0.0  # one scale tells no power
        middle = (level - 1) / 2
        expected = (2 ** (1 + a) - 1) / (2 ** (1 + known) - 1) * 2 ** ((a - known) * middle)
        assert found == pytest.approx(expected)
        assert found >= 1


def test_degrees_of_freedom_are_those_of_the_differences():
    assert variance(*of_power(0.0, 1, count=20))[1] == pytest.approx(20)
    assert variance(*of_power(0.0, 1, count=1000))[1] == pytest.approx(MOST_DIFFERENCES)
    assert variance(*of_power(0.0, 1, count=1))[1] == 3
    # Two scales, of which the line is read at the second: 1 / (1/40 + ¼ / 10)
    assert variance(*of_power(0.0, 2, count=20))[1] == pytest.approx(20)
    nothing = np.zeros((2, 15, 15))
    found, freedom = variance(nothing, nothing)
    assert not found.any()
    assert np.isinf(freedom).all()


def test_what_is_not_finite_has_no_variance():
    squares, fourths = of_power(0.0, 3)
    squares[0, 3, 1] = np.nan
    assert np.isnan(variance(squares, fourths)[0])


@pytest.mark.parametrize("fourth", [0.0, np.inf])
def test_fourth_powers_out_of_range_drop_no_sum(fourth):
    squares, fourths = of_power(0.0, 3)
    assert variance(squares, np.full_like(fourths, fourth))[0] == pytest.approx(1)
    assert variance(*of_power(0.0, 3, count=1))[0] == pytest.approx(1)


def test_levels_add_up():
    one, other = of_power(0.0, 3, count=10), of_power(0.0, 1, count=30)
    together, freedom = variance(one[0] + other[0], one[1] + other[1])
    assert together == pytest.approx(2)
    (alone,), (beside,) = variance(*one)[1], variance(*other)[1]
    assert freedom == pytest.approx(4 / (1 / alone + 1 / beside))


@pytest.mark.statistical
def test_independent_samples_have_their_variance():
    """Residuals of no net: the sum over the cells of their means has the variance cells / m."""
    rng = np.random.default_rng(1)
    found = [variance(*sums(rng.standard_normal((40, 8))))[0][0] for _ in range(400)]
    assert np.mean(found) == pytest.approx(40 / 8, rel=0.2)


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("function", "widest"),
    [(lambda x: np.exp(x), 4.0), (lambda x: np.abs(x - 0.33), 4.0), (lambda x: 1.0 * (x < 0.33), 3.0)],
)
def test_nets_in_one_dimension(function: Callable[[np.ndarray], np.ndarray], widest: float):
    """200 cells of 16 samples: at least the variance of nets, and at most `widest` times their standard deviation."""
    rng = np.random.default_rng(2)
    nets = np.stack([qmc.Sobol(1, rng=r).random(16)[:, 0] for r in rng.spawn(3000)])
    true = function(nets).mean(axis=1).var() * 200
    found = variance(*sums(function(nets[:200])))[0][0]
    assert true < found < widest**2 * true


def edge(x: np.ndarray) -> np.ndarray:
    return 1.0 * (np.square(x).sum(axis=0) < 0.6)


def bump(x: np.ndarray) -> np.ndarray:
    return np.exp(-30 * np.square(x - 0.4).sum(axis=0))


def intervals(function: Callable[[np.ndarray], np.ndarray], d: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Errors of 150 estimates, and half of their 95 % intervals."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", vq.IntegrationWarning)
        found = [
            vq.quad(function, np.zeros(d), np.ones(d), n_points=n, method="pilot", threads=1, rng=s) for s in range(150)
        ]
    exact = {edge: [math.sqrt(0.6), math.pi * 0.15, math.pi / 6 * 0.6**1.5], bump: [one_bump**p for p in (1, 2, 3)]}
    errors = np.array([r.integral for r in found]) - exact[function][d - 1]
    return errors, np.array([stdtrit(r.degrees_of_freedom, 0.975) * r.standard_error for r in found])


@pytest.mark.statistical
@pytest.mark.parametrize(("d", "n"), [(1, 8192), (2, 4096), (3, 4096)])
@pytest.mark.parametrize("function", [edge, bump])
def test_intervals_hold(function, d, n):
    """Of 150 intervals with a coverage of 95 % or more fewer than 128 hold once in 10^6."""
    errors, half = intervals(function, d, n)
    assert np.count_nonzero(np.abs(errors) < half) >= 128


@pytest.mark.statistical
@pytest.mark.parametrize("d", [2, 3])
def test_intervals_at_an_edge_are_not_wide(d):
    """There cells are independent. 1.96 would be exact; factors 1.3 are for the slope and the mean square error."""
    errors, half = intervals(edge, d, 4096)
    assert np.median(half) < 1.96 * 1.3 * 1.3 * math.sqrt(np.mean(errors**2))


one_bump = math.sqrt(math.pi / 30) / 2 * (math.erf(math.sqrt(30) * 0.6) + math.erf(math.sqrt(30) * 0.4))
