"""Straight lines through measurements in a log–log plot."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Numbers whose logarithms are as close as this are one number
_CLOSE = 1e-6


@dataclass(frozen=True)
class PowerLaw:
    """y = e^intercept · x^slope."""

    slope: float
    intercept: float

    def __call__(self, x: ArrayLike) -> NDArray[np.float64]:
        """The y at each x."""
        return np.asarray(np.exp(np.clip(self.intercept + self.slope * np.log(x), -700, 700)))


def fit_power_law(x: ArrayLike, y: ArrayLike) -> PowerLaw | None:
    """Least squares of log y against log x.

    Parameters
    ----------
    x, y : array_like, (n,)
        Measurements. Those that are not positive and finite are left out.

    Returns
    -------
    PowerLaw or None
        None where fewer than two different x are left.

    Examples
    --------
    >>> from voroquad.results.power_law import fit_power_law
    >>> round(fit_power_law([1, 10, 100], [5, 0.5, 0.05]).slope, 12)
    -1.0
    >>> fit_power_law([1, 1], [2, 3]) is None
    True
    """
    points = np.array([x, y], dtype=np.float64)
    used = ((points > 0) & (points < math.inf)).all(axis=0)
    log_x, log_y = np.log(points[:, used])
    if len(log_x) < 2 or np.ptp(log_x) < _CLOSE:
        return None
    slope, intercept = np.polyfit(log_x, log_y, 1)
    return PowerLaw(float(slope), float(intercept))
