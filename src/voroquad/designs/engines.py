"""Points from the engines of `scipy.stats.qmc`."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

#: Makes an engine from (d, rng); the classes of `scipy.stats.qmc` do.
EngineFactory: TypeAlias = Callable[..., qmc.QMCEngine]
BELOW_ONE = np.nextafter(1.0, 0.0)


def engine_points(engine: qmc.QMCEngine, n: int) -> NDArray[np.float64]:
    """The next n points of a SciPy engine, below 1 (scrambled engines may round up to it)."""
    with warnings.catch_warnings():
        # Balance of a Sobol' set that is no power of two: the caller's choice
        warnings.filterwarnings("ignore", message="The balance properties", category=UserWarning)
        points = np.minimum(engine.random(n), BELOW_ONE)
    if points.shape != (n, engine.d):
        raise ValueError(f"sampler: {type(engine).__name__} made {len(points)} points of the n = {n} asked for")
    return points
