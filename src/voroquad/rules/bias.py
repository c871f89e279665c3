"""The bias function G of order-0 weights: E[Σ_i |V_i| f(x_i)] = ∫ G(x) f(x) dx."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._support.arrays import Array
from .._support.checks import one_of, positive_int, unit_points
from ..designs.design import DESIGNS
from ..designs.grids import grid_shape
from . import bias_tables

#: Designs whose G is known: those of independent samples.
BIAS_DESIGNS = tuple(name for name, design in DESIGNS.items() if design.independent)
#: Largest number of points at which G is integrated one by one. For more, a table is cheaper.
FEW = 64
#: A resolution of the quadrature, where there is none: on a line G is known in closed form.
ON_A_LINE = (3, 3)


def bias_function(x: ArrayLike, n: int, design: str = "uniform") -> Array:
    """Bias function G of the Voronoi weights of n samples.

    Parameters
    ----------
    x : array_like, (m,) or (m, d), d = 1, 2 or 3
        Where to evaluate G, in [0, 1]^d.
    n : int
        Number of samples of a set.
    design : {"uniform", "stratified"}
        How the samples are drawn: independent and uniform, or one in each box of a near-cubic grid.

    Returns
    -------
    ndarray, (m,)
        G(x) > 0. G ≡ 1 would mean no bias; ∫ G = 1. Exact to rounding for d = 1. For d = 2 the
        error is below 1e-4 and 1e-5 on average, for d = 3 below 1e-3 and 2e-4 on average.

    Raises
    ------
    ValueError
        x is outside [0, 1]^d, n < 1, the design is unknown, d > 3, or n points have no near-cubic grid.

    Notes
    -----
    A point y belongs to the cell of a sample at x if no other sample lies in the ball
    B(y, \\|y − x\\|). With S_i the stratum of x, for uniform and for stratified samples,

        G(x) = n ∫ (1 − \\|B(y, \\|y−x\\|) ∩ Ω\\|)^(n−1) dy ,
        G(x) = n ∫ Π_{j≠i} (1 − n \\|B(y, \\|y−x\\|) ∩ S_j\\|) dy .

    For uniform samples G = 1 except in a boundary layer a few n^(−1/d) deep. For stratified samples
    G jumps between strata. For d > 1 it varies inside the box too, with the period of the strata.
    In one dimension the integral is (Guo and Eisemann)

        G(x) = [ (n − n x − x) x^(n−1) + (n x + x − 1) (1 − x)^(n−1) + 2 ] / 2

    for uniform samples; for stratified ones it is (n x + 3/2) / 2 in the first stratum, its mirror
    image in the last, and 1 between. For d > 1 the balls are cut by boxes in closed form and the
    integral over y is computed by quadrature: at x itself for few points, else at the nodes of a table.
    Tables are kept in memory and in the user's cache directory (VOROQUAD_CACHE_DIR names it).

    References
    ----------
    J. J. Guo and E. Eisemann, "Geometric Sample Reweighting for Monte Carlo Integration", Computer Graphics Forum
    40(7), 109–119, 2021.

    Examples
    --------
    >>> import voroquad as vq
    >>> vq.bias_function([0.0, 0.25, 0.5], n=3)
    array([0.5   , 1.0625, 1.25  ])
    >>> vq.bias_function([[0.0, 0.0], [0.02, 0.5], [0.5, 0.5]], n=64).round(4)
    array([0.3635, 0.762 , 1.    ])
    """
    points = unit_points(x, closed=True, name="x")
    n = positive_int("n", n)
    one_of("design", design, BIAS_DESIGNS)
    if points.ndim != 2 or points.shape[1] > 3:
        raise ValueError(f"x must have shape (m,) or (m, d) with d at most 3, got {points.shape}")
    d = points.shape[1]
    strata = grid_shape(n, d) if design == "stratified" else None
    if d > 1 and n > 1 and len(points) <= FEW:
        return bias_tables.directly(points, n, strata)
    return bias_at(points, n, strata)


def bias_at(points: Array, n: int, strata: tuple[int, ...] | None) -> Array:
    """G at points (..., d) of [0, 1]^d, in closed form or from a table; strata None: uniform samples."""
    d = points.shape[-1]
    if n == 1:
        return np.ones(points.shape[:-1])
    if d > 1:
        return bias_tables.table(n, d, strata)(points)
    return bias_tables.integrate(points.reshape(-1, 1), n, strata, ON_A_LINE).reshape(points.shape[:-1])
