"""Orthogonal arrays: q² points, evenly spread in every pair of coordinates and in each coordinate.

Bose's array over the field of q elements (Sankhyā 3, 1938) has q² rows and at most q + 1 columns of levels 0 … q−1;
each pair of columns has each pair of levels once. Jittered as by Jarosz, Enayet, Kensler, Kilpatrick and Christensen
(Computer Graphics Forum 38, 2019): levels are relabelled at random, and the points of a level take its q parts in
random order, so that each of the n intervals of a coordinate holds one. `scipy.stats.qmc.LatinHypercube` makes such
sets for primes q; renders mostly take 16, 64 or 256 samples per pixel, and 4, 8 and 16 are powers of a prime.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from .._support.arrays import Array, Indices


def prime_power(q: int) -> tuple[int, int] | None:
    """The prime p and the exponent m of q = p^m, or None.

    Examples
    --------
    >>> from voroquad.designs.orthogonal import prime_power
    >>> [prime_power(q) for q in (7, 8, 12)]
    [(7, 1), (2, 3), None]
    """
    p = next((p for p in range(2, q + 1) if q % p == 0), None)
    if p is None:
        return None
    m = round(math.log(q, p))
    return (p, m) if p**m == q else None


def least(d: int) -> int:
    """The least number of points in d dimensions."""
    return next(q * q for q in itertools.count(2) if q + 1 >= d and prime_power(q))


def largest_size(n: int, d: int) -> int:
    """The largest number of rows, at most n, of an array with d columns."""
    root = next((q for q in range(math.isqrt(n), d - 2, -1) if prime_power(q)), None)
    if root is None:
        raise ValueError(
            f"an orthogonal array has at least n = {least(d)} samples in d = {d}, but a set may have at most {n}; "
            "raise n_points"
        )
    return root**2


def points(sets: int, n: int, d: int, rng: np.random.Generator) -> Array:
    """Independent sets (sets, n, d) of jittered orthogonal arrays, their points in random order.

    Raises
    ------
    ValueError
        n is not the square of a prime or of a power of one, or d exceeds its root by 2 or more.
    """
    q = math.isqrt(n)
    if q * q != n or prime_power(q) is None:
        near = [next((k * k for k in ks if prime_power(k)), None) for ks in (range(q, 1, -1), itertools.count(q + 1))]
        raise ValueError(
            f"n = {n} samples do not form an orthogonal array: n must be the square of a prime or prime power; "
            f"the nearest that are are n = {' and n = '.join(str(k) for k in near if k)}"
        )
    if d > q + 1:
        raise ValueError(
            f"an orthogonal array of n = {n} samples has at most d = {q + 1}, got {d}; take n = {least(d)}"
        )
    of_rows = array(q)[rng.permuted(np.tile(np.arange(n), (sets, 1)), axis=1)]  # (sets, n, q + 1)
    drawn = np.empty((sets, n, d))
    for axis in range(d):
        labels = rng.permuted(np.tile(np.arange(q), (sets, 1)), axis=1)
        level = np.take_along_axis(labels, of_rows[..., axis], axis=1)
        order = np.argsort(level + rng.random((sets, n)), axis=1)
        np.put_along_axis(drawn[..., axis], order, (np.arange(n) + rng.random((sets, n))) / n, axis=1)
    return np.minimum(drawn, np.nextafter(1.0, 0.0))


def array(q: int) -> Indices:
    """Bose's array (q², q + 1): the columns b and a + k b, k in the field, for all a and b."""
    add, multiply = field(q)
    a, b = np.divmod(np.arange(q * q), q)
    return np.stack([b, *(add[a, multiply[k, b]] for k in range(q))], -1)


def field(q: int) -> tuple[Indices, Indices]:
    """The tables (q, q) of addition and multiplication of the field of q = p^m elements.

    Element i is the polynomial whose coefficients are the digits of i to the base p. Products are taken modulo the
    first polynomial of degree m that leaves no two factors with the product 0.
    """
    p, m = prime_power(q) or (q, 1)
    powers = p ** np.arange(m)
    digits = np.arange(q)[:, None] // powers % p
    add = (digits[:, None] + digits) % p @ powers
    for modulus in digits:
        multiples = [digits]  # of x^0, x^1, …, by every element
        for _ in range(m - 1):
            shifted = np.roll(multiples[-1], 1, axis=1)
            top = shifted[:, :1].copy()
            shifted[:, 0] = 0
            multiples.append((shifted - top * modulus) % p)
        multiply = np.einsum("jk,kic->ijc", digits, np.stack(multiples)) % p @ powers
        if (multiply[1:, 1:] != 0).all():
            return add, multiply
    raise AssertionError(f"no irreducible polynomial for q = {q}")
