"""Nested permutations keep aligned blocks together, and are uniform."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from voroquad.mitsuba.scrambles import (
    crossed_scramble,
    finalise,
    morton,
    nested_scramble,
    nested_shuffle_of_fours,
)

pytestmark = pytest.mark.usefixtures("one_thread")


def of_key(key):
    return dr.opaque(mi.UInt32, key)


@pytest.mark.parametrize("key", [0, 1, 0xDEADBEEF])
def test_a_shuffle_keeps_blocks_together(key):
    """So `OwenSobol` takes the samples in another order: it scrambles indices with their bits in reverse order."""
    shuffled = np.array(dr.brev(nested_scramble(dr.brev(dr.arange(mi.UInt32, 1024)), of_key(key))))
    for bits in range(11):
        blocks = (shuffled >> bits).reshape(-1, 1 << bits)
        assert (blocks == blocks[:, :1]).all()
        assert len(set(blocks[:, 0])) == len(blocks)


@pytest.mark.parametrize(("upper", "bits"), [(0, 0), (1, 1), (2, 4), (3, 5), (5, 10)])
def test_a_crossed_scramble_is_nested_and_its_lower_digits_follow_each_other_alone(upper, bits):
    """Points of a block share their first digits before and after; points with the same lower digits share those."""
    numbers_ = dr.arange(mi.UInt32, 1024) << 22
    reversed_ = crossed_scramble(dr.brev(numbers_), of_key(0xDEADBEEF), mi.UInt32(upper), bits)
    scrambled = np.array(dr.brev(reversed_)) >> 22
    for digits in range(11):
        blocks = (scrambled >> 10 - digits).reshape(-1, 1 << 10 - digits)
        assert (blocks == blocks[:, :1]).all()
        assert len(set(blocks[:, 0])) == len(blocks)
    lower = (np.arange(1024) >> 10 - bits) & (1 << bits - upper) - 1
    after = (scrambled >> 10 - bits) & (1 << bits - upper) - 1
    assert len(set(zip(lower.tolist(), after.tolist(), strict=True))) == 1 << bits - upper


@pytest.mark.parametrize("key", [0, 1, 0xDEADBEEF])
def test_a_shuffle_of_fours_keeps_squares_together(key):
    shuffled = np.array(nested_shuffle_of_fours(dr.arange(mi.UInt32, 1024), 5, of_key(key)))
    for digits in range(6):
        blocks = (shuffled >> 2 * digits).reshape(-1, 4**digits)
        assert (blocks == blocks[:, :1]).all()
        assert len(set(blocks[:, 0])) == len(blocks)


def test_a_shuffle_of_fours_has_all_orders_equally_often():
    """Of siblings, over keys and over parents: 24 orders, a χ² of 23 degrees of freedom each."""
    keys, parents = dr.meshgrid(dr.arange(mi.UInt32, 240), dr.arange(mi.UInt32, 16))
    orders = [np.array(nested_shuffle_of_fours(parents * 4 + child, 5, finalise(keys))) & 3 for child in range(4)]
    code = np.array(orders).T @ [64, 16, 4, 1]
    _, counts = np.unique(code, return_counts=True)
    expected = len(code) / 24
    assert len(counts) == 24
    assert ((counts - expected) ** 2 / expected).sum() < 65  # a χ² of 23 exceeds it once in 10⁵


@pytest.mark.statistical
def test_a_scramble_flips_every_digit_half_of_the_time():
    """And the flips of a digit do not depend on those of the next, or on the digit above."""
    keys = np.random.default_rng(1).integers(2**32, size=2**14, dtype=np.uint64).astype(np.uint32)
    for value in (0, 1, 0x12345678):
        digits = np.array(nested_scramble(mi.UInt32(value), mi.UInt32(keys)))
        flips = ((digits ^ value)[:, None] >> np.arange(24)) & 1  # bit 0 is the first digit
        z = (flips.mean(0) - 0.5) * 2 * np.sqrt(len(keys))
        assert np.abs(z).max() < 5.5
        pairs = (flips[:, 1:] == flips[:, :-1]).mean(0)
        assert np.abs((pairs - 0.5) * 2 * np.sqrt(len(keys))).max() < 5.5


def chi_square(*parts):
    """χ² of joint values of integers against equal frequencies, over its standard deviation, and the cells (parts,)."""
    code, cells = 0, 1
    for values, number in parts:
        code, cells = code * number + values, cells * number
    counts = np.bincount(code, minlength=cells)
    expected = counts.sum() / cells
    return (((counts - expected) ** 2 / expected).sum() - cells + 1) / np.sqrt(2 * cells)


def hashed_keys(number):
    return finalise(dr.arange(mi.UInt32, number) + 12345)


@pytest.mark.statistical
@pytest.mark.parametrize(("x", "y", "first"), [(0, 1, 0), (5, 6, 0), (0b10110, 0b11110, 3), (0x51234, 0x41234, 16)])
def test_two_points_are_scrambled_as_by_owens_nested_scrambling(x, y, first):
    """Digits of the one are uniform, and so are those of the other after the first in which they differ: together."""
    keys = hashed_keys(2**17)
    a, b = (np.array(nested_scramble(mi.UInt32(v), keys)) for v in (x, y))
    after = (a ^ b) >> first + 1 & 31
    assert abs(chi_square((a & 31, 32), (after, 32))) < 6
    assert abs(chi_square((a >> first & 31, 32), (after, 32))) < 6
    fixed = np.array(mi.UInt32(x) ^ keys) ^ np.array(mi.UInt32(y) ^ keys)  # a shift alone: the control
    assert abs(chi_square((a & 31, 32), (fixed >> first + 1 & 31, 32))) > 6


@pytest.mark.statistical
def kurtosis(values):
    away = values - values.mean()
    return np.mean(away**4) / np.mean(away**2) ** 2


@pytest.mark.parametrize("n", [16, 64, 256, 1024])
def test_means_over_nets_have_no_tails(n):
    """Those of x over n points, and of x y with the points in another order; a factor alone is the control."""
    keys = hashed_keys(6000)
    i = dr.tile(dr.arange(mi.UInt32, n), 6000)
    of_x, of_y, of_order = (dr.repeat(finalise(keys ^ salt), n) for salt in (0, 0x51ED270B, 0x1B873593))

    def unit(reversed_bits):
        return np.array(dr.brev(reversed_bits), dtype=np.float64).reshape(-1, n) / 2**32

    x = unit(nested_scramble(i, of_x))
    y = unit(nested_scramble(dr.brev(nested_scramble(dr.brev(i), of_order)), of_y))
    assert 2 < kurtosis(x.mean(axis=1)) < 4.5
    assert 2 < kurtosis((x * y).mean(axis=1)) < 4.5
    control = unit((i + of_x) * (finalise(of_x) << 1 | 1))
    assert kurtosis(control.mean(axis=1)) > 6
    np.testing.assert_allclose(x.mean(axis=1).var() * 12 * n**3, 1, rtol=0.12)  # of Owen's scrambling


def test_upper_and_lower_digits_are_scrambled_independently_if_crossed():
    """Of two points whose first difference is the same in both; the control has one factor for both."""
    keys = hashed_keys(2**17)
    a, b = (np.array(crossed_scramble(mi.UInt32(v), keys, mi.UInt32(4), 8)) for v in (0b00100110, 0b00110111))
    upper, lower = (a ^ b) >> 1 & 7, (a ^ b) >> 5 & 7
    assert abs(chi_square((upper, 8), (lower, 8), (a & 15, 16))) < 6
    together = np.array(nested_scramble(mi.UInt32(0b0110), keys)) ^ np.array(nested_scramble(mi.UInt32(0b0111), keys))
    assert abs(chi_square((upper, 8), (together >> 1 & 7, 8))) > 6


def test_a_scramble_depends_on_the_digits_above_only():
    keys = mi.UInt32(np.arange(1, 200, dtype=np.uint32) * np.uint32(0x9E3779B9))
    for bit in range(31):
        a, b = (np.array(nested_scramble(mi.UInt32(v), keys)) for v in (5, 5 ^ 1 << bit))
        assert ((a ^ b) & ((1 << bit) - 1) == 0).all()
        assert ((a ^ b) >> bit & 1 == 1).all()
        # The digit below it depends on it: not for all keys the same flip
        assert 0 < ((a ^ b) >> (bit + 1) & 1).mean() < 1


def test_morton_codes_take_bits_in_turns():
    x, y = np.array([0, 1, 0, 5, 65535]), np.array([0, 0, 1, 3, 65535])
    code = np.array(morton(mi.UInt32(x.astype(np.uint32)), mi.UInt32(y.astype(np.uint32))))
    assert code.tolist() == [0, 1, 2, 0b011011, 2**32 - 1]
