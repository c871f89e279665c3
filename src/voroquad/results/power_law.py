"""Straight lines through measurements in a log–log plot."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._support.arrays import Array

#: Least ratio of the largest x to the smallest: over less, noise of y or of x makes the slope
LEAST_SPAN = 2.0


@dataclass(frozen=True)
class PowerLaw:
    """y = e^intercept · x^slope.

    Attributes
    ----------
    slope, intercept : float
        Of the straight line through (log x, log y).
    slope_error : float
        Standard error of the slope, from those of the y; 0 where none were given.
    """

    slope: float
    intercept: float
    slope_error: float = 0.0

    def __call__(self, x: ArrayLike) -> Array:
        """The y at each x."""
        return np.asarray(np.exp(np.clip(self.intercept + self.slope * np.log(x), -700, 700)))


def fit_power_law(x: ArrayLike, y: ArrayLike, y_error: ArrayLike | None = None) -> PowerLaw | None:
    """Least squares of log y against log x.

    Parameters
    ----------
    x, y : array_like, (n,)
        Measurements. Those that are not positive and finite are left out.
    y_error : array_like, (n,), optional
        Independent standard errors of y, small beside y.

    Returns
    -------
    PowerLaw or None
        None where the x that are left span less than a factor of `LEAST_SPAN`.

    Notes
    -----
    With l = log x less its mean, the slope is Σ c_k log y_k, c = l / Σ l²: its variance is Σ c_k² (σ_k / y_k)².

    Examples
    --------
    >>> from voroquad.results.power_law import fit_power_law
    >>> round(fit_power_law([1, 10, 100], [5, 0.5, 0.05]).slope, 12)
    -1.0
    >>> fit_power_law([1, 1.5], [2, 3]) is None
    True
    """
    points = np.array([x, y, np.zeros_like(y, dtype=np.float64) if y_error is None else y_error], dtype=np.float64)
    used = ((points[:2] > 0) & (points[:2] < math.inf)).all(axis=0)
    log_x, log_y = np.log(points[:2, used])
    if len(log_x) < 2 or np.ptp(log_x) < math.log(LEAST_SPAN) * (1 - 1e-12):
        return None
    centred = log_x - log_x.mean()
    c = centred / (centred @ centred)
    slope = float(c @ log_y)
    relative = points[2, used] / points[1, used]
    return PowerLaw(slope, float(log_y.mean() - slope * log_x.mean()), float(np.sqrt(c**2 @ relative**2)))
