"""Hashes, nested permutations and Morton codes of whole arrays of numbers, for the sampler ``owensobol``.

The keys of permutations must be hashes: small numbers next to each other give permutations that are alike.
"""

from __future__ import annotations

from itertools import permutations

import drjit as dr
import mitsuba as mi
import numpy as np

from .generators import BITS

_GOLDEN = 0x9E3779B9


def finalise(x: mi.UInt32) -> mi.UInt32:
    """A hash of 32 bits: C. Wellons' "lowbias32" (2018), xor-shifts and products."""
    x = (x ^ (x >> 16)) * 0x7FEB352D
    x = (x ^ (x >> 15)) * 0x846CA68B
    return x ^ (x >> 16)


def combine(a: mi.UInt32, b: mi.UInt32) -> mi.UInt32:
    """A hash of two numbers; their order counts."""
    return of_key(a, finalise(b ^ 0x85EBCA6B))


def of_key(number: mi.UInt32, key: mi.UInt32) -> mi.UInt32:
    """A hash of a number by a key that is a hash itself."""
    return finalise(number * _GOLDEN + key)


def nested_scramble(reversed_bits: mi.UInt32, key: mi.UInt32) -> mi.UInt32:
    """A nested scrambling of numbers whose bits are in reverse order: bits that are lower stand for higher digits.

    A fixed mixing takes x to y, and y becomes f (y + s), with a random s and a random odd f. The mixing keeps the first
    digit in which two points differ: if it is digit k, their y differ by 2^k times an odd number. Times f that is 2^k
    times any odd number, each as likely. The digits of one of the points are uniform too, because of s. So any two
    points are scrambled as by Owen's nested uniform scrambling, and the variance of the mean over a net is the same.
    A. B. Owen, "Variance with alternative scramblings of digital nets", ACM Transactions on Modeling and Computer
    Simulation 13 (2003).

    Without the mixing all points of a net would have nearly the same offset in their strata where f is close to ±1. The
    variance would be as it is, but rare means would be far off and all others too good.
    """
    return (_mixed(reversed_bits) + key) * (_bits_of_factors(key) << 1 | 1)


def crossed_scramble(reversed_bits: mi.UInt32, key: mi.UInt32, upper: mi.UInt32, bits: int) -> mi.UInt32:
    """A nested scrambling of numbers whose bits are in reverse order, in which upper digits leave lower ones alone.

    The digits after the first `upper` ones and up to `bits` depend on each other only: those of two points that are
    the same stay the same. All other digits depend on all that are higher, as in `nested_scramble`.
    """
    kept = ((mi.UInt32(1) << upper) - 1) | mi.UInt32((1 << BITS) - (1 << bits))
    of_factors = _bits_of_factors(key)
    scrambled = (_mixed(reversed_bits) + key) * (of_factors << 1 | 1)
    lower = (_mixed(reversed_bits & ~kept) + key) * (of_factors >> 7 | 1)
    return (scrambled & kept) | (lower & ~kept)


def _mixed(reversed_bits: mi.UInt32) -> mi.UInt32:
    """A fixed permutation in which each bit depends on itself and lower ones, as in S. Laine and T. Karras (2011).

    It also mixes numbers whose lower bits are all 0, such as reversed indices.
    """
    return reversed_bits ^ (reversed_bits * 0x8D22F6E6)


def _bits_of_factors(key: mi.UInt32) -> mi.UInt32:
    """Random bits, of which the lowest 16 are independent of those of the key, and so the first 16 digits of points."""
    return (key ^ (key >> 16)) * 0x2C1B3C6D


def nested_shuffle_of_fours(code: mi.UInt32, digits: int, key: mi.UInt32) -> mi.UInt32:
    """A random permutation of numbers of so many digits in base 4 that maps aligned blocks of 4^m to such blocks.

    Each digit goes through one of the 24 permutations, picked by a hash of the digits above it.
    """
    table = mi.UInt32(np.array(list(permutations(range(4))), np.uint32).ravel())
    shuffled = mi.UInt32(0)
    above = mi.UInt32(0)
    for place in range(digits - 1, -1, -1):
        hashed = finalise(above ^ (key + (place + 1) * _GOLDEN % 2**32))
        digit = (code >> 2 * place) & 3
        shuffled |= dr.gather(mi.UInt32, table, dr.mul_hi(hashed, mi.UInt32(24)) * 4 + digit) << 2 * place
        above = above << 2 | digit
    return shuffled


def morton(x: mi.UInt32, y: mi.UInt32) -> mi.UInt32:
    """The bits of x and y in turns, x's lowest first; of each the lowest 16."""
    return _spread(x) | _spread(y) << 1


def _spread(x: mi.UInt32) -> mi.UInt32:
    """The lowest 16 bits, with a zero after each."""
    x = x & 0xFFFF
    for shift, mask in ((8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555)):
        x = (x | x << shift) & mask
    return x
