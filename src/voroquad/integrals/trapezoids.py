"""Polygons as trapezoids with two sides parallel to the y axis."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from .._support.arrays import Array


@dataclass(frozen=True)
class Trapezoid:
    """x from x_0 to x_1, y between two lines.

    Attributes
    ----------
    x : tuple of float
        Ends of its range.
    low, high : tuple of float
        Heights of the lower and the upper line at both ends.
    """

    x: tuple[float, float]
    low: tuple[float, float]
    high: tuple[float, float]

    empty = False

    @property
    def d(self) -> int:
        """Dimension."""
        return 2

    @property
    def volume(self) -> float:
        """Area."""
        return (self.x[1] - self.x[0]) * (self.high[0] - self.low[0] + self.high[1] - self.low[1]) / 2

    def pull_back(self, u: Array) -> tuple[Array, Array]:
        """Points (2, n) and the area element (n,) at u (2, n) of the unit square."""
        x, low, high = (ends[0] + (ends[1] - ends[0]) * u[0] for ends in (self.x, self.low, self.high))
        return np.stack([x, low + (high - low) * u[1]]), (self.x[1] - self.x[0]) * (high - low)


def trapezoids(rings: list[Array]) -> list[Trapezoid]:
    """The points within an odd number of rings (m, 2), as trapezoids.

    Between the x of neighbouring corners no side ends, so the sides there, from below upwards, bound the inside in
    turn. Trapezoids between the same two sides on both sides of a corner's x are one.

    Raises ValueError where sides cross.
    """
    sides = np.concatenate([np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings])
    sides = sides[sides[:, 0, 0] != sides[:, 1, 0]]  # (sides, ends, coordinates)
    sides = np.where((sides[:, 0, 0] > sides[:, 1, 0])[:, None, None], sides[:, ::-1], sides)
    cuts = np.unique(np.concatenate(rings)[:, 0])
    found: list[Trapezoid] = []
    open_: dict[tuple[int, int], Trapezoid] = {}
    for start, stop in pairwise(cuts.tolist()):
        across = np.flatnonzero((sides[:, 0, 0] <= start) & (sides[:, 1, 0] >= stop))
        heights = np.stack([_heights(sides[across], x) for x in (start, stop)])
        order = np.argsort(heights.sum(axis=0), kind="stable")
        across, heights = across[order], heights[:, order]
        _refuse_crossings(heights, sides, start, stop)
        now: dict[tuple[int, int], Trapezoid] = {}
        for below, above in zip(range(0, len(across), 2), range(1, len(across), 2), strict=False):
            pair = int(across[below]), int(across[above])
            low, high = ((float(h[0]), float(h[1])) for h in (heights[:, below], heights[:, above]))
            before = open_.pop(pair, None)
            if before is None:
                now[pair] = Trapezoid((start, stop), low, high)
            else:
                ends = (before.low[0], low[1]), (before.high[0], high[1])
                now[pair] = replace(before, x=(before.x[0], stop), low=ends[0], high=ends[1])
        found += open_.values()
        open_ = now
    found += open_.values()
    return [t for t in found if t.volume > 0]


def _heights(sides: Array, x: float) -> Array:
    """Where the sides (m, 2, 2) are above x; exact at their ends."""
    (x0, y0), (x1, y1) = sides[:, 0].T, sides[:, 1].T
    t = (x - x0) / (x1 - x0)
    return np.where(t == 1, y1, y0 + t * (y1 - y0))


def _refuse_crossings(heights: Array, sides: Array, start: float, stop: float) -> None:
    """Raise ValueError where sides that are in order at one end are not at the other."""
    slack = 1e-9 * float(np.ptp(sides[..., 1]))
    wrong = (np.diff(heights, axis=1) < -slack).any(axis=0)
    if wrong.any():
        at = heights[:, int(np.argmax(wrong))].mean()
        raise ValueError(f"vertices, holes: sides cross between x = {start:.6g} and {stop:.6g}, near y = {at:.6g}")
