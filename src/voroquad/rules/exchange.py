"""Unbiased weights of order 0. Each function maps points (sets, n, d) to weights (sets, n)."""

from __future__ import annotations

import numpy as np

from .. import _core
from .._support.arrays import Array
from .bias import bias_at


def by_bias_function(points: Array, measures: Array, strata: tuple[int, ...] | None) -> Array:
    """|V_i| / G(x_i), uniform or stratified sets (Guo and Eisemann's Î_GR, in any dimension up to 3)."""
    return measures / bias_at(points, points.shape[-2], strata)


def exchange_uniform(points: Array, threads: int) -> Array:
    """Exchange weights of independent uniform samples of [0, 1] (docs/theory.md, (8)).

    The second sample from each end gives half of its inner spacing to the first. All other Voronoi weights on a line
    are unbiased. Formula and proof: include/voroquad/exchange.hpp.
    """
    return _core.exchange_uniform(np.ascontiguousarray(points[..., 0]), threads)


def exchange_stratified(points: Array, threads: int) -> Array:
    """Exchange weights of one sample per interval [(i−1)/n, i/n), in ascending order (docs/theory.md, (9)).

    Each weight is independent of its own sample and has mean 1/n, hence no bias.
    """
    return _core.exchange_stratified(np.ascontiguousarray(points[..., 0]), threads)
