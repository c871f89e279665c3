"""Low-discrepancy sequences with random scramblings under which each point is uniform in the unit box.

Sobol' points are scrambled here and not by SciPy, whose points have a fixed number of binary digits, 30 by default.
They lie on a lattice and are not exactly uniform. Here the digits below the scrambled ones are random.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._support.arrays import Array
from .engines import BELOW_ONE, engine_points

_BITS = 32


def sobol(sets: int, n: int, d: int, rng: np.random.Generator) -> Array:
    """Sobol' points (sets, n, d) with Owen's nested uniform scrambling."""
    return _from_digits(owen_scramble(_sobol_digits(n, d), sets, rng), rng)


def halton(sets: int, n: int, d: int, rng: np.random.Generator) -> Array:
    """Halton points (sets, n, d), scrambled by random permutations of their digits."""
    from scipy.stats import qmc

    return np.stack([engine_points(qmc.Halton(d, scramble=True, rng=r), n) for r in rng.spawn(sets)])


def zero_two(sets: int, n: int, d: int, rng: np.random.Generator) -> Array:
    """The (0,2)-sequence (sets, n, d ≤ 2) with random digital shifts."""
    flips = rng.integers(0, 2**_BITS, size=(sets, 1, d), dtype=np.uint64)
    return _from_digits(_sobol_digits(n, d) ^ flips, rng)


def _sobol_digits(n: int, d: int) -> NDArray[np.uint64]:
    """The first n Sobol' points (n, d) as 32-bit integers."""
    if n > 2**_BITS:
        raise ValueError(f"Sobol' points are made from {_BITS} digits: n must be at most 2^{_BITS}, got {n}")
    from scipy.stats import qmc

    engine = qmc.Sobol(d, scramble=False, bits=_BITS)
    points = engine_points(engine, n)
    return (points * 2.0**_BITS).astype(np.uint64)


def owen_scramble(digits: NDArray[np.uint64], sets: int, rng: np.random.Generator) -> NDArray[np.uint64]:
    """Nested uniform scramblings (sets, n, d) of 32-bit points (n, d), independent in each set and coordinate.

    Digit k is flipped or not by a fair coin that depends on the k − 1 digits before it (Owen 1995).
    The coin is one bit of a hash of those digits and of a random key per digit, set and coordinate.
    """
    keys = rng.integers(0, 2**64, size=(_BITS, sets, 1, digits.shape[-1]), dtype=np.uint64)
    scrambled = np.repeat(digits[None], sets, axis=0)
    for k in range(_BITS):
        prefix = digits >> np.uint64(_BITS - k)
        coin = _mix(prefix ^ keys[k]) >> np.uint64(63)
        scrambled ^= coin << np.uint64(_BITS - 1 - k)
    return scrambled


def _mix(x: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """A bijection of 64-bit integers with good avalanche (the finaliser of SplitMix64, Steele 2014)."""
    with np.errstate(over="ignore"):
        x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


def _from_digits(digits: NDArray[np.uint64], rng: np.random.Generator) -> Array:
    """Points of [0, 1) with the given first 32 binary digits; the digits below are random."""
    points = (digits.astype(np.float64) + rng.random(digits.shape)) * 2.0**-_BITS
    return np.minimum(points, BELOW_ONE)
