"""What a test integrand is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .._support.arrays import Array


@dataclass(frozen=True)
class KnownIntegrand:
    """A function over [0, 1]^d and its integral.

    Calling it with points (d, n) gives its values (n,), as :func:`voroquad.quad` and SciPy want them.

    Parameters
    ----------
    name : str
        Short name: file names and CSV columns. Members of a family share it.
    title : str
        Name in figures.
    formula : str
        What it computes, for the reader.
    d : int
        Dimension.
    values : callable, (..., d) -> (...)
        The function, over any batch of points.
    integral : float
        Its integral over the box, to the last digits of float64.
    """

    name: str
    title: str
    formula: str
    d: int
    values: Callable[[Array], Array]
    integral: float

    def __call__(self, x: Array) -> Array:
        """Values (n,) at points (d, n)."""
        return self.values(np.asarray(x).T)
