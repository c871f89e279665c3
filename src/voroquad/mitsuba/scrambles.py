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
    return finalise(a * _GOLDEN + finalise(b ^ 0x85EBCA6B))


def nested_scramble(reversed_bits: mi.UInt32, key: mi.UInt32) -> mi.UInt32:
    """Owen's nested uniform scrambling, as a hash, of numbers whose bits are in reverse order.

    Each bit is flipped by a hash of the bits below it, which stand for higher digits. S. Laine and T. Karras,
    "Stratified sampling for stochastic transparency" (2011), with the constants of N. Vegdahl (2021).
    """
    x = reversed_bits
    x = x ^ x * 0x3D20ADEA
    x = (x + key) * ((key >> 16) | 1)
    x = x ^ x * 0x05526C56
    return x ^ x * 0x53A22864


def crossed_scramble(reversed_bits: mi.UInt32, key: mi.UInt32, upper: mi.UInt32, bits: int) -> mi.UInt32:
    """A nested scrambling of numbers whose bits are in reverse order, in which upper digits leave lower ones alone.

    The digits after the first `upper` ones and up to `bits` depend on each other only: those of two points that are
    the same stay the same. All other digits depend on all that are higher, as in `nested_scramble`.
    """
    of_upper = (mi.UInt32(1) << upper) - 1
    kept = of_upper | mi.UInt32((1 << BITS) - (1 << bits))
    scrambled, lower = (nested_scramble(x, key) for x in (reversed_bits, reversed_bits & ~of_upper))
    return (scrambled & kept) | (lower & ~kept)


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
