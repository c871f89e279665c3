"""The pilot rule once more, cell by cell and sample by sample, with nothing of the compiled core."""

from __future__ import annotations

import itertools
import math
from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache

import numpy as np
from numpy.polynomial import Polynomial
from scipy.stats import qmc

Array = np.ndarray


def rough(x: Array) -> Array:
    """A bump, a kink and an edge: many stencils and numbers of samples."""
    s = x.sum(axis=0)
    return np.exp(-20 * np.square(x - 0.3).sum(axis=0)) + np.abs(s - 0.7) + 0.5 * (x[0] > 0.6)


def keys_of(seed: int, d: int) -> Array:
    """Of a sequence for each of fifteen levels and of the stencils."""
    sequences = 15 * (6 if d < 3 else 5)
    return np.random.default_rng(seed).integers(0, 2**64, size=(sequences, d, 65), dtype=np.uint64)


def basis(begin: int, cell: int, r: int) -> list[Polynomial]:
    """Lagrange's polynomials of r centres from `begin` on, in units of a cell from the centre of `cell`."""
    nodes = np.arange(begin, begin + r) - cell
    polynomials = []
    for j in range(r):
        others = np.delete(nodes, j)
        polynomials.append(Polynomial.fromroots(others) / np.prod(nodes[j] - others) if r > 1 else Polynomial([1.0]))
    return polynomials


def mean_over_cell(p: Polynomial) -> float:
    antiderivative = p.integ()
    return float(antiderivative(0.5) - antiderivative(-0.5))


def begin_of(cell: int, r: int, k: int) -> int:
    return int(np.clip(cell - (r - 1) // 2, 0, k - r))


def error_along(line: Array, i: int, r: int) -> float:
    """How far the stencil of size r is off at cell i of a line of values."""
    k = len(line)
    if r == 1:
        return max((abs(line[j] - line[i]) for j in (i - 1, i + 1) if 0 <= j < k), default=0.0) / 2
    begin = begin_of(i, r, k)
    difference = np.diff(line[begin : begin + r], n=r - 1)[0] / math.comb(r - 1, (r - 1) // 2)
    return float(difference * amplitude(i - begin, r))


@cache
def amplitude(place: int, r: int) -> float:
    """How much larger the error of a stencil of size r is at one of its places than in its middle."""

    def size(at: int) -> float:
        return mean_over_cell(Polynomial.fromroots(np.arange(r) - at) ** 2)

    return math.sqrt(size(place) / size((r - 1) // 2))


def error_across(grid: Array, cell: tuple[int, ...], r: int) -> float:
    """How far the product of the errors along all axes of a grid of two or three is off at a cell.

    0 unless the stencil is shifted along one axis of two, or two axes of three.
    """
    begins = [begin_of(c, r, len(grid)) for c in cell]
    places = [c - begin for c, begin in zip(cell, begins, strict=True)]
    if r == 1 or sum(place != (r - 1) // 2 for place in places) < grid.ndim - 1:
        return 0.0
    mixed = grid[tuple(slice(begin, begin + r) for begin in begins)]
    for axis, place in enumerate(places):
        mixed = np.diff(mixed, n=r - 1, axis=axis) / math.comb(r - 1, (r - 1) // 2) * amplitude(place, r)
    return mixed.item()


@cache
def sequence(d: int) -> Array:
    """The first points of the Sobol' sequence, in the order of Gray's code."""
    return qmc.Sobol(d, scramble=False).random(2**12)


def scrambled(index: int, keys: Array) -> Array:
    """A point of the sequence: linear scrambling with a digital shift, digit by digit."""
    d = len(keys)
    digits = [[int(x * 2**30) >> (29 - b) & 1 for b in range(30)] + [0] * 34 for x in sequence(d)[index]]
    point = np.empty(d)
    for a in range(d):
        bits = (keys[a][:, None] >> np.arange(63, -1, -1, dtype=np.uint64)).astype(int) & 1
        rows = np.tril(bits[:64], -1) + np.eye(64, dtype=int)
        scrambled_digits = (rows @ digits[a] + bits[64]) % 2
        point[a] = scrambled_digits[:53] @ 2.0 ** -np.arange(1, 54)
    return point


def differences_of_halves(residuals: Array) -> Iterator[tuple[int, float]]:
    """By scale the residuals, and what the sums of the halves of each block of 2^scale of them differ by."""
    yield from ((0, r) for r in residuals)
    for scale in range(1, len(residuals).bit_length()):
        for block in residuals.reshape(-1, 2, 2 ** (scale - 1)).sum(axis=2):
            yield scale, block[0] - block[1]


def pilot(f: Callable[[Array], Array], n: int, d: int, keys: Array) -> tuple[float, Array, int]:
    """Of a function of points (d, n) the estimate, sums of squares and fourth powers, and the number of evaluations.

    The sums are (2, levels, scales).
    """
    k = int((n / 4) ** (1 / d) + 1e-9)
    sizes = [r for r in ((1, 3, 5, 7, 9, 11) if d < 3 else (1, 3, 5, 7, 9)) if r <= k]
    cells = list(itertools.product(range(k), repeat=d))
    grid = f((np.array(cells).T + 0.5) / k).reshape((k,) * d)

    raw = np.zeros((len(sizes), *grid.shape))
    for cell in cells:
        for q, r in enumerate(sizes):
            lines = [grid[(*cell[:a], slice(None), *cell[a + 1 :])] for a in range(d)]
            raw[(q, *cell)] = sum(error_along(lines[a], cell[a], r) ** 2 for a in range(d))
            for axes in [c for count in range(2, d + 1) for c in itertools.combinations(range(d), count)]:
                part = grid[tuple(slice(None) if c in axes else cell[c] for c in range(d))]
                raw[(q, *cell)] += error_across(part, tuple(cell[a] for a in axes), r) ** 2
    around = np.zeros_like(raw)
    for cell in cells:
        box = tuple(slice(max(i - 1, 0), i + 2) for i in cell)
        around[(slice(None), *cell)] = raw[(slice(None), *box)].sum(axis=tuple(range(1, d + 1)))
    judged = raw + 0.3 * around / 3**d
    pick = judged.argmin(axis=0)

    largest = np.abs(grid).max()
    unit = 2.0 ** np.frexp(largest)[1]  # steps of the demand begin at another number in other units
    demand = np.cbrt((judged.min(axis=0) + (1e-16 * largest) ** 2) / unit**2).ravel()
    steps = np.floor(512 * np.log2(demand)).astype(int)
    steps += np.array([((i * 0x9E3779B97F4A7C15) % 2**64) >> 55 for i in range(len(cells))])

    def levels_at(offset: int) -> Array:
        return np.clip((steps + offset) // 512, 0, 14)

    above = bisect_right(range(-40_000, 40_000), n - len(cells), key=lambda o: int((2 ** levels_at(o)).sum()))
    levels = levels_at(above - 40_001)

    morton = {c: sum((c[a] >> q & 1) << (q * d + a) for q in range(16) for a in range(d)) for c in cells}
    taken: Counter[int] = Counter()
    total, powers, used = 0.0, np.zeros((2, 15, 15)), len(cells)
    for cell in sorted(cells, key=morton.__getitem__):
        r, level = sizes[pick[cell]], int(levels.reshape(grid.shape)[cell])
        m, sequence = 2**level, level * (6 if d < 3 else 5) + int(pick[cell])
        begins = [begin_of(i, r, k) for i in cell]
        bases = [basis(b, i, r) for b, i in zip(begins, cell, strict=True)]
        values = grid[tuple(slice(b, b + r) for b in begins)]

        def predicted(weights: list[Array], values: Array = values) -> Array:
            """Of points whose weights are (r, points) along each axis."""
            letters = "abc"[:d]
            return np.einsum(f"{letters},{','.join(x + 'z' for x in letters)}->z", values, *weights)

        v = np.array([scrambled(taken[sequence] * m + j, keys[sequence]) - 0.5 for j in range(m)])
        taken[sequence] += 1
        y = f(((np.array(cell) + 0.5 + v) / k).T)
        residuals = y - predicted([np.array([p(x) for p in polys]) for polys, x in zip(bases, v.T, strict=True)])
        of_cell = predicted([np.array([[mean_over_cell(p)] for p in polys]) for polys in bases])
        total += float(of_cell[0]) + residuals.mean()
        for scale, difference in differences_of_halves(residuals):
            powers[:, level, scale] += difference**2, difference**4
        used += m
    return total / len(cells), powers, used
