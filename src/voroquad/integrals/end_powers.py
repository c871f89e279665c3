"""Powers at faces of the box, such as 1/√x at x = 0, as a look at few values shows them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._support.arrays import Array

#: Least exponent p of x^−p that calls for a map, and the part of the variance of log|f| about polynomials that powers
#: leave at most. Of most smooth functions they leave more; benchmarks/smooth_cost.py counts the others.
LEAST_POWER, LEFT = 0.25, 0.1

#: Highest power of a coordinate in the polynomials; they have all products of two coordinates, too.
DEGREE = 4

#: Least part of the values that are not 0, and fewest values more than coefficients.
PART_KNOWN, FEWEST_BEYOND = 0.9, 8


def has_end_powers(u: Array, values: Array) -> NDArray[np.bool_]:
    r"""Whether values (fields, n) at points u (d, n) of the unit box grow as powers at its faces: (fields,).

    Notes
    -----
    If f = g Π_a x_a^−p_a (1 − x_a)^−q_a with a smooth g, then log\|f\| is smooth but for −p_a log x_a − q_a log(1 −
    x_a). Least squares with these terms and without tell the exponents, and whether they explain what polynomials do
    not. Only coordinates along the axes count, since only for these a map of each axis is a cure.

    Examples
    --------
    >>> import numpy as np
    >>> from voroquad.integrals.end_powers import has_end_powers
    >>> u = np.random.default_rng(1).random((4, 128))
    >>> has_end_powers(u, np.stack([u[0] ** -0.4 * np.exp(u[1] * u[2]), np.exp(u.sum(axis=0))])).tolist()
    [True, False]
    """
    return np.array([_of_one(u, row) for row in values])


def _of_one(u: Array, values: Array) -> bool:
    known = np.isfinite(values) & (values != 0)
    u, sizes = u[:, known], np.log(np.abs(values[known]))
    polynomials, logs = _polynomials(2 * u - 1), np.concatenate([np.log(u), np.log1p(-u)])
    beyond = len(sizes) - len(polynomials) - len(logs)
    if known.mean() < PART_KNOWN or beyond < FEWEST_BEYOND:
        return False
    without, _ = _fitted(polynomials, sizes)
    left, coefficients = _fitted(np.concatenate([polynomials, logs]), sizes)
    steepest = -coefficients[len(polynomials) :].min()
    return bool(steepest > LEAST_POWER and left < LEFT * without)


def _polynomials(t: Array) -> Array:
    """Their terms (terms, n) at t (d, n): 1, powers of each coordinate, and products of two."""
    d, n = t.shape
    i, j = np.tril_indices(d, -1)
    return np.concatenate([np.ones((1, n)), *(t**k for k in range(1, DEGREE + 1)), t[i] * t[j]])


def _fitted(terms: Array, values: Array) -> tuple[float, Array]:
    """The variance (values (n,) about their least-squares fit) and the coefficients of terms (terms, n)."""
    coefficients: Array = np.asarray(np.linalg.lstsq(terms.T, values, rcond=None)[0], dtype=np.float64)
    rest = values - coefficients @ terms
    return float(rest @ rest) / (len(values) - len(terms)), coefficients
