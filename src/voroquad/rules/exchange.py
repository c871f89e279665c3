"""Unbiased weights of order 0. Each function maps points (sets, n, d) to weights (sets, n)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .bias import bias_at


def by_bias_function(
    points: NDArray[np.float64], measures: NDArray[np.float64], strata: tuple[int, ...] | None
) -> NDArray[np.float64]:
    """|V_i| / G(x_i), uniform or stratified sets (Guo and Eisemann's Î_GR, in any dimension up to 3)."""
    return measures / bias_at(points, points.shape[-2], strata)


def exchange_uniform(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Exchange weights of independent uniform samples of [0, 1] (docs/theory.md, (8)).

    With the spacings D_0 = x_1, D_i = x_{i+1} − x_i, D_n = 1 − x_n of the sorted samples, write
    w_i = Σ_j A_ij D_j. Given x_(i) = x, the mean of D_j is x/i for j < i and (1−x)/(n−i+1) from i on,
    so the rule is unbiased if and only if  Σ_{j<i} A_ij + Σ_{j>i} A_{i+1,j} = 1  for i = 0 … n.
    Voronoi weights violate this at the two ends only. There the second sample gives half of its
    inner spacing to the first.
    """
    n = points.shape[-2]
    order = np.argsort(points[..., 0], axis=-1, kind="stable")
    x = np.take_along_axis(points[..., 0], order, axis=-1)
    gaps = np.diff(x, axis=-1, prepend=0.0, append=1.0)  # D_0 … D_n

    if n == 1:
        w = np.ones_like(x)
    elif n == 2:
        w = np.full_like(x, 0.5)
    else:
        w = (gaps[..., :-1] + gaps[..., 1:]) / 2
        w[..., 0] = gaps[..., 0] + (gaps[..., 1] + gaps[..., 2]) / 2
        w[..., -1] = gaps[..., -1] + (gaps[..., -2] + gaps[..., -3]) / 2
        w[..., 1] = gaps[..., 1] / 2
        w[..., -2] = gaps[..., -2] / 2
        if n == 3:  # the middle sample is second from both ends, and gives both halves
            w[..., 1] = 0.0
    return _back_in_order(w, order)


def exchange_stratified(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Exchange weights of one sample per interval [(i−1)/n, i/n) (docs/theory.md, (9)).

    Let v_i = n x_i − (i−1) − ½, in [−½, ½) with mean zero. Sample j moves the weight v_j/2 from its right to its left
    neighbour, as Voronoi cells do, and leaves its own unchanged. The first and the last sample move v between their two
    nearest neighbours. Each weight is independent of its own sample and has mean 1/n, hence no bias.
    """
    n = points.shape[-2]
    w = np.ones(points.shape[:-1])
    if n >= 5:
        v = n * points[..., 0] - np.arange(n) - 0.5
        w[..., :-2] += v[..., 1:-1] / 2
        w[..., 2:] -= v[..., 1:-1] / 2
        w[..., 1] += v[..., 0]
        w[..., 2] -= v[..., 0]
        w[..., -3] += v[..., -1]
        w[..., -2] -= v[..., -1]
    return w / n


def _back_in_order(sorted_values: NDArray[np.float64], order: NDArray[np.intp]) -> NDArray[np.float64]:
    values = np.empty_like(sorted_values)
    np.put_along_axis(values, order, sorted_values, axis=-1)
    return values
