import numpy as np
import pytest

from voroquad.integrals.end_powers import has_end_powers


def points(d, n=256, seed=1):
    return np.random.default_rng(seed).random((d, n))


@pytest.mark.parametrize("d", [1, 2, 4, 6])
@pytest.mark.parametrize("end", [0, 1])
def test_a_power_at_either_end_of_an_axis_is_seen(d, end):
    u = points(d)
    distance = u[-1] if end == 0 else 1 - u[-1]
    smooth = np.exp(u[0] * u[-1])
    assert has_end_powers(u, np.stack([distance**-0.4 * smooth, -(distance**-0.4), smooth])).tolist() == [
        True,
        True,
        False,
    ]


@pytest.mark.parametrize("d", [2, 4, 6])
def test_smooth_functions_kinks_and_edges_have_none(d):
    u = points(d)
    total = u.sum(axis=0)
    values = [np.exp(-10 * total), 1 / (1 + total), np.cos(9 * total), np.abs(total - d / 2), 1.0 + (total > d / 2)]
    assert not has_end_powers(u, np.stack(values)).any()


def test_powers_that_vanish_or_grow_slowly_have_none():
    u = points(3)
    assert not has_end_powers(u, np.stack([u[0] ** 0.4, u[0] ** -0.1])).any()


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf])
def test_a_few_values_without_a_logarithm_are_left_out(value):
    u = points(2)
    f = u[0] ** -0.4
    f[:20] = value
    assert has_end_powers(u, f[None]).all()
    f[:40] = value
    assert not has_end_powers(u, f[None]).any()


def test_few_points_and_zeros_tell_nothing():
    u = points(4, 32)
    assert not has_end_powers(u, np.stack([u[0] ** -0.4, np.zeros(32)])).any()
