"""Voronoi weights without bias and with Σ w = 1: leave-one-out of order 0 (docs/theory.md, (14) to (16))."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache, reduce

import numpy as np
from scipy.linalg import block_diag

from .. import _core
from .._support.arrays import Array, Integers
from . import bias_tables
from .bias import bias_at


def boundary_control(points: Array, measures: Array, strata: tuple[int, ...] | None, threads: int) -> Array:
    """Weights (..., n) of uniform or, with `strata`, stratified points (..., n, d) from their cell measures.

    With f̂^(−i)(y) the value of the sample nearest to y among all but i, and Ω_i the stratum of
    sample i or, for n independent samples, the box with the factor 1/n,

        Î = Σ_i |V_i| f_i − Σ_i [ (G(x_i) − 1)(f_i − f̂^(−i)(x_i)) / n + ∫_{Ω_i} (G − 1) f̂^(−i) ] .

    The two terms with f̂^(−i) cancel on average, since f̂^(−i) does not depend on x_i. The term with f_i
    removes the bias ∫ (G − 1) f of the cells. The integral is computed by a fixed quadrature, whose error is far
    below the standard deviation of an estimate.
    """
    n, d = points.shape[-2:]
    if n == 1:
        return np.ones(points.shape[:-1])
    lattice = bias_lattice(n, d, strata)
    weights = _core.boundary_control(
        points.reshape(-1, n, d),
        measures.reshape(-1, n),
        (bias_at(points, n, strata) - 1).reshape(-1, n),
        [axis.position for axis in lattice.axes],
        [axis.weight for axis in lattice.axes],
        [axis.node_class for axis in lattice.axes],
        lattice.excess,
        strata or (),
        threads,
    )
    return weights.reshape(measures.shape)


@dataclass(frozen=True)
class LatticeAxis:
    """A quadrature of [0, 1]. Nodes at which G is the same form a class.

    `onto` (classes, m) maps values at the coordinates `seen_at` (m,) to one value per class, which multiplies the
    weights of its nodes. `nowhere`, if not negative, is the class of nodes without bias, far from the border.
    """

    position: Array
    weight: Array
    node_class: Integers
    seen_at: Array
    onto: Array
    nowhere: int = -1

    def class_weights(self) -> Array:
        """Length of the part of [0, 1] that each class stands for."""
        total = np.bincount(self.node_class, weights=self.weight, minlength=len(self.onto))
        return total.astype(np.float64)


@dataclass(frozen=True)
class BiasLattice:
    """A product quadrature of (G − 1) m over the box, with factors by class on each axis.

    It is exact for every m that is linear along each axis of every panel.
    """

    axes: tuple[LatticeAxis, ...]
    excess: Array


@lru_cache(maxsize=16)
def bias_lattice(n: int, d: int, strata: tuple[int, ...] | None) -> BiasLattice:
    """The quadrature of G − 1 for n samples, its mean subtracted: ∫ (G − 1) = 0."""
    axes = (uniform_axis(n, d),) * d if strata is None else tuple(stratum_axis(k, strata) for k in strata)
    seen_at = np.stack(np.meshgrid(*(axis.seen_at for axis in axes), indexing="ij"), axis=-1)
    excess = bias_at(seen_at, n, strata) - 1
    for a, axis in enumerate(axes):
        excess = np.moveaxis(np.tensordot(axis.onto, excess, (1, a)), 0, a)
    if axes[0].nowhere >= 0:
        excess[tuple(axis.nowhere for axis in axes)] = 0.0

    weights = reduce(np.multiply.outer, (axis.class_weights() for axis in axes))
    somewhere = excess != 0
    if somewhere.any():
        excess[somewhere] -= (weights * excess).sum() / weights[somewhere].sum()
    return BiasLattice(axes, np.ascontiguousarray(excess))


#: Panels of two nodes per sample spacing along an axis, by d. More panels change the mean of an estimate by less
#: than 0.03 of its standard deviation.
UNIFORM_PANELS = {1: 4, 2: 2, 3: 1}
STRATA_PANELS = {1: 1, 2: 2, 3: 2}


def uniform_axis(n: int, d: int) -> LatticeAxis:
    """Nodes of one axis for n independent samples: two boundary layers and the part between them."""
    spacing = n ** (-1 / d)
    depth = bias_tables.layer_depth(n, d)
    near = Panels(0.0, depth, math.ceil(UNIFORM_PANELS[d] * depth / spacing))
    between = Panels(depth, 1 - depth, math.ceil(UNIFORM_PANELS[d] * (1 - 2 * depth) / spacing))
    layer, nowhere = np.arange(len(near.nodes)), len(near.nodes)
    return LatticeAxis(
        np.concatenate([near.nodes, between.nodes, 1 - near.nodes]),
        np.concatenate([near.weights, between.weights, near.weights]),
        np.concatenate([layer, np.full(len(between.nodes), nowhere), layer]),
        np.append(near.fine, 0.5),
        block_diag(near.onto, np.ones((1, 1))),
        nowhere,
    )


def stratum_axis(k: int, strata: tuple[int, ...]) -> LatticeAxis:
    """Nodes of an axis of k strata. Strata of one kind share classes."""
    inside = Panels(0.0, 1.0, STRATA_PANELS[len(strata)])
    q = len(inside.nodes)
    stratum = np.arange(k)[:, None]
    kinds = bias_tables.kinds_of_strata(k, strata)
    kind, mirrored = bias_tables.kind_of_stratum(stratum, k, kinds)
    place = np.where(mirrored, q - 1 - np.arange(q), np.arange(q))
    return LatticeAxis(
        ((stratum + inside.nodes) / k).ravel(),
        np.tile(inside.weights / k, k),
        (kind * q + place).ravel(),
        ((np.arange(kinds)[:, None] + inside.fine) / k).ravel(),
        np.asarray(np.kron(np.eye(kinds), inside.onto), np.float64),
    )


class Panels:
    """`count` equal panels of [begin, end], each with a Gauss rule of two points and one of five.

    ``nodes`` and ``weights`` (2 count,) are the rule of two points. G is evaluated at the points ``fine`` (5 count,),
    and projected onto the two nodes, so that its product with linear functions is integrated as by the rule of five.
    """

    def __init__(self, begin: float, end: float, count: int):
        half = (end - begin) / (2 * max(count, 1))
        middles = begin + half * (2 * np.arange(count)[:, None] + 1)
        self.nodes: Array = (middles + half * _gauss(2)[0]).ravel()
        self.weights: Array = np.full(2 * count, half)
        self.fine: Array = (middles + half * _gauss(5)[0]).ravel()

    @property
    def onto(self) -> Array:
        """The matrix from values at the fine points to values at the nodes."""
        points, weights = _gauss(5)
        hats = (1 + 3 * np.outer(_gauss(2)[0], points)) / 2  # linear, 1 at one node and 0 at the other
        return np.asarray(np.kron(np.eye(len(self.nodes) // 2), hats * weights), np.float64)


def _gauss(n: int) -> tuple[Array, Array]:
    x, w = np.polynomial.legendre.leggauss(n)
    return x.astype(np.float64), w.astype(np.float64)
