"""Tables of the bias function: G by quadrature at Chebyshev nodes, made once and kept."""

from __future__ import annotations

import itertools
import math
import zipfile
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import NDArray

from .. import _core
from .._support.arrays import Array, Indices
from .._support.cache import cache_directory, is_own
from .._support.checks import thread_count
from .._support.files import atomic_path

#: Part of every file name; to be increased when values, nodes or layout change.
_FORMAT = 3
#: Most nodes across and along a panel, by dimension, where G is integrated point by point, without a table.
ONE_BY_ONE = {2: (24, 20), 3: (12, 12)}
_POINTS_AT_A_TIME = 4096  # when interpolating


class Axis(Protocol):
    """One axis of a table, in panels. A panel stands for all parts of [0, 1] on which G is the same."""

    @property
    def panels(self) -> int:
        """Number of panels."""
        ...

    def locate(self, x: Array) -> tuple[Indices, Array]:
        """The panels (m,) of coordinates (m,), and the positions in them, in [−1, 1]."""
        ...

    def position(self, panel: Indices, u: Array) -> Array:
        """A coordinate in [0, 1] whose position in the panel is u."""
        ...

    def integrals(self, size: int) -> Array:
        """∫ over [0, 1] of each panel's Chebyshev polynomials, (panels, size)."""
        ...


@dataclass(frozen=True)
class BoundaryLayer:
    """Axis for uniform sets: G depends on the distance from the border, and is constant beyond a depth."""

    depth: float

    @property
    def panels(self) -> int:
        return 1

    def locate(self, x: Array) -> tuple[Indices, Array]:
        distance = np.minimum(np.minimum(x, 1 - x), self.depth)
        return np.zeros(x.shape, np.intp), 2 * distance / self.depth - 1

    def position(self, panel: Indices, u: Array) -> Array:
        return self.depth * (u + 1) / 2

    def integrals(self, size: int) -> Array:
        beyond = 1 - 2 * self.depth  # there every polynomial has its value at u = 1, which is 1
        return (2 * self.depth * _chebyshev_means(size) + beyond)[None]


@dataclass(frozen=True)
class Strata:
    """Axis for stratified sets: one panel for the strata at each distance from the border, the last for all beyond.

    There are `k` strata. G is computed on a smaller grid, of `proxy` strata along this axis, in which it is the same.
    """

    k: int
    proxy: int
    panels: int

    def locate(self, x: Array) -> tuple[Indices, Array]:
        stratum = np.minimum((x * self.k).astype(np.intp), self.k - 1)
        u = 2 * (x * self.k - stratum) - 1
        kind, mirrored = kind_of_stratum(stratum, self.k, self.panels)
        return kind, np.where(mirrored, -u, u)

    def position(self, panel: Indices, u: Array) -> Array:
        innermost = (self.proxy - 1) // 2
        symmetric = (panel == self.panels - 1) & (self.k != 2 * self.panels)
        stratum = np.where(symmetric, innermost, panel)
        return (stratum + (1 + np.where(symmetric, -np.abs(u), u)) / 2) / self.proxy

    def integrals(self, size: int) -> Array:
        kind, _ = kind_of_stratum(np.arange(self.k), self.k, self.panels)
        counts = np.bincount(kind, minlength=self.panels)
        return counts[:, None] / self.k * _chebyshev_means(size)


def _chebyshev_means(size: int) -> Array:
    """½ ∫ T_q over [−1, 1] for q = 0 … size − 1: 1/(1 − q²) for even q, 0 for odd."""
    q = np.arange(size)
    return np.where(q % 2, 0.0, 1 / np.where(q % 2, 1.0, 1.0 - q**2))


@dataclass(frozen=True)
class Plan:
    """How to compute a table: its axes, the nodes per panel and the quadrature at each node."""

    name: str
    axes: tuple[Axis, ...]
    nodes: int
    resolution: tuple[int, int]
    n: int
    strata: tuple[int, ...] | None  # the grid that the quadrature sees; None: uniform samples

    @property
    def shape(self) -> tuple[int, ...]:
        return (*(axis.panels for axis in self.axes), *(self.nodes,) * len(self.axes))

    def points(self) -> tuple[Array, Indices]:
        """The distinct points (m, d) to evaluate, and for each entry of the table which one it is.

        Coordinates are sorted among equal axes, since G does not change when they are swapped.
        """
        d = len(self.axes)
        indices = np.indices(self.shape).reshape(2 * d, -1)
        u = np.cos(np.pi * (np.arange(self.nodes) + 0.5) / self.nodes)
        x = np.stack([axis.position(indices[a], u[indices[d + a]]) for a, axis in enumerate(self.axes)], axis=1)
        for alike in {tuple(b for b in range(d) if self.axes[b] == axis) for axis in self.axes}:
            x[:, alike] = np.sort(x[:, alike], axis=1)
        _, first, which = np.unique(x.round(12), axis=0, return_index=True, return_inverse=True)
        return np.ascontiguousarray(x[first]), which.ravel()

    def coefficients(self) -> Array:
        """Chebyshev coefficients of G on every tuple of panels."""
        d = len(self.axes)
        x, which = self.points()
        values = integrate(x, self.n, self.strata, self.resolution)[which].reshape(self.shape)
        u = np.cos(np.pi * (np.arange(self.nodes) + 0.5) / self.nodes)
        inverse = np.linalg.inv(chebvander(u, self.nodes - 1))
        for a in range(d, 2 * d):
            values = np.moveaxis(np.tensordot(inverse, values, (1, a)), 0, a)
        return np.ascontiguousarray(values)  # as in a file: the order in memory is that of sums


def layer_depth(n: int, d: int) -> float:
    """How far from the border the bias of n independent samples reaches.

    Deeper, G is 1 to 1e-5: a ball that touches the border is large enough to hold a sample almost
    surely. For d = 1 the probability falls as exp(−n x) only.
    """
    return min(0.5, {1: 20.0, 2: 5.0, 3: 3.0}[d] * n ** (-1 / d))


def kinds_of_strata(k: int, strata: tuple[int, ...]) -> int:
    """Number of kinds of strata along an axis of k: those at different distances from the border have different G.

    Empty balls are at most two strata wide, so all strata farther than that from the border are of one kind.
    """
    inner = math.ceil(2 * k / min(strata) - 0.5)
    return min((k + 1) // 2, inner + 1)


def kind_of_stratum(stratum: Indices, k: int, kinds: int) -> tuple[Indices, NDArray[np.bool_]]:
    """The kinds of strata, of k along an axis, and whether they are mirror images of the first stratum of their kind.

    The kind is the distance from the nearer border in strata; the last kind has all that are as far or farther.

    Examples
    --------
    >>> import numpy as np
    >>> from voroquad.rules.bias_tables import kind_of_stratum
    >>> kind, mirrored = kind_of_stratum(np.arange(6), 6, 2)
    >>> kind, mirrored.astype(int)
    (array([0, 1, 1, 1, 1, 0]), array([0, 0, 0, 1, 1, 1]))
    """
    from_the_other_border = k - 1 - stratum
    return np.minimum(np.minimum(stratum, from_the_other_border), kinds - 1), stratum > from_the_other_border


def uniform_plan(n: int, d: int) -> Plan:
    """Plan for n independent uniform samples. One corner of the boundary layer is enough."""
    spacing = n ** (-1 / d)
    depth = layer_depth(n, d)
    nodes = round(12 + 2.4 * depth / spacing) if d == 2 else round(5 + 3.6 * depth / spacing)
    few = n < 125  # then a ball may touch all sides at once
    resolution = (12, 16) if d == 2 else (8, 10) if few else (7, 8)
    return Plan(f"uniform-{d}d-{n}", (BoundaryLayer(depth),) * d, nodes, resolution, n, None)


def stratified_plan(strata: tuple[int, ...]) -> Plan:
    """Plan for one sample per stratum: one polynomial for each kind of stratum.

    G jumps between strata and is periodic inside the box. All cubic grids with strata far from the border share
    one table.
    """
    d = len(strata)
    cubic = len(set(strata)) == 1
    proxy = tuple(min(k, 7) for k in strata) if cubic else strata
    nodes, resolution = (12, (12, 12)) if d == 2 else (6, (6, 6))
    axes = tuple(Strata(k, p, kinds_of_strata(k, strata)) for k, p in zip(strata, proxy, strict=True))
    return Plan("stratified-" + "x".join(map(str, proxy)), axes, nodes, resolution, math.prod(proxy), proxy)


def table_plan(n: int, d: int, strata: tuple[int, ...] | None) -> Plan:
    """Plan for n samples in d = 2 or 3: one per stratum or, without strata, independent."""
    return uniform_plan(n, d) if strata is None else stratified_plan(strata)


def directly(x: Array, n: int, strata: tuple[int, ...] | None) -> Array:
    """G at points (m, d) by quadrature at each, to 1e-5 or better."""
    d = x.shape[1]
    return integrate(x, n, strata, (10, 8) if strata and d == 3 else ONE_BY_ONE[d])


def integrate(x: Array, n: int, strata: tuple[int, ...] | None, resolution: tuple[int, int]) -> Array:
    """G at points (m, d) by quadrature with at most `resolution` nodes across and along a panel.

    On a line, d = 1, G is known in closed form and the resolution has no meaning.
    """
    threads = thread_count(None)
    x = np.ascontiguousarray(x)
    if strata is None:
        return _core.bias_uniform(x, n, resolution, threads)
    return _core.bias_stratified(x, strata, resolution, threads)


class BiasTable:
    """G at any point, from Chebyshev coefficients, scaled so that ∫ G = 1 exactly."""

    def __init__(self, axes: tuple[Axis, ...], coefficients: Array):
        self._axes = axes
        self._nodes = coefficients.shape[-1]
        #: ∫ G before scaling; its difference from 1 is the error of the quadrature.
        self.raw_integral = self._integral(coefficients)
        self._coefficients = coefficients / self.raw_integral

    def __call__(self, x: Array) -> Array:
        """G at points (..., d)."""
        points = x.reshape(-1, len(self._axes))
        values = np.empty(len(points))
        for begin in range(0, len(points), _POINTS_AT_A_TIME):
            block = slice(begin, begin + _POINTS_AT_A_TIME)
            values[block] = self._interpolate(points[block])
        return values.reshape(x.shape[:-1])

    def _interpolate(self, x: Array) -> Array:
        panels, places = zip(*(axis.locate(x[:, a]) for a, axis in enumerate(self._axes)), strict=True)
        polynomials = [chebvander(u, self._nodes - 1) for u in places]
        values = np.empty(len(x))
        for cell in itertools.product(*(range(axis.panels) for axis in self._axes)):
            here = np.logical_and.reduce([panel == c for panel, c in zip(panels, cell, strict=True)])
            if here.any():
                values[here] = _contract(self._coefficients[cell], [p[here] for p in polynomials])
        return values

    def _integral(self, coefficients: Array) -> float:
        total = coefficients
        d = len(self._axes)
        for axis in reversed(self._axes):  # the last panel and the last polynomial index each time
            total = np.tensordot(total, axis.integrals(self._nodes), ((d - 1, total.ndim - 1), (0, 1)))
            d -= 1
        return float(total)


def _contract(coefficients: Array, polynomials: list[Array]) -> Array:
    """Σ c[q_1, …, q_d] T_{q_1} … T_{q_d} for rows (m, q) of polynomials."""
    # Sums in one order, not BLAS: there the last bits of a row depend on the rows beside it
    first, matrix = polynomials[0], coefficients.reshape(len(coefficients), -1)
    values = np.einsum("mq,qr->mr", first, matrix)
    for p in polynomials[1:]:
        values = np.einsum("mq,mqr->mr", p, values.reshape(len(p), p.shape[1], -1))
    return values[:, 0]


@lru_cache(maxsize=64)
def table(n: int, d: int, strata: tuple[int, ...] | None) -> BiasTable:
    """The table of :func:`table_plan`, from memory, from disk or made."""
    plan = table_plan(n, d, strata)
    return BiasTable(plan.axes, stored_coefficients(plan))


# ---------------------------------------------------------------------- on disk


def stored_coefficients(plan: Plan) -> Array:
    """The plan's coefficients from its file; where there is none, or a damaged one, it is made.

    Files are renamed into place whole, so that processes may read and write at once. A directory
    that cannot be written costs the next process its time, nothing else.
    """
    path = cache_directory() / f"bias-v{_FORMAT}" / f"{plan.name}.npz"
    stored = _read(path, plan)
    if stored is not None:
        return stored
    coefficients = plan.coefficients()
    try:
        with atomic_path(path) as temporary:
            np.savez(temporary, coefficients=coefficients, recipe=repr(plan))
    except OSError:
        pass
    return coefficients


def _read(path: Path, plan: Plan) -> Array | None:
    """The coefficients in a file of this user that holds what the plan makes; else None."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:  # the archive has a checksum
            coefficients, recipe = arrays["coefficients"], arrays["recipe"].item()
            trusted = is_own(file) and recipe == repr(plan)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    if not trusted or coefficients.shape != plan.shape or coefficients.dtype != np.float64:
        return None
    # ∫ G = 1 but for the error of the quadrature, which is below 1e-3 in all tables
    return coefficients if abs(BiasTable(plan.axes, coefficients).raw_integral - 1) < 0.01 else None
