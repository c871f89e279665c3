"""Points from the engines of `scipy.stats.qmc`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from .._support.arrays import Array

if TYPE_CHECKING:
    from scipy.stats import qmc

#: Makes an engine from (d, rng); the classes of `scipy.stats.qmc` do.
EngineFactory: TypeAlias = "Callable[..., qmc.QMCEngine]"
BELOW_ONE = np.nextafter(1.0, 0.0)


def engine_points(engine: qmc.QMCEngine, n: int) -> Array:
    """The next n points of a SciPy engine, below 1 (scrambled engines may round up to it)."""
    drawn = [engine.random(count) for count in _draws(engine, n)]
    points = np.minimum(np.concatenate(drawn), BELOW_ONE)
    if points.shape != (n, engine.d):
        raise ValueError(f"sampler: {type(engine).__name__} made {len(points)} points of the n = {n} asked for")
    return points


def _draws(engine: qmc.QMCEngine, n: int) -> list[int]:
    """The numbers of points to draw, one after the other, so that SciPy does not warn.

    It warns where the first draw of a Sobol' engine is no power of two. The number of points is the caller's choice.
    To filter the warning is not safe: the filters belong to the process, and other threads change them too.
    """
    from scipy.stats import qmc

    first = isinstance(engine, qmc.Sobol) and engine.num_generated == 0 and engine.optimization_method is None
    power = 1 << (n.bit_length() - 1)
    return [power, n - power] if first and power < n else [n]


def design_name(engine: qmc.QMCEngine) -> str:
    """The name of the design of an engine's points, by which rules find its properties.

    Of SciPy's own engines that is known. The points of others are taken to be uniform in the unit box, and those of
    engines with different generators to be independent; their name is "engine".

    Examples
    --------
    >>> from scipy.stats import qmc
    >>> from voroquad.designs.engines import design_name
    >>> [design_name(e) for e in (qmc.Sobol(2), qmc.Sobol(2, scramble=False), qmc.PoissonDisk(2))]
    ['sobol', 'sobol (scramble=False)', 'poissondisk']
    """
    kind = type(engine)
    name = kind.__name__.lower() if kind.__module__.startswith("scipy.") else "engine"
    if not getattr(engine, "scramble", True):
        return f"{name} (scramble=False)"
    if getattr(engine, "optimization_method", None) is not None:
        return f"{name} (optimization)"  # which moves points, or selects sets
    return name


def on_a_lattice(points: Array) -> bool:
    """Whether the points of sets (sets, n, d) lie at the same coordinates in two sets, so that none is uniform."""
    first, second = points[0], points[1]
    return any(np.isin(x, y).mean() > 0.5 for x, y in zip(first.T, second.T, strict=True))
