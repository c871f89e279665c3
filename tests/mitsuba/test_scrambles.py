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
