"""Covariances of random functions on the box: products over the axes of a correlation of the distance along each."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import erf

from .. import _core
from .._support.arrays import Array


@dataclass(frozen=True)
class Covariance:
    """k(x, y) = Π_a M(|x_a − y_a|), with variance 1.

    Attributes
    ----------
    name : str
        What the core calls it.
    matrix : callable
        From points (n, d), the correlation length and the number of threads to all k, (n, n).
    between : callable
        From points (m, d), points (n, d), the length and the number of threads to all k, (m, n).
    antiderivative : callable
        From t / length to the integral of M from 0 to |t|, divided by the length.
    """

    name: str
    matrix: Callable[[Array, float, int], Array]
    between: Callable[[Array, Array, float, int], Array]
    antiderivative: Callable[[Array], Array]

    def means(self, x: Array, low: Array, high: Array, length: float) -> Array:
        """The means (..., intervals, n) of M(|· − x_j|) over [low_i, high_i], for x (..., 1, n)."""

        def signed(t: Array) -> Array:
            return np.copysign(self.antiderivative(np.abs(t) / length), t) * length

        return (signed(high[:, None] - x) - signed(low[:, None] - x)) / (high - low)[:, None]


def _of_matern7(t: Array) -> Array:
    """Of (1 + s + 2 s²/5 + s³/15) e^−s, s = √7 t: 16/5 − (16/5 + 11/5 s + 3/5 s² + s³/15) e^−s."""
    s = math.sqrt(7) * t
    tail = (16 / 5 + s * (11 / 5 + s * (3 / 5 + s / 15))) * np.exp(-s)
    return (16 / 5 - tail) / math.sqrt(7)


def _of_matern9(t: Array) -> Array:
    """Of (1 + s + 3 s²/7 + 2 s³/21 + s⁴/105) e^−s, s = 3 t.

    It is 128/35 − (128/35 + 93/35 s + 29/35 s² + 2/15 s³ + s⁴/105) e^−s.
    """
    s = 3 * t
    tail = (128 / 35 + s * (93 / 35 + s * (29 / 35 + s * (2 / 15 + s / 105)))) * np.exp(-s)
    return (128 / 35 - tail) / 3


def _of_gaussian(t: Array) -> Array:
    """Of e^(−t²/2)."""
    integral: Array = math.sqrt(math.pi / 2) * erf(t / math.sqrt(2))
    return integral


#: Matérn's of smoothness 7/2: functions with three derivatives.
MATERN_7 = Covariance("matern7", _core.matern7_matrix, _core.matern7_between, _of_matern7)

#: Matérn's of smoothness 9/2: functions with four derivatives.
MATERN_9 = Covariance("matern9", _core.matern9_matrix, _core.matern9_between, _of_matern9)

#: The Gaussian: analytic functions.
GAUSSIAN = Covariance("gaussian", _core.gaussian_matrix, _core.gaussian_between, _of_gaussian)
