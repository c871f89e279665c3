"""Means and spreads that add up over blocks of replicates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._support.arrays import Array


@dataclass(frozen=True)
class Moments:
    """Means over replicates of errors and of their squares, and the spread of both.

    Parameters
    ----------
    count : int
        Number of replicates.
    mean : ndarray, (2, ...)
        Means of the errors e and of e².
    spread : ndarray, (2, ...)
        Σ (x − mean)² of both.

    Notes
    -----
    Two blocks join as in Chan, Golub and LeVeque, "Updating formulae and a pairwise algorithm for computing sample
    variances" (1979): no sum of squares cancels.
    """

    count: int
    mean: Array
    spread: Array

    @classmethod
    def of(cls, errors: Array) -> Moments:
        """The moments of errors (..., replicates)."""
        both = np.stack([errors, errors**2])
        mean = both.mean(-1)
        return cls(errors.shape[-1], mean, ((both - mean[..., None]) ** 2).sum(-1))

    def __add__(self, other: Moments) -> Moments:
        count = self.count + other.count
        apart = other.mean - self.mean
        return Moments(
            count,
            self.mean + apart * (other.count / count),
            self.spread + other.spread + apart**2 * (self.count * other.count / count),
        )

    @property
    def standard_error(self) -> Array:
        """Standard errors (2, ...) of the means; it takes two replicates."""
        return np.sqrt(self.spread / (self.count - 1) / self.count)

    def packed(self) -> Array:
        """All moments in one array (3, 2, ...), the value of a unit of work."""
        return np.stack([np.full_like(self.mean, self.count), self.mean, self.spread])

    @classmethod
    def unpacked(cls, array: Array) -> Moments:
        """The moments in an array that :meth:`packed` returned."""
        count, mean, spread = array
        return cls(int(count.flat[0]), mean, spread)


def add_packed(a: Array, b: Array) -> Array:
    """The moments of two blocks together, all of them packed."""
    return (Moments.unpacked(a) + Moments.unpacked(b)).packed()
