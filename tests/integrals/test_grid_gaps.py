"""Values of a grid in place of those that are missing."""

import math
import warnings

import numpy as np
import pytest

import voroquad as vq
from voroquad.integrals.evaluation import Function
from voroquad.integrals.grid_gaps import REACH, fill_gaps
from voroquad.integrals.integrand import Integrand
from voroquad.integrals.library import Library
from voroquad.integrals.pilot import PilotRun, grid_side
from voroquad.integrals.regions import Box


def axes(k, d):
    return np.meshgrid(*[(np.arange(k) + 0.5) / k] * d, indexing="ij")


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("gaps", ["a point", "a plane", "planes that cross"])
def test_polynomials_are_filled_in_exactly(d, gaps):
    """Of degree 2 REACH − 1 along each axis."""
    x = axes(11, d)
    grid = sum((i + 1) * (xi - 0.3) ** (2 * REACH - 1) for i, xi in enumerate(x)) + np.prod(x, axis=0)
    filled = grid.copy()
    if gaps == "a point":
        filled[(5,) * d] = np.nan
    for axis in range({"a point": 0, "a plane": 1, "planes that cross": d}[gaps]):
        np.moveaxis(filled, axis, 0)[5] = np.inf
    fill_gaps(filled)
    np.testing.assert_allclose(filled, grid, rtol=0, atol=1e-12)


def test_the_axis_with_most_points_decides():
    """Beside a second gap the line along the other axis is taken, and not the mean of both."""
    x, y = axes(11, 2)
    grid = x**6 + y**6
    filled = grid.copy()
    filled[[5, 7], 5] = np.nan
    fill_gaps(filled)
    np.testing.assert_allclose(filled, grid, rtol=0, atol=1e-12)


def test_each_reach_is_used_where_it_fits():
    """At the distance r from the border polynomials of degree 2r − 1 are exact, and those of degree 2r are not."""
    x = np.arange(20.0)
    for r in range(1, REACH + 1):
        for degree in (2 * r - 1, 2 * r):
            grid = ((x - 3) / 20) ** degree
            filled = grid.copy()
            filled[r] = np.nan
            fill_gaps(filled)
            assert (abs(filled[r] - grid[r]) < 1e-14) == (degree < 2 * r)


def test_other_gaps_are_passed_over():
    grid = np.array([1.0, 2.0, np.nan, 4.0, np.nan, 6.0, 7.0, np.nan])
    fill_gaps(grid)
    np.testing.assert_allclose(grid, [1, 2, 3, 4, 5, 6, 7, 0])


def test_a_grid_without_values_is_0():
    grid = np.full((3, 3), np.nan)
    fill_gaps(grid)
    assert not grid.any()


def test_finite_values_stay():
    grid = np.array([1e308, -1e308, 1.0])
    kept = grid.copy()
    fill_gaps(grid)
    np.testing.assert_array_equal(grid, kept)


# ---------------------------------------------------------------------- integrals


#: The integrals of sin(xy)/(xy) over the unit square, and of (1 − cos x)/x² over the unit interval.
SINC = sum((-1) ** k / (math.factorial(2 * k + 1) * (2 * k + 1) ** 2) for k in range(10))
VERSINE = sum((-1) ** (k + 1) / (math.factorial(2 * k) * (2 * k - 1)) for k in range(1, 10))


@pytest.mark.parametrize(
    ("func", "a", "b", "n", "integral", "most"),
    [
        (lambda x: np.sin(x[0]) / x[0], [-1], [1], 2052, 2 * 0.946083070367183, 1e-9),
        (lambda x: np.abs(x[0]) ** -0.25, [-1], [1], 2052, 8 / 3, 1e-2),
        (lambda x: 1 / np.hypot(x[0], x[1]), [-1, -1], [1, 1], 8192, 8 * math.log(1 + math.sqrt(2)), 0.1),
        (lambda x: np.sin(x[0] * x[1]) / (x[0] * x[1]), [-1, -1], [1, 1], 8192, 4 * SINC, 1e-9),
        (lambda x: (1 - np.cos(x[2])) / x[2] ** 2, [-1] * 3, [1] * 3, 4 * 13**3, 8 * VERSINE, 1e-9),
    ],
)
def test_the_centre_of_the_box_may_have_no_value(func, a, b, n, integral, most):
    """A grid with an odd number of cells along an axis has a point there, which only predicts."""
    k = grid_side(n, len(a))
    assert k % 2 == 1
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("error")
        r = vq.quad(func, a, b, n_points=n, method="pilot", rng=3)
    assert abs(r.integral - integral) < 5 * r.standard_error < most


def test_values_that_are_not_finite_in_a_region_make_the_integral_nan():
    with pytest.warns(vq.IntegrationWarning, match="not finite"):
        r = vq.quad(lambda x: np.where(x[0] > 0.9, np.inf, x[0]), [0, 0], [1, 1], n_points=4096, rng=1)
    assert math.isnan(r.integral)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("threads", [1, 2])
def test_gaps_of_the_grid_are_filled_whatever_parts_it_comes_in(bad, threads, monkeypatch):
    """One value is missing, in one of nine parts; of the other component none."""

    def grid(at_once: int) -> np.ndarray:
        monkeypatch.setattr("voroquad.integrals.pilot.POINTS_AT_ONCE", at_once)
        library = Library.of(0, 1)
        func = Function(lambda x: np.stack([np.where(np.abs(x[0] - 0.55) < 0.004, bad, np.cos(x[0])), x[0]]), library)
        run = PilotRun(Integrand(func, Box(0, 1, library)), 90, np.random.default_rng(1), threads)
        run.evaluate_grid()
        return run.grid_values()

    x = (np.arange(90) + 0.5) / 90
    assert (np.abs(x - 0.55) < 0.004).sum() == 1
    np.testing.assert_allclose(grid(10), [np.cos(x), x], rtol=1e-9)
    np.testing.assert_array_equal(grid(10), grid(1000))
