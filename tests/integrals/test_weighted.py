"""Values times volume elements, and their size, as the core computes them: every stride, and what is not finite."""

import itertools

import numpy as np
import pytest

from voroquad import _core

RNG = np.random.default_rng(1)
BOTH = RNG.standard_normal((3, 50)) + 1j * RNG.standard_normal((3, 50))
VALUES = (RNG.standard_normal((3, 50)), RNG.standard_normal((50, 3)).T, BOTH.real, BOTH.imag, BOTH.real[:, ::-1])
VOLUMES = (RNG.random(50), RNG.random(100)[::2], np.broadcast_to(0.7, 50), RNG.random(50)[::-1])


@pytest.mark.parametrize(("values", "volumes"), list(itertools.product(VALUES, VOLUMES)))
def test_values_of_any_strides_are_weighted(values, volumes):
    found, finite = _core.weighted(values, volumes)
    np.testing.assert_array_equal(found, volumes * values)
    assert finite
    assert found.flags.c_contiguous


@pytest.mark.parametrize("values", VALUES)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e308])
@pytest.mark.parametrize("at", [(0, 0), (1, 17), (2, 49)])
def test_products_that_are_not_finite_are_told(values, bad, at):
    values = np.copy(values, order="K")
    values[at] = bad
    for volumes in (np.full(50, 10.0), np.broadcast_to(10.0, 50), np.full(100, 10.0)[::2]):
        found, finite = _core.weighted(values, volumes)
        assert not finite
        assert (~np.isfinite(found)).sum() == 1


def test_no_values_are_finite():
    assert _core.weighted(np.empty((2, 0)), np.empty(0))[1]
    assert _core.sizes(np.empty(0)) == (0.0, True)


def test_each_value_has_a_volume():
    with pytest.raises(ValueError, match="volumes: there must be one for each value"):
        _core.weighted(np.ones((2, 3)), np.ones(2))


@pytest.mark.parametrize("n", [1, 7, 8, 9, 100])
def test_the_largest_size_is_found_wherever_it_is(n):
    for at in range(n):
        values = RNG.uniform(-1, 1, n)
        values[at] = (-1) ** at * 3.5
        assert _core.sizes(values) == (3.5, True)
        values[at] = np.nan
        others = np.abs(np.delete(values, at)).max(initial=0)
        assert _core.sizes(values) == (others, False)
        values[at] = -np.inf
        assert _core.sizes(values) == (np.inf, False)


@pytest.mark.parametrize("u", [RNG.random((2, 40)), RNG.random((40, 2)).T, RNG.random((2, 40))[:, ::-1]])
def test_points_of_any_strides_are_moved_into_the_box(u):
    u = np.copy(u, order="K")
    u[:, 0], u[:, 1] = 0, 1
    low, width, most = np.array([-1.0, 2.0]), np.array([3.0, 0.5]), np.array([2.0, 2.5])
    ends = np.nextafter(low, most), np.nextafter(most, low)
    found = _core.into_box(u, low, width, *ends)
    expected = np.clip(u, 2.0**-54, 1 - 2.0**-53) * width[:, None] + low[:, None]
    np.testing.assert_array_equal(found, np.clip(expected, ends[0][:, None], ends[1][:, None]))
