"""Polynomials from values at the nodes of a Gauss–Legendre grid of the unit box."""

from __future__ import annotations

from functools import lru_cache, reduce

import numpy as np
from numpy.typing import NDArray

from .._support.arrays import Array, Indices
from .._support.blas import one_blas_thread
from .polynomials import legendre, powers_up_to

#: Lowest dimension: below, the pilot rule has a grid of its own.
LOWEST_DIMENSION = 4

#: Fewest nodes along an axis with which a grid is worth its evaluations, and the most nodes in all: with more, terms of
#: higher degree would cost more than they are worth.
FEWEST_NODES, MOST_NODES = 6, 1 << 15

#: Part of the evaluations that a grid takes at most.
SHARE = 1 / 4


def nodes_of_an_axis(n: int, d: int) -> int:
    """Nodes along each axis of the grid for n evaluations in all; 0 where there is no grid.

    The number is even: an odd one would make the centre of the box a node, where many integrands have a pole or a kink.

    Examples
    --------
    >>> from voroquad.rules.gauss_grid import nodes_of_an_axis
    >>> [nodes_of_an_axis(n, 4) for n in (1024, 16_384, 10**6)]
    [0, 8, 12]
    """
    side = 2 * int((min(SHARE * n, MOST_NODES) ** (1 / d) + 1e-9) / 2)
    return side if d >= LOWEST_DIMENSION and side >= FEWEST_NODES else 0


def grid_points(side: int, d: int, begin: int, end: int) -> Array:
    """Nodes `begin` to `end` of side^d in C order, (end − begin, d)."""
    nodes, _ = _rule(side)
    at = np.unravel_index(np.arange(begin, end), (side,) * d)
    return np.stack([nodes[i] for i in at], axis=1)


@lru_cache(maxsize=16)
def term_powers(d: int, degree: int) -> Indices:
    """Degrees (terms, d) along the axes of the terms of ``_core.LegendreTerms(d, degree)``, in its order.

    Examples
    --------
    >>> from voroquad.rules.gauss_grid import term_powers
    >>> term_powers(2, 2).tolist()
    [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [2, 0]]
    """
    stems = powers_up_to(degree, d - 1)
    runs = degree + 1 - stems.sum(axis=1)
    last = np.concatenate([np.arange(run) for run in runs])
    return np.column_stack([np.repeat(stems, runs, axis=0), last])


@one_blas_thread
def grid_coefficients(values: Array, side: int, d: int, degree: int) -> tuple[Array, Array]:
    r"""Polynomials of total degree p from values (fields, side^d) at the nodes.

    Returns
    -------
    coefficients : ndarray, (fields, terms)
        In the order of ``_core.LegendreTerms``.
    left : ndarray, (fields,)
        Mean squared residual at the nodes, with the weights of the rule.

    Notes
    -----
    The products of orthonormal Legendre polynomials of degree below `side` along each axis are orthonormal under the
    Gauss rule as well, so least squares with its weights w are the sums Σ w f L. What is left is the sum of the squares
    of all other coefficients. Terms of degree `side` and more along an axis are 0.
    """
    nodes, weights = _rule(side)
    onto = (legendre(2 * nodes - 1, side - 1) * weights[:, None]).T
    tensor = values.reshape(len(values), *(side,) * d)
    for axis in range(1, d + 1):
        tensor = np.moveaxis(np.tensordot(onto, tensor, (1, axis)), 0, axis)
    powers = term_powers(d, degree)
    known = (powers < side).all(axis=1)
    coefficients = np.zeros((len(values), len(powers)))
    coefficients[:, known] = tensor[:, *powers[known].T]
    return coefficients, np.square(tensor[:, _beyond(side, d, degree)]).sum(axis=1)


@lru_cache(maxsize=16)
def _beyond(side: int, d: int, degree: int) -> NDArray[np.bool_]:
    """Which products of degree below `side` along each axis (side, …) have a higher total degree."""
    total: Indices = reduce(np.add.outer, [np.arange(side)] * d)
    return total > degree


@lru_cache(maxsize=64)
def _rule(side: int) -> tuple[Array, Array]:
    """Nodes and weights (side,) of Gauss and Legendre on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(side)
    return (nodes + 1) / 2, weights / 2
