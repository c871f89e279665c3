"""Boxes: what is refused, and coordinates that lose no digits on their way to the core."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import voroquad as vq
from voroquad.geometry.bounds import Bounds


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        ([(0, 1)], r"bounds has 1 pairs .* have d = 2; pass points.T"),
        ([(0, 1)] * 3, r"bounds has 3 pairs .* have d = 2"),
        ([(0, 1), (1, 1)], r"bounds\[1\] = \(1.0, 1.0\) must be two finite numbers low < high"),
        ([(0, np.nan), (0, 1)], r"bounds\[0\] = \(0.0, nan\)"),
        ([(0, np.inf), (0, 1)], r"bounds\[0\] = \(0.0, inf\)"),
        ([0, 1, 2], "bounds must be pairs"),
        ([(0, 1), (0, 1, 2)], "bounds must be pairs"),
        ("unit", "bounds must be pairs"),
        ([(-1e308, 1e308), (0, 1)], "volume is not a normal number"),
        ([(0, 1e200), (0, 1e200)], "volume is not a normal number"),
        ([(0, 1e-200), (0, 1e-200)], "volume is not a normal number"),
        ([(0, 1e-60), (0, 1e60)], "longest side"),
    ],
)
def test_bad_bounds_are_named(bounds, message):
    with pytest.raises(ValueError, match=message):
        vq.cells([[0.2, 0.3], [0.6, 0.7]], bounds=bounds)


@pytest.mark.parametrize("sides", [(0, 1), (0, 2 * np.pi), (-0.3, 0.1), (1e6, 1e6 + 0.7)])
def test_no_point_of_a_periodic_axis_is_its_upper_end(sides):
    """As the core requires; without being wrapped it would pass for inside."""
    bounds = Bounds(2, [sides, (0, 1)], [True, False])
    points = bounds.to_core(np.array([[sides[1], 1.0], [np.mean(sides), 0.5]]))
    _, high = bounds._core_sides.T
    assert (points[:, 0] < high[0]).all()
    assert points[0, 1] == high[1]


@pytest.mark.parametrize("periodic", [[True], [True] * 3, "no", 1, [1, 0], None])
def test_bad_periodic_axes_are_named(periodic):
    with pytest.raises(ValueError, match="periodic must be True, False or one of them for each of d = 2 axes"):
        vq.cells([[0.2, 0.3], [0.6, 0.7]], periodic=periodic)


def test_points_outside_are_named_with_the_box():
    with pytest.raises(
        ValueError, match=r"points\[1\] = \[3.0, 1.5\] is not inside \[0, 4\] × \[0, 1\]; give .*bounds"
    ):
        vq.cells([[1, 0.5], [3, 1.5]], bounds=[(0, 4), (0, 1)])
    with pytest.raises(
        ValueError, match=r"points\[1\] = \[0.3, 1.5\] is not inside \[0, 1\]\^2; give the box as bounds"
    ):
        vq.cells([[0.1, 0.5], [0.3, 1.5]])


def test_one_pair_is_for_all_axes():
    x = np.random.default_rng(1).random((9, 2)) * 3 - 1
    np.testing.assert_array_equal(
        vq.cells(x, bounds=(-1, 2)).measures, vq.cells(x, bounds=[(-1, 2), (-1, 2)], periodic=[False, False]).measures
    )


@given(st.floats(-1e9, 1e9), st.floats(1e-6, 1e9), st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_no_digit_is_lost_on_the_way_to_the_core(low, side, share):
    high = low + side
    if not low < high:
        return
    x = np.clip(low + np.array(share) * (high - low), low, high)[:, None]
    box = Bounds(1, [(low, high)])
    core = box.to_core(x)
    assert np.abs(core).max() <= 8
    back = box.from_core(core)
    tiny = np.abs(x) < 1e-300 * box.volume  # may count as 0, docs/cells.md
    np.testing.assert_array_equal(np.where(tiny, x, back), x)
    assert np.abs(back[tiny]).max(initial=0) < 1e-300 * box.volume


def test_the_unit_box_costs_no_copy():
    x = np.random.default_rng(2).random((9, 2))
    assert Bounds(2).to_core(x) is x


@pytest.mark.parametrize(
    ("sides", "d"),
    [*product([(0, 1), (0, 4), (-0.3, 0.1), (1e6, 1e6 + 0.7)], [1, 2, 3]), ((-3e-302, 4e-302), 1)],
)
def test_the_copy_for_the_core_has_the_points_that_were_checked(sides, d):
    """In any layout, and where some are on a seam; in one pass, which gives the same as one after the other."""
    box = Bounds(d, [sides] * d, [True] + [False] * (d - 1))
    low, high = box.sides[0]
    x = np.clip(low + np.random.default_rng(d).random((3, 40, d)) * (high - low), low, np.nextafter(high, low))
    record = np.zeros((3, 40), [("tag", "i1"), ("x", "f8", d)])  # not aligned
    record["x"] = x
    seam = x.copy()
    seam[1, 2, 0] = high
    for points in (x, x[0], x[:, ::-2], np.asfortranarray(x), record["x"], record["x"][1], seam, x.astype(np.float32)):
        try:
            inside = box.to_core(points)
        except ValueError:  # rounding to float32 has put one outside
            inside = None
        for threads in (1, 2):
            if inside is None:
                with pytest.raises(ValueError, match="is not inside"):
                    box.copied_to_core(points, threads)
                continue
            copy = box.copied_to_core(points, threads)
            np.testing.assert_array_equal(copy, inside)
            assert not np.may_share_memory(copy, points)


def test_what_scaling_rounds_to_an_end_is_still_outside():
    with pytest.raises(ValueError, match="is not inside"):
        vq.cells([[-5e-324, 0.5]], bounds=(0, 4))


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("value", [-0.1, 1.1, np.nan])
def test_one_point_outside_is_found_among_many(axis, value):
    points = np.full((5, 20_000, 2), 0.5)
    points[4, 15_000, axis] = value
    with pytest.raises(ValueError, match=r"points\[\(4, 15000\)\]"):
        vq.cells(points, threads=2)


@pytest.mark.parametrize("bounds", [(0, 1), (0, 4), (-1, 1)])
def test_no_zero_has_a_sign(bounds):
    cells = vq.cells([[-0.0, 0.5], [0.5, -0.0]], bounds=bounds)
    for values in (cells.points, cells.polygons().coordinates, vq.cells([-0.0, 0.5], bounds=bounds).intervals()):
        assert not np.signbit(values[values == 0]).any()


@pytest.mark.parametrize("length", [1, 30, 1000])
@pytest.mark.parametrize("d", [2, 3])
def test_sites_next_to_each_other_share_a_long_box(d, length):
    """Across a short period, at which a vertex far along the box sees the image of the other site only just nearer."""
    points = np.full((2, d), 0.57 * length)
    points[:, 0] = 0.0005 + np.array([0, 1.2e-13])
    sides = [0.00102, *[length] * (d - 1)]
    measures = vq.cells(points, bounds=[(0, side) for side in sides], periodic=[True, *[False] * (d - 1)]).measures
    np.testing.assert_allclose(measures, np.prod(sides) / 2, rtol=1e-13)
