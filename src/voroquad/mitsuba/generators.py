"""Generator matrices of the sampler ``owensobol``: Sobol' sequences, and sequences over the field of four elements.

A matrix is kept as its columns, ``uint32`` each. Column k belongs to bit k of a point's index, counted from the lowest.
A coordinate of point i is the XOR of the columns of the bits that are set in i; its highest bit is the first binary
digit.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

Columns = NDArray[np.uint32]

#: Bits of an index and of a coordinate
BITS = 32
#: Coordinates that are sampled jointly; later ones repeat them in another order
DIMENSIONS = 256
#: Bits of an index that one look-up in `nibble_tables` takes
NIBBLE = 4
KINDS = ("joe-kuo", "sz")

#: Products in GF(4) = {0, 1, ω, ω + 1}, with ω² = ω + 1; element a + b ω is the number a + 2 b
_PRODUCTS = ((0, 0, 0, 0), (0, 1, 2, 3), (0, 2, 3, 1), (0, 3, 1, 2))
#: Binary matrices (rows) that take the two bits of each base-4 digit of the four coordinates of a quad. They leave a
#: digit's value one of four. Of the 6⁴ choices this is one with t = 0 in base 2 for the pairs (0, 1) and (2, 3).
_DIGIT_MAPS = (((0, 1), (1, 0)), ((1, 1), (0, 1)), ((0, 1), (1, 0)), ((1, 1), (0, 1)))


@cache
def nibble_tables(kind: str) -> Columns:
    """The XOR of the columns of each four bits of an index, as bit-reversed coordinates.

    Parameters
    ----------
    kind : str
        One of `KINDS`.

    Returns
    -------
    ndarray of uint32, (DIMENSIONS · 128,)
        Entry 128 d + 16 j + v is of coordinate d, where bits 4j to 4j + 3 of the index are v.
    """
    columns = {"joe-kuo": joe_kuo, "sz": sz}[kind](DIMENSIONS)
    values = np.arange(1 << NIBBLE)
    tables = np.zeros((DIMENSIONS, BITS // NIBBLE, 1 << NIBBLE), np.uint32)
    for k in range(BITS):
        tables[:, k // NIBBLE] ^= np.where(values >> k % NIBBLE & 1, _reversed_bits(columns[:, k])[:, None], 0)
    return tables.ravel()


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


def sz(d: int) -> Columns:
    """Columns (d, 32) of quads of coordinates: each is a (0, 4)-sequence in base 4, its two pairs (0, 2)-sequences.

    Parameters
    ----------
    d : int
        A multiple of 4.

    Notes
    -----
    Over GF(4) the matrices C(j, i) a^(j−i), for the four elements a, make a (0, 4)-sequence in base 4 (Faure). Here an
    element is two bits. In base 2 too, the pairs of coordinates (0, 1) and (2, 3) then have t = 0, by `_DIGIT_MAPS`.
    All quads have these matrices, and each but the first its own linear map of the index that keeps aligned blocks of
    2^m indices: it takes other points together with those of the other quads.

    References
    ----------
    A. G. M. Ahmed, M. Pharr, V. Ostromoukhov and H. Huang, "SZ sequences: binary-based (0, 2^q)-sequences" (2025).

    Examples
    --------
    >>> [f"{column:#x}" for column in sz(4)[1, :3]]
    ['0xc0000000', '0x80000000', '0xf0000000']
    """
    quad = np.stack([_pascal(a) for a in range(4)])
    columns = [quad]
    for number in range(1, d // 4):
        own = np.zeros_like(quad)
        for k, mask in enumerate(_index_map(number)):
            for j in range(k + 1):
                own[:, k] ^= quad[:, j] * np.uint32(mask >> j & 1)
        columns.append(own)
    return np.concatenate(columns)


def _pascal(a: int) -> Columns:
    """Columns (32,) of the matrix C(j, i) a^(j−i) over GF(4), with the coordinate's map of digits."""
    (m00, m01), (m10, m11) = _DIGIT_MAPS[a]
    columns = np.zeros(BITS, np.uint32)
    for j in range(BITS // 2):
        power = 1  # a^(j−i)
        for i in range(j, -1, -1):
            if i & ~j == 0:  # C(j, i) is odd (Lucas)
                for bit in range(2):
                    digit = _PRODUCTS[power][1 << bit]
                    high, low = digit >> 1, digit & 1
                    mapped = (m00 * high ^ m01 * low) << 1 | m10 * high ^ m11 * low
                    columns[2 * j + bit] |= np.uint32(mapped << BITS - 2 - 2 * i)
            power = _PRODUCTS[power][a]
    return columns


def _index_map(number: int) -> list[int]:
    """Columns of the binary matrix by which quad `number` maps indices: unit upper triangular, random above.

    A bit depends on itself and higher ones, so that aligned blocks of 2^m indices stay together. The entries are the
    same in every version of NumPy, whose seed sequences are fixed.
    """
    words = np.random.SeedSequence(number).generate_state(BITS)
    return [int(word) & (1 << k) - 1 | 1 << k for k, word in enumerate(words)]


def _reversed_bits(x: Columns) -> Columns:
    """Each number with its 32 bits in reverse order."""
    flipped = np.zeros_like(x)
    for k in range(BITS):
        flipped |= (x >> np.uint32(k) & np.uint32(1)) << np.uint32(BITS - 1 - k)
    return flipped
