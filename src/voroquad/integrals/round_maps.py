"""Maps of the unit box onto balls and spheres."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import betaincinv

from .._support.arrays import Array
from .._support.gammas import beta_with_half


def ball_of_cube(t: Array) -> tuple[Array, Array]:
    """Points x (d, n) of the unit ball and det ∂x/∂t (n,) at t (d, n) of the cube [−1, 1]^d, d ≤ 3.

    With a_i = ∫_0^1 Π_{j≠i} (1 − s t_j²) ds and x_i = t_i √a_i, ∂x_i/∂t_j is t_i t_j b_ij / √a_i, where b_ij is the
    derivative of a_i by t_j².
    """
    square = t * t
    if len(t) == 1:
        a, determinant = np.ones_like(t), np.ones(t.shape[1])
    elif len(t) == 2:
        a, determinant = 1 - square[::-1] / 2, 1 - square.sum(axis=0) / 2
    else:
        p, q = square[[1, 2, 0]], square[[2, 0, 1]]
        a, b = 1 - (p + q) / 2 + p * q / 3, square / 3 - 1 / 2  # b_jk in the place of the third axis, i
        determinant = a.prod(axis=0) + 2 * (square * b).prod(axis=0) - (a * p * q * b * b).sum(axis=0)
    roots = np.sqrt(a)
    return t * roots, determinant / roots.prod(axis=0)


def directions(u: Array, uniform: bool) -> tuple[Array, Array]:
    """Unit vectors (d, n) by d − 1 angles at u (d − 1, n), and the area element (n,) of the unit sphere.

    The angle θ_i has the density sin^k θ_i, k = d − 1 − i. Its quantiles are those of a beta distribution of
    (1 − cos θ)/2 with both parameters (k + 1)/2.
    """
    d = len(u) + 1
    x, sines, element = np.empty((d, u.shape[1])), np.ones(u.shape[1]), np.full(u.shape[1], 2 * math.pi)
    for i in range(d - 2):
        k = d - 2 - i
        if uniform:
            angle = np.arccos(1 - 2 * betaincinv((k + 1) / 2, (k + 1) / 2, u[i]))
            element *= beta_with_half((k + 1) / 2)
        else:
            angle = math.pi * u[i]
            element *= math.pi * np.sin(angle) ** k
        x[i] = sines * np.cos(angle)
        sines = sines * np.sin(angle)
    x[-2], x[-1] = sines * np.cos(2 * math.pi * u[-1]), sines * np.sin(2 * math.pi * u[-1])
    return x, element
