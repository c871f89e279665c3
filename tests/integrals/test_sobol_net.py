"""Scrambled Sobol' nets of the core."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from voroquad import _core


def keys(d: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 2**64, size=(d, 65), dtype=np.uint64)


def test_without_scrambling_they_are_those_of_joe_and_kuo():
    """SciPy's are in the order of Gray's code, and begin at 0."""
    x = _core.SobolNet(np.zeros((20, 65), dtype=np.uint64), 12).points(0, 4096)
    i = np.arange(4096)
    expected = qmc.Sobol(20, scramble=False, bits=52).random(4096).T
    np.testing.assert_array_equal(x[:, i ^ (i >> 1)] - 2.0**-53, expected)


@pytest.mark.parametrize("n", [1, 16, 64, 128, 1024])
def test_blocks_are_parts_of_the_net(n):
    net = _core.SobolNet(keys(5), 12)
    blocks = [net.points(begin, n) for begin in range(0, 4096, n)]
    np.testing.assert_array_equal(np.concatenate(blocks, axis=1), net.points(0, 4096))


@pytest.mark.parametrize("d", [1, 2, 20])
def test_scrambled_points_are_nets(d):
    """In each coordinate one point in each 2^-m, of every block of 2^m that begins at a multiple of it."""
    net = _core.SobolNet(keys(d), 10)
    for n in (2, 64, 1024):
        for begin in (0, 1024 - n):
            cells = np.floor(np.sort(net.points(begin, n), axis=1) * n)
            np.testing.assert_array_equal(cells, np.tile(np.arange(n), (d, 1)))


def test_pairs_of_the_first_coordinates_are_balanced():
    x = _core.SobolNet(keys(2), 8).points(0, 256)
    for a in range(9):
        cells = np.floor(x[0] * 2**a) * 2 ** (8 - a) + np.floor(x[1] * 2 ** (8 - a))
        assert len(set(cells)) == 256


@pytest.mark.statistical
def test_points_are_uniform_and_independent_between_keys():
    x = np.stack([_core.SobolNet(keys(3, seed), 4).points(0, 16) for seed in range(4000)])
    # Means of uniform numbers: each beyond 5.5 standard errors once in 10^7
    error = 5.5 / np.sqrt(12 * len(x))
    assert np.abs(x.mean(axis=0) - 0.5).max() < error
    centred = np.sqrt(12) * (x - 0.5)
    assert np.abs((centred[1:] * centred[:-1]).mean(axis=0)).max() < 5.5 / np.sqrt(len(x))
    assert np.abs((centred[:, 0] * centred[:, 1]).mean(axis=0)).max() < 5.5 / np.sqrt(len(x))


def test_points_are_inside_the_box():
    net = np.zeros((1, 65), dtype=np.uint64)
    assert _core.SobolNet(net, 1).points(0, 2).tolist() == [[2.0**-53, 0.5 + 2.0**-53]]
    net[:, 64] = 2**64 - 1
    assert _core.SobolNet(net, 1).points(0, 2).tolist() == [[1 - 2.0**-53, 0.5 - 2.0**-53]]
