"""Generator matrices of the sampler ``owensobol``: Sobol' sequences, and sequences over finite fields.

A matrix is kept as its columns, ``uint32`` each. Column k belongs to bit k of a point's index, counted from the lowest.
A coordinate of point i is the XOR of the columns of the bits that are set in i; its highest bit is the first binary
digit.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Columns = NDArray[np.uint32]
Bits = NDArray[np.uint8]

#: Bits of an index and of a coordinate
BITS = 32
KINDS = ("joe-kuo", "sz")
#: Coordinates of Joe and Kuo's sequences; later ones repeat them with the points in another order
SOBOL = 256
#: ``sz`` has 16 coordinates over GF(16), not 4 over GF(4), for sets of at least 16² points. (In the first half of such
#: a set some pairs of coordinates are nearly collinear.)
SIXTEEN_FROM = 256
#: Digits of a coordinate that an entry of `PairTables` holds
HALF = BITS // 2
#: Most bits of an index that one look-up takes; tables of two pairs for indices of 12 bits fit into the first cache
MOST_PART_BITS = 12


@dataclass(frozen=True)
class Field:
    """A field of 2^bits elements: polynomials over {0, 1}, as the bits of a number, modulo an irreducible one.

    Attributes
    ----------
    bits : int
        Of a digit of an index or a coordinate.
    modulus : int
        The irreducible polynomial.
    basis : tuple of int, (bits,)
        The elements that the bits of an index's digit stand for, lowest first.
    elements : tuple of int
        One for each coordinate.
    maps : tuple of tuple of int, (…, bits)
        For each coordinate, the bits of an element whose sums are the bits of a digit, highest first.
    """

    bits: int
    modulus: int
    basis: tuple[int, ...]
    elements: tuple[int, ...]
    maps: tuple[tuple[int, ...], ...]

    def product(self, a: int, b: int) -> int:
        """The product of two elements."""
        total = 0
        for k in range(self.bits):
            total ^= (b >> k & 1) * a
            a = a << 1 ^ (a >> self.bits - 1 & 1) * self.modulus
        return total


#: GF(4), ω = 2. Maps leave a digit's value one of four. Of the 6⁴ choices this is one with t = 0 in base 2 for the
#: pairs (0, 1) and (2, 3).
_FOUR = Field(2, 0b111, (1, 2), (0, 1, 2, 3), ((1, 2), (3, 1), (1, 2), (3, 1)))
#: GF(16), which has GF(4) = {0, 1, 6, 7} in it, in the basis 1, ω = 6, 2, 2 ω. A pair with the elements a and a + 1 has
#: t = 0 in base 2 by 64 of the 315² choices; pairs whose elements differ by anything else have no such choice. A quad
#: a + GF(4) has t = 0 in base 4 besides by 16 of the 64² choices of two pairs. Of the 16⁴ choices for four quads, this
#: is one of those where the fewest grids of 256 elementary boxes in two coordinates have empty ones by 256 points.
_SIXTEEN = Field(
    4, 0b10011, (1, 6, 2, 12), tuple(c ^ a for c in (0, 12, 2, 14) for a in (0, 1, 6, 7)),
    (
        (1, 12, 2, 4), (11, 4, 2, 1), (5, 2, 1, 8), (9, 3, 4, 1),
        (7, 2, 9, 1), (3, 9, 5, 1), (13, 1, 6, 2), (15, 4, 1, 2),
        (3, 9, 5, 1), (7, 2, 9, 1), (15, 4, 1, 2), (13, 1, 6, 2),
        (15, 4, 1, 2), (13, 1, 6, 2), (9, 3, 4, 1), (5, 2, 1, 8),
    ),
)  # fmt: skip


class PairTables(NamedTuple):
    """The digits of pairs of coordinates of points, by parts of their index.

    Attributes
    ----------
    entries : ndarray of uint32, (pairs · words · parts · 2^part_bits,)
        Entry ((p · words + h) · parts + j) · 2^part_bits + v is of pair p, where the j-th part of the index, the lowest
        first, is v with its bits in reverse order. It has digits 16 h to 16 h + 15 of both coordinates, those of the
        first one in the lower half. The lowest bit of a half is the highest digit.
    words : int
        Entries that hold the digits of a pair.
    parts, part_bits : int
        Parts of an index, and bits of each.
    joint : int
        Coordinates that are sampled jointly; later ones repeat them with the points in another order.
    """

    entries: Columns
    words: int
    parts: int
    part_bits: int
    joint: int


@cache
def pair_tables(kind: str, size: int, index_bits: int) -> PairTables:
    """The tables for points whose index has so many bits. They have as many digits as the index, or more.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    size : int
        Points of a set. Pairs of coordinates are `crossed` for sets of the power of two at or above it.
    index_bits : int
        Bits of an index.
    """
    columns = joe_kuo(SOBOL) if kind == "joe-kuo" else sz(16 if size >= SIXTEEN_FROM else 4)
    columns = crossed(columns, (size - 1).bit_length())
    words = -(-index_bits // HALF)
    parts = -(-index_bits // MOST_PART_BITS)
    part_bits = -(-index_bits // max(parts, 1))
    values = np.arange(1 << part_bits)
    entries = np.zeros((len(columns) // 2, words, parts, 1 << part_bits), np.uint32)
    for k in range(index_bits):
        has_bit = values >> (part_bits - 1 - k % part_bits) & 1
        digits = _reversed_bits(columns[:, k])
        for word in range(words):
            half = digits >> np.uint32(HALF * word) & np.uint32((1 << HALF) - 1)
            pair = half[::2] | half[1::2] << np.uint32(HALF)
            entries[:, word, k // part_bits] ^= np.where(has_bit, pair[:, None], np.uint32(0))
    return PairTables(entries.ravel(), words, parts, part_bits, len(columns))


def joe_kuo(d: int) -> Columns:
    """Columns (d, 32) of Sobol' sequences with the direction numbers of Joe and Kuo (2008), which SciPy ships.

    Notes
    -----
    With a primitive polynomial x^s + a_1 x^(s−1) + … + a_(s−1) x + 1 and given m_1, …, m_s, the others follow by
    m_k = 2 a_1 m_(k−1) ⊕ … ⊕ 2^(s−1) a_(s−1) m_(k−s+1) ⊕ 2^s m_(k−s) ⊕ m_(k−s). Column k − 1 is m_k 2^(32−k).

    References
    ----------
    S. Joe and F. Y. Kuo, "Constructing Sobol sequences with better two-dimensional projections", SIAM Journal on
    Scientific Computing 30 (2008).

    Examples
    --------
    >>> [f"{column:#x}" for column in joe_kuo(2)[1, :3]]
    ['0x80000000', '0xc0000000', '0xa0000000']
    """
    with (files("scipy.stats") / "_sobol_direction_numbers.npz").open("rb") as file, np.load(file) as data:
        polynomials, starts = data["poly"][:d].tolist(), data["vinit"][:d].tolist()
    columns = np.empty((d, BITS), np.uint32)
    columns[0] = [1 << BITS - 1 - k for k in range(BITS)]
    for row, polynomial, start in zip(columns[1:], polynomials[1:], starts[1:], strict=True):
        degree = polynomial.bit_length() - 1
        m = start[:degree]
        for k in range(degree, BITS):
            new = m[k - degree]
            for i in range(1, degree + 1):
                new ^= (polynomial >> degree - i & 1) * m[k - i] << i
            m.append(new)
        row[:] = [m[k] << BITS - 1 - k for k in range(BITS)]
    return columns


def sz(coordinates: int = 4) -> Columns:
    """Columns (4, 32) or (16, 32) of a (0, q)-sequence in base q = 4 or 16, whose pairs are (0, 2)-sequences.

    Notes
    -----
    Over GF(q) the matrices C(j, i) a^(j−i), for the q elements a, make a (0, q)-sequence in base q (Faure). Here an
    element is two or four bits. In base 2 too, the pairs of coordinates (0, 1), (2, 3), … then have t = 0, by the maps
    of digits. Of 16 coordinates, each quad is a (0, 4)-sequence in base 4 besides.

    References
    ----------
    A. G. M. Ahmed, M. Pharr, V. Ostromoukhov and H. Huang, "SZ sequences: binary-based (0, 2^q)-sequences" (2025).

    Examples
    --------
    >>> [f"{column:#x}" for column in sz()[1, :3]]
    ['0xc0000000', '0x80000000', '0xf0000000']
    """
    field = {4: _FOUR, 16: _SIXTEEN}[coordinates]
    return np.stack([_pascal(field, k) for k in range(coordinates)])


def upper_digits(bits: int) -> tuple[int, int]:
    """Of a set of 2^bits points, the digits of either coordinate of a pair that say in which cell of a grid it is."""
    return bits - bits // 2, bits // 2


def crossed(columns: Columns, bits: int) -> Columns:
    """Columns of the same nets, whose pairs of coordinates have evenly spaced points in each row of cells.

    Parameters
    ----------
    columns : ndarray of uint32, (d, 32)
        Of pairs of coordinates.
    bits : int
        For sets of 2^bits points.

    Returns
    -------
    ndarray of uint32, (d, 32)
        Those of pairs with t > 0 are as they were.

    Notes
    -----
    A net of n = 2^m points with t = 0 has one point in each cell of a grid of 2^a by 2^(m−a). So the upper digits X and
    Y of its coordinates, a and m − a of them, determine the point, and the lower m − a digits of x are A X + B Y plus a
    constant. Here A X is taken off: a lower triangular matrix, which keeps nets (Matoušek 1998). The points of a row of
    cells have one Y, hence one place in their cells: they are evenly spaced. So are those of a column. Correlated
    multi-jittered samples (Kensler 2013) have this property too, and errors of smooth integrands in x and y cancel by
    it. `crossed_scramble` in `scrambles` keeps it; Owen's scrambling does not.

    References
    ----------
    J. Matoušek, "On the L2-discrepancy for anchored boxes", Journal of Complexity 14 (1998).
    A. Kensler, "Correlated multi-jittered sampling", Pixar Technical Memo 13-01 (2013).
    """
    changed = columns.copy()
    own, other = upper_digits(bits)
    for first in range(0, len(columns), 2):
        x, y = _matrix(columns[first]), _matrix(columns[first + 1])
        cell = np.concatenate([x[:own, :bits], y[:other, :bits]])
        inverse = _inverse(cell)
        if inverse is not None:
            changed[first] = _columns(_without(x, own, bits, inverse[:, :own]))
            changed[first + 1] = _columns(_without(y, other, bits, inverse[:, own:]))
    return changed


def _without(matrix: Bits, upper: int, bits: int, inverse: Bits) -> Bits:
    """A generator matrix, the lower of its first digits without what its upper digits say of them."""
    changed = matrix.copy()
    share = matrix[upper:bits, :bits] @ inverse % 2
    changed[upper:bits] ^= share @ matrix[:upper] % 2
    return changed


def _matrix(columns: Columns) -> Bits:
    """Columns (32,) as a matrix (32, 32) of bits; row 0 is of the highest digit."""
    return (columns[None] >> np.arange(BITS - 1, -1, -1, dtype=np.uint32)[:, None] & 1).astype(np.uint8)


def _columns(matrix: Bits) -> Columns:
    """The inverse of `_matrix`."""
    return np.bitwise_or.reduce(matrix.astype(np.uint32) << np.arange(BITS - 1, -1, -1, dtype=np.uint32)[:, None], 0)


def _inverse(matrix: Bits) -> Bits | None:
    """The inverse over GF(2), by Gauss and Jordan; None if there is none."""
    size = len(matrix)
    both = np.concatenate([matrix, np.eye(size, dtype=np.uint8)], 1)
    for k in range(size):
        pivots = np.flatnonzero(both[k:, k])
        if not pivots.size:
            return None
        both[[k, k + pivots[0]]] = both[[k + pivots[0], k]]
        others = np.flatnonzero(both[:, k])
        both[others[others != k]] ^= both[k]
    return both[:, size:]


def _pascal(field: Field, coordinate: int) -> Columns:
    """Columns (32,) of the matrix C(j, i) a^(j−i) of a coordinate, with its map of digits."""
    bits, a = field.bits, field.elements[coordinate]
    sums = field.maps[coordinate]
    columns = np.zeros(BITS, np.uint32)
    for j in range(BITS // bits):
        power = 1  # a^(j−i)
        for i in range(j, -1, -1):
            if i & ~j == 0:  # C(j, i) is odd (Lucas)
                for bit, of_bit in enumerate(field.basis):
                    element = field.product(power, of_bit)
                    for place, mask in enumerate(sums):
                        digit = (element & mask).bit_count() & 1
                        columns[bits * j + bit] |= np.uint32(digit << BITS - 1 - bits * i - place)
            power = field.product(power, a)
    return columns


def _reversed_bits(x: Columns) -> Columns:
    """Each number with its 32 bits in reverse order."""
    flipped = np.zeros_like(x)
    for k in range(BITS):
        flipped |= (x >> np.uint32(k) & np.uint32(1)) << np.uint32(BITS - 1 - k)
    return flipped
