"""Maps of the unit box onto itself, axis by axis, learned from samples: they spread samples where f is large."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator

from .._support.arrays import Array
from .regions import Region, within

#: Intervals of a map along an axis; between their ends it is a monotone cubic, since kinks cost smooth peaks digits.
INTERVALS = 24

#: Exponent that damps the changes of a step, and the least part of the mass that an interval is taken to have.
DAMPING, LEAST = 0.6, 1e-12

#: Steps of the inverse: Newton's, or halving where Newton's would leave the interval. The last is from a value that is
#: off by less than a part of it and of the interval, so that the rest is rounding, or by rounding.
STEPS, NEAR, ROUNDING = 60, 1e-9, 2.0**-51


class SeparableMap:
    """A map of the unit box onto itself, axis by axis, u_a = S_a(v_a).

    Parameters
    ----------
    nodes : ndarray, (d, k + 1)
        S_a(j/k), from 0 to 1, ascending.
    """

    def __init__(self, nodes: Array):
        self.nodes = nodes
        self._k = nodes.shape[1] - 1
        grid = np.linspace(0, 1, self._k + 1)
        # (4, d, k): coefficients of powers of v − j/k, the cube first
        self._cubics = np.stack([PchipInterpolator(grid, axis).c for axis in nodes], axis=1)

    @classmethod
    def identity(cls, d: int) -> SeparableMap:
        """The map that changes nothing."""
        return cls(np.tile(np.linspace(0, 1, INTERVALS + 1), (d, 1)))

    def __call__(self, v: Array) -> tuple[Array, Array]:
        """Points u (d, n) and the volume element (n,) at v (d, n)."""
        j = np.minimum((v * self._k).astype(np.intp), self._k - 1)
        u, slopes = _at(self._pieces(j), v - j / self._k)
        return u, np.prod(slopes, axis=0)

    def inverse(self, u: Array) -> Array:
        """v (d, n) of points u (d, n), by Newton's method within the interval of each."""
        j = np.stack([np.searchsorted(ends[1:-1], x, side="right") for ends, x in zip(self.nodes, u, strict=True)])
        return j / self._k + _solved(self._pieces(j).reshape(4, -1), u.ravel(), 1 / self._k).reshape(u.shape)

    def _pieces(self, j: Array) -> Array:
        """The coefficients (4, d, n) of intervals j (d, n)."""
        return self._cubics[:, np.arange(len(j))[:, None], j]


def _at(pieces: Array, t: Array) -> tuple[Array, Array]:
    """Cubics and their slopes at t."""
    a, b, c, e = pieces
    return ((a * t + b) * t + c) * t + e, (3 * a * t + 2 * b) * t + c


def _solved(pieces: Array, values: Array, width: float) -> Array:
    """Where ascending cubics (4, n) on [0, width] take values (n,). Those that are found take part in no more steps."""
    solution = np.empty_like(values)
    left = np.arange(len(values))
    low, high = np.zeros_like(values), np.full_like(values, width)
    height = _at(pieces, high)[0] - pieces[3]
    near = np.maximum(NEAR * np.minimum(values, height), ROUNDING * values)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (values - pieces[3]) / pieces[2]
        t = np.where((t > 0) & (t < width), t, width / 2)
        for _ in range(STEPS):
            found, slopes = _at(pieces, t)
            off = found - values
            newton = t - off / slopes
            below = off < 0
            low, high = np.where(below, t, low), np.where(below, high, t)
            within_bracket = (newton > low) & (newton < high)
            going = np.abs(off) > near
            solution[left] = np.where(within_bracket, newton, t)
            if not going.any():
                break
            t = np.where(within_bracket, newton, (low + high) / 2)
            left, t, low, high = left[going], t[going], low[going], high[going]
            near, values, pieces = near[going], values[going], pieces[:, going]
    return solution


class MappedRegion:
    """A region behind a map of its unit box."""

    def __init__(self, region: Region, warp: SeparableMap):
        self.region, self.warp = region, warp

    @property
    def d(self) -> int:
        """Dimension of the unit box."""
        return self.region.d

    @property
    def empty(self) -> bool:
        """Whether the integral is 0 whatever f is."""
        return self.region.empty

    def pull_back(self, v: Array) -> tuple[Array, Array]:
        """Points x (k, n) and the volume element (n,) at v (d, n)."""
        u, inner = self.warp(within(v))
        x, outer = self.region.pull_back(u)
        return x, inner * outer


def refined(warp: SeparableMap, u: Array, masses: Array) -> SeparableMap:
    r"""A better map: along each axis the intervals get equal parts of the damped mass.

    Parameters
    ----------
    warp : SeparableMap
        The map so far.
    u : ndarray, (d, n)
        Samples.
    masses : ndarray, (n,)
        What each stands for of the integral of \|f\|.

    Notes
    -----
    Of all products of densities, that of the marginals of \|f\| has the least Kullback–Leibler divergence from \|f\|.
    D_k is the mass of interval k as the samples estimate it, a part of the sum, and smoothed over three intervals. The
    new ends cut ((1 − D)/log(1/D))^0.6, which Lepage (1978) takes of second moments, into equal parts.
    """
    if not masses.any():
        return warp
    v = warp.inverse(u)
    return SeparableMap(np.stack([_recut(*axis, masses) for axis in zip(warp.nodes, v, strict=True)]))


def _recut(nodes: Array, v: Array, masses: Array) -> Array:
    """The new nodes (k + 1,) of an axis from the masses (n,) of samples at v (n,)."""
    k = len(nodes) - 1
    parts = np.bincount(np.minimum((v * k).astype(int), k - 1), masses, k)
    padded = np.concatenate([parts[:1], parts, parts[-1:]])
    smooth = padded[:-2] + 2 * parts + padded[2:]
    smooth = np.maximum(smooth / smooth.sum(), LEAST)
    damped = ((1 - smooth) / -np.log(smooth)) ** DAMPING
    cut = np.concatenate([[0.0], np.cumsum(damped)])
    at = np.interp(np.linspace(0, cut[-1], k + 1), cut, nodes)
    at[0], at[-1] = 0.0, 1.0
    return at
