"""Two samplers of pbrt-v4 for Mitsuba, written from the papers that describe them, to compare `owensobol` with.

`zsobol`: Ahmed and Wonka, "Screen-space blue-noise diffusion of Monte Carlo sampling error via hierarchical ordering of
pixels" (2020), as pbrt has it: each draw takes the first pair of Sobol' coordinates, Owen-scrambled, at an index whose
base-4 digits (of the pixel's Morton code and of the sample) are permuted anew for each dimension.

`owen-sobol`: one Sobol' sequence for the image (Grünschloß, Raab and Keller, "Enumerating quasi-Monte Carlo point
sequences in elementary intervals", 2012): its first two coordinates are the position on a square of 2^k pixels a side,
and each pixel has the points that fall into it. All other coordinates are Owen-scrambled, alike in all pixels.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from voroquad.mitsuba import generators
from voroquad.mitsuba.generators import BITS, SOBOL

NAMES = ("zsobol", "owen-sobol")
#: Bits of an index that one look-up in the tables takes
BYTE = 8


@cache
def byte_tables() -> generators.Columns:
    """Entry 1024 d + 256 j + v is coordinate d, bits in reverse order, where bits 8j to 8j + 7 of an index are v's."""
    columns = generators.joe_kuo(SOBOL)
    values = np.arange(1 << BYTE)
    tables = np.zeros((len(columns), BITS // BYTE, 1 << BYTE), np.uint32)
    for k in range(BITS):
        reversed_ = generators._reversed_bits(columns[:, k])[:, None]
        tables[:, k // BYTE] ^= np.where(values >> (BYTE - 1 - k % BYTE) & 1, reversed_, np.uint32(0))
    return tables.ravel()


def register() -> None:
    """Register both in the current variant."""
    from voroquad.mitsuba import owen_sobol
    from voroquad.mitsuba.scrambles import combine, morton, nested_shuffle_of_fours

    class Comparator(owen_sobol.OwenSobol):
        """Has the pixels of `owensobol`, and the coordinates of Sobol' sequences."""

        name = ""
        one_period = False  # wavelengths as Mitsuba draws them

        def clone(self) -> Any:
            props = mi.Properties(self.name)
            props["sample_count"] = self.sample_count()
            other = type(self)(props)
            if self.wavefront_size() > 0:
                other.seed(0, self.wavefront_size())
            for key, value in vars(self).items():
                setattr(other, key, value)
            other.dimension = mi.UInt32(self.dimension)
            return other

        fork = clone

        def _begin(self) -> None:
            self.table = mi.UInt32(byte_tables())
            self.dimension = mi.UInt32(0)
            pixel, self.number, in_all = self._samples()
            self.bits = (in_all - 1).bit_length()
            self.row = pixel // self._window.width
            self.column = pixel - self.row * self._window.width
            self.side = (max(self._window.width, self._window.height) - 1).bit_length()
            self.key = self._seed

        def digits(self, index: mi.UInt32, dimension: mi.UInt32) -> mi.UInt32:
            """Bits of a coordinate in reverse order, before it is scrambled."""
            found, reverse = mi.UInt32(0), dr.brev(index)
            for place in range(BITS // BYTE):
                of_place = (reverse >> BITS - BYTE * (place + 1)) & ((1 << BYTE) - 1)
                entry = dimension * (BITS // BYTE << BYTE) + (place << BYTE) + of_place
                found ^= dr.gather(mi.UInt32, self.table, entry)
            return found

    class ZSobol(Comparator):
        name = "zsobol"

        def _coordinates(self, count: int) -> list[mi.Float]:
            first, self.dimension = self.dimension, self.dimension + count
            code = morton(self.column, self.row) << self.bits | self.number
            index = nested_shuffle_of_fours(code, self.side + self.bits // 2, combine(first, self.key))
            keys = [combine(first + k, self.key ^ 0x68E31DA4) for k in range(count)]
            return [
                owen_sobol._unit(dr.brev(owen_scramble(self.digits(index, mi.UInt32(k)), key)))
                for k, key in enumerate(keys)
            ]

    class GlobalSobol(Comparator):
        name = "owen-sobol"

        def _begin(self) -> None:
            super()._begin()
            columns = generators.joe_kuo(2)
            matrices = [generators._matrix(row) for row in columns]
            low = 2 * self.side
            position = np.concatenate([m[: self.side] for m in matrices])  # of an index, in pixels
            inverse = generators._inverse(position[:, :low])
            # The sample's number are the bits above; what they add to the position is taken off again
            place = [_bit(self.column, self.side - 1 - k) for k in range(self.side)]
            place += [_bit(self.row, self.side - 1 - k) for k in range(self.side)]
            for k in range(low):
                for j in range(self.bits):
                    if position[k, low + j]:
                        place[k] = place[k] ^ _bit(self.number, j)
            index = self.number << low
            for k in range(low):
                bit = mi.UInt32(0)
                for j in np.flatnonzero(inverse[k]):
                    bit ^= place[int(j)]
                index |= bit << k
            self.index = index

        def _coordinates(self, count: int) -> list[mi.Float]:
            first, self.dimension = self.dimension, self.dimension + count
            return [self._own(first + k) for k in range(count)]

        def _own(self, dimension: mi.UInt32) -> mi.Float:
            digits = self.digits(self.index, dimension % 256)
            scrambled = owen_sobol._unit(dr.brev(owen_scramble(digits, combine(dimension, self.key))))
            in_pixel = owen_sobol._unit(dr.brev(digits) << self.side)
            return dr.select(dimension < 2, in_pixel, scrambled)

    mi.register_sampler("zsobol", ZSobol)
    mi.register_sampler("owen-sobol", GlobalSobol)


def owen_scramble(reversed_bits: mi.UInt32, key: mi.UInt32) -> mi.UInt32:
    """Owen's nested scrambling of numbers whose bits are in reverse order, as pbrt's `FastOwenScrambler` has it.

    S. Laine and T. Karras, "Stratified sampling for stochastic transparency" (2011), with N. Vegdahl's constants.
    """
    x = reversed_bits
    x = x ^ x * 0x3D20ADEA
    x = (x + key) * ((key >> 16) | 1)
    x = x ^ x * 0x05526C56
    return x ^ x * 0x53A22864


def _bit(number: mi.UInt32, k: int) -> mi.UInt32:
    return (number >> k) & 1
