"""Generator matrices: SciPy's Sobol' points, and the nets that they promise, counted box by box."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.stats import qmc

from voroquad.mitsuba.generators import BITS, DIMENSIONS, joe_kuo, nibble_tables, sz


def numbers(columns, indices):
    """Coordinates (len(columns), len(indices)) of points, as numbers below 2^32."""
    found = np.zeros((len(columns), len(indices)), np.uint64)
    for k in range(BITS):
        found ^= columns[:, k, None].astype(np.uint64) * ((indices >> k) & 1).astype(np.uint64)
    return found


def is_net(points, base_bits):
    """Has every elementary box in base 2^base_bits of the volume of a point one point?"""
    d, n = points.shape
    bits = int(n - 1).bit_length()
    for split in itertools.product(range(0, bits + 1, base_bits), repeat=d):
        if sum(split) == bits:
            box = np.zeros(n, np.uint64)
            for row, digits in zip(points, split, strict=True):
                box = box << np.uint64(digits) | row >> np.uint64(BITS - digits)
            if len(set(box.tolist())) < n:
                return False
    return True


def test_joe_and_kuo_are_scipys():
    indices = np.arange(64, dtype=np.uint64)
    gray = indices ^ indices >> np.uint64(1)  # SciPy goes through the indices in this order
    expected = qmc.Sobol(DIMENSIONS, scramble=False, bits=BITS).random(64).T
    np.testing.assert_array_equal(numbers(joe_kuo(DIMENSIONS), gray) / 2.0**BITS, expected)


@pytest.mark.parametrize("start", [0, 4096])
def test_quads_are_nets(start):
    """Any aligned block: in base 4 all four coordinates, in base 2 each pair."""
    columns = sz(24)
    for quad in range(0, 24, 4):
        for bits in (2, 4, 6):
            indices = np.arange(start, start + (1 << bits), dtype=np.uint64)
            assert is_net(numbers(columns[quad : quad + 4], indices), 2)
        for bits in range(1, 9):
            indices = np.arange(start, start + (1 << bits), dtype=np.uint64)
            points = numbers(columns[quad : quad + 4], indices)
            assert is_net(points[:2], 1)
            assert is_net(points[2:], 1)


def test_other_coordinates_are_not_such_nets():
    """The control: four coordinates of Sobol' in base 4, and pairs across the quads in base 2."""
    indices = np.arange(64, dtype=np.uint64)
    assert not is_net(numbers(joe_kuo(4), indices), 2)
    assert not is_net(numbers(sz(8)[[1, 2]], indices), 1)


def test_quads_differ():
    columns = sz(DIMENSIONS)
    assert len({quad.tobytes() for quad in columns.reshape(-1, 4, BITS)}) == DIMENSIONS // 4


@pytest.mark.parametrize(("kind", "columns"), [("joe-kuo", joe_kuo), ("sz", sz)])
def test_tables_give_the_same_coordinates(kind, columns):
    tables = nibble_tables(kind).reshape(DIMENSIONS, 8, 16)
    indices = np.array([0, 1, 0x12345678, 0xFFFFFFFF, 0x80000000], np.uint64)
    found = np.zeros((DIMENSIONS, len(indices)), np.uint64)
    for place in range(8):
        found ^= tables[:, place, (indices >> np.uint64(4 * place) & np.uint64(15)).astype(int)]
    for row, expected in zip(found, numbers(columns(DIMENSIONS), indices), strict=True):
        assert [int(f"{x:032b}"[::-1], 2) for x in row] == expected.tolist()
