"""The bias function G of order-0 weights: E[Σ_i |V_i| f(x_i)] = ∫ G(x) f(x) dx."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._checks import one_of, positive_int, unit_points

BIAS_DESIGNS = ("uniform",)


def bias_function(x: ArrayLike, n: int, design: str = "uniform") -> NDArray[np.float64]:
    """Bias function G of the Voronoi weights of n samples.

    Parameters
    ----------
    x : array_like, (m,) or (m, d), d = 1
        Where to evaluate G, in [0, 1]^d.
    n : int
        Number of samples of a set.
    design : {"uniform"}
        How the samples are drawn.

    Returns
    -------
    ndarray, (m,)
        G(x) > 0. G ≡ 1 would mean no bias; ∫ G = 1.

    Raises
    ------
    ValueError
        x outside [0, 1]^d, n < 1, an unknown design, d > 1.

    Notes
    -----
    In one dimension (Guo and Eisemann)

        G(x) = [ (n − n x − x) x^(n−1) + (n x + x − 1) (1 − x)^(n−1) + 2 ] / 2,

    symmetric about ½, ½ at the ends, and different from 1 only within a few 1/n of them.

    References
    ----------
    J. Guo and E. Eisemann, "Geometrical Sample Reweighting for Monte Carlo Integration".

    Examples
    --------
    >>> import voroquad as vq
    >>> vq.bias_function([0.0, 0.25, 0.5], n=3)
    array([0.5   , 1.0625, 1.25  ])
    """
    points = unit_points(x, closed=True, name="x")
    n = positive_int("n", n)
    one_of("design", design, BIAS_DESIGNS)
    if points.ndim != 2 or points.shape[1] != 1:
        raise ValueError(f"the bias function is known for d = 1, got x of shape {points.shape}")
    return uniform_interval(points[:, 0], n)


def uniform_interval(x: NDArray[np.float64], n: int) -> NDArray[np.float64]:
    """G of n independent uniform samples of [0, 1], elementwise.

    The powers are taken as exp((n−1) log): exact at the ends (log 0 = −∞ gives the power 0) and
    accurate to a few units in the last place of 1 for any n.
    """
    if n == 1:
        return np.ones_like(x)
    with np.errstate(divide="ignore"):
        below = np.exp((n - 1) * np.log(x))  # x^(n−1)
        above = np.exp((n - 1) * np.log1p(-x))  # (1 − x)^(n−1)
    return ((n * (1 - x) - x) * below + (n * x - (1 - x)) * above + 2) / 2
