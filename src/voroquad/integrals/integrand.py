"""The integrand as the rules see it: real values on the unit box, one row per component."""

from __future__ import annotations

import numpy as np

from .._support.arrays import Array
from .diagnostics import Diagnoses, diagnosis
from .evaluation import Function
from .regions import Region


class Integrand:
    """f on a region, pulled back to the unit box.

    Parameters
    ----------
    function : Function
        Takes points (k, n), returns values (fields, n).
    region : Region
        What is integrated over, as a map from the unit box.
    batch : int, optional
        The most points of a call of the function.
    """

    def __init__(self, function: Function, region: Region, batch: int | None = None):
        self.function, self.region, self._batch = function, region, batch

    @property
    def d(self) -> int:
        """Dimension of the unit box."""
        return self.region.d

    @property
    def empty(self) -> bool:
        """Whether the integral is 0 whatever f is."""
        return self.region.empty

    @property
    def epsilon(self) -> float:
        """Relative rounding error of func's values."""
        return self.function.epsilon

    @property
    def diagnoses(self) -> Diagnoses:
        """The warnings of the call."""
        return self.function.diagnoses

    def pull_back(self, u: Array) -> tuple[Array, Array]:
        """Points x (k, n) and the volume element (n,) at u (d, n)."""
        return self.region.pull_back(u)

    def __call__(self, u: Array) -> Array:
        """Values times the volume element, (fields, n), at points u (n, d) of the unit box; NaN where not finite."""
        n, most = len(u), self._batch or len(u)
        if n <= most:
            return self._values(u)
        return np.concatenate([self._values(u[i : i + most]) for i in range(0, n, most)], axis=1)

    def _values(self, u: Array) -> Array:
        x, volume = self.pull_back(u.T)
        values = self.function(x)
        with np.errstate(over="ignore", invalid="ignore"):
            fields = volume * values
        bad = ~np.isfinite(fields)
        if bad.any():
            at = bad.any(axis=0)
            first = np.asarray(x, dtype=np.float64)[:, np.argmax(at)].tolist()
            self.diagnoses.add(diagnosis("not-finite", first_x=first, points=int(np.count_nonzero(at)), of=len(u)))
            fields[bad] = np.nan
        return fields
