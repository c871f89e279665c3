"""Ways to randomise the samples of a pixel in two coordinates: variances of known integrands, without a renderer.

    python benchmarks/pair_scrambles.py

Sets of n points: independent; correlated multi-jittered, as Mitsuba's multijitter (Kensler 2013); a (0, 2)-net in base
2 with Owen's scrambling; and the same net as `owensobol` has it, with points evenly spaced in rows and columns.
The nets are of the first pair of `sz`. A variance is that of the mean of a set over SETS sets; its relative standard
error is about √(2 / SETS). The CSV has the variance times n over that of one sample: 1 for independent points.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from voroquad.mitsuba.generators import BITS, crossed, sz, upper_digits

SETS = 2000
SIZES = (16, 64, 256)
Floats = NDArray[np.float64]
Points = tuple[Floats, Floats]
INTEGRANDS: dict[str, Callable[[Floats, Floats], Floats]] = {
    "wide bump": lambda x, y: np.exp(-8 * ((x - 0.4) ** 2 + (y - 0.6) ** 2)),
    "narrow bump": lambda x, y: np.exp(-60 * ((x - 0.4) ** 2 + (y - 0.6) ** 2)),
    "half-plane": lambda x, y: 1.0 * (0.6 * x + 0.8 * y > 0.7),
    "disc": lambda x, y: 1.0 * ((x - 0.5) ** 2 + (y - 0.45) ** 2 < 0.1),
    "bump with an edge": lambda x, y: np.exp(-8 * ((x - 0.4) ** 2 + (y - 0.6) ** 2)) * (0.6 * x + 0.8 * y > 0.7),
    "xy": lambda x, y: x * y,
}


def independent(n: int, rng: np.random.Generator) -> Points:
    """Independent points."""
    return rng.random(n), rng.random(n)


def multi_jittered(n: int, rng: np.random.Generator) -> Points:
    """Correlated multi-jittered points, in √n by √n cells."""
    side = round(n**0.5)
    column, row = np.arange(n) % side, np.arange(n) // side
    place_x, place_y = rng.permutation(side)[row], rng.permutation(side)[column]
    return (column + (place_x + rng.random(n)) / side) / side, (row + (place_y + rng.random(n)) / side) / side


def owen(n: int, rng: np.random.Generator) -> Points:
    """A net with Owen's scrambling."""
    x, y = (scrambled(v, n.bit_length() - 1, rng) for v in net(n, sz()))
    return (x + rng.random(n)) / n, (y + rng.random(n)) / n


def spaced(n: int, rng: np.random.Generator) -> Points:
    """The net with the lower digits of one coordinate following the upper ones of the other."""
    bits = n.bit_length() - 1
    values = []
    for v, upper in zip(net(n, crossed(sz(), bits)), upper_digits(bits), strict=True):
        lower = bits - upper
        high, low = scrambled(v >> lower, upper, rng), scrambled(v & (1 << lower) - 1, lower, rng)
        values.append(((high << lower | low) + rng.random(n)) / n)
    return values[0], values[1]


KINDS = {f.__name__: f for f in (independent, multi_jittered, owen, spaced)}


def net(n: int, columns: NDArray[np.uint32]) -> list[NDArray[np.int64]]:
    """The first coordinates of n points, as whole numbers below n."""
    bits = n.bit_length() - 1
    values = np.zeros((2, n), np.int64)
    for k in range(bits):
        values ^= np.where(np.arange(n) >> k & 1, (columns[:2, k] >> (BITS - bits))[:, None].astype(np.int64), 0)
    return list(values)


def scrambled(values: NDArray[np.int64], bits: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Each digit flipped at random, alike where all higher digits are alike."""
    flips = np.zeros_like(values)
    for k in range(bits):
        flips |= rng.integers(0, 2, 1 << k)[values >> bits - k] << bits - 1 - k
    return values ^ flips


def rows(n: int) -> list[list[object]]:
    """Variances by sets of n points."""
    rng = np.random.default_rng(n)
    centres = (np.arange(2000) + 0.5) / 2000
    x, y = np.meshgrid(centres, centres)
    single = {name: float(f(x, y).var()) for name, f in INTEGRANDS.items()}
    table: list[list[object]] = []
    for kind, draw in KINDS.items():
        means: dict[str, list[float]] = {name: [] for name in INTEGRANDS}
        for _ in range(SETS):
            points = draw(n, rng)
            for name, f in INTEGRANDS.items():
                means[name].append(float(f(*points).mean()))
        table += [[n, name, kind, f"{np.var(means[name], ddof=1) * n / single[name]:.3e}"] for name in INTEGRANDS]
    return table


if __name__ == "__main__":
    with (Path(__file__).parent / "results" / "pair_scrambles.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["samples", "integrand", "sets", "variance"])
        for size in SIZES:
            writer.writerows(rows(size))
