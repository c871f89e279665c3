"""Sums over values that come in batches, from which their mean and its error follow at any time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._support.arrays import Array
from .units import powers


@dataclass(frozen=True)
class BatchSums:
    """Of n values of each component, (fields,), in units of 2^power.

    ``scatter`` is Σ (f − mean)², ``absolute`` Σ|f| and ``square`` Σ f².
    """

    n: int
    power: NDArray[np.intc]
    mean: Array
    scatter: Array
    absolute: Array
    square: Array

    @classmethod
    def of(cls, values: Array) -> BatchSums:
        """Those of values (fields, n)."""
        power = powers(values, axis=1)
        values = np.ldexp(values, -power)
        mean = values.mean(axis=1)
        scatter = np.square(values - mean[:, None]).sum(axis=1)
        absolute, square = np.abs(values).sum(axis=1), np.square(values).sum(axis=1)
        return cls(values.shape[1], power[:, 0], mean, scatter, absolute, square)

    def __add__(self, other: BatchSums) -> BatchSums:
        """Those of the values of both, joined as in Chan, Golub and LeVeque (1979)."""
        power = np.where(self.absolute > 0, self.power, other.power)
        power = np.where(other.absolute > 0, np.maximum(power, other.power), power)
        one, two, n = self._in_units(power), other._in_units(power), self.n + other.n
        apart = two.mean - one.mean
        return BatchSums(
            n,
            power,
            one.mean + apart * (other.n / n),
            one.scatter + two.scatter + np.square(apart) * (self.n * other.n / n),
            one.absolute + two.absolute,
            one.square + two.square,
        )

    def _in_units(self, power: NDArray[np.intc]) -> BatchSums:
        """The same in units of 2^power."""
        by = self.power - power
        mean, absolute = np.ldexp(self.mean, by), np.ldexp(self.absolute, by)
        return BatchSums(self.n, power, mean, np.ldexp(self.scatter, 2 * by), absolute, np.ldexp(self.square, 2 * by))
