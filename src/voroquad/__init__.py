"""voroquad: random samples into accurate quadrature.

Each sample is weighted with the piece of the domain it stands for, without bias.

>>> import numpy as np, voroquad as vq
>>> s = vq.sample("stratified", n=256, d=2, rng=7)
>>> w = vq.weights(s)
>>> estimate = w @ np.exp(s.points.sum(axis=1))
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from ._support.version import __version__ as __version__

if TYPE_CHECKING:
    from ._support.headers import get_cmake_dir, get_include
    from .designs.sampling import SampleSet, sample
    from .geometry.cells import cells
    from .geometry.density_compensation import density_compensation
    from .geometry.diagram import Cells
    from .geometry.neighbours import Neighbours
    from .geometry.shapes import Polygons, Polyhedra
    from .geometry.sphere import sphere_points, sphere_weights
    from .geometry.triangulation import Triangulation
    from .integrals.diagnostics import IntegrationWarning
    from .integrals.domains import Ball, PolarBall, Polygon, Polytope, Simplex, SphereSurface, Triangle
    from .integrals.measures import PiecewiseUniform, ProductMeasure
    from .integrals.progress import IntegrationInterrupted, Progress
    from .integrals.quad import quad
    from .integrals.result import QuadResult
    from .rules.bias import bias_function
    from .rules.registry import weights
    from .sample_tables import SampleTable

__all__ = [
    "Ball",
    "Cells",
    "IntegrationInterrupted",
    "IntegrationWarning",
    "Neighbours",
    "PiecewiseUniform",
    "PolarBall",
    "Polygon",
    "Polygons",
    "Polyhedra",
    "Polytope",
    "ProductMeasure",
    "Progress",
    "QuadResult",
    "SampleSet",
    "SampleTable",
    "Simplex",
    "SphereSurface",
    "Triangle",
    "Triangulation",
    "bias_function",
    "cells",
    "density_compensation",
    "get_cmake_dir",
    "get_include",
    "quad",
    "sample",
    "sphere_points",
    "sphere_weights",
    "weights",
]

#: Where each public name stands. A module is imported when one of its names is first used: SciPy alone takes a second.
_HOMES = {
    "Ball": ".integrals.domains",
    "Cells": ".geometry.diagram",
    "IntegrationInterrupted": ".integrals.progress",
    "IntegrationWarning": ".integrals.diagnostics",
    "Neighbours": ".geometry.neighbours",
    "PiecewiseUniform": ".integrals.measures",
    "PolarBall": ".integrals.domains",
    "Polygon": ".integrals.domains",
    "Polygons": ".geometry.shapes",
    "Polyhedra": ".geometry.shapes",
    "Polytope": ".integrals.domains",
    "ProductMeasure": ".integrals.measures",
    "Progress": ".integrals.progress",
    "QuadResult": ".integrals.result",
    "SampleSet": ".designs.sampling",
    "SampleTable": ".sample_tables",
    "Simplex": ".integrals.domains",
    "SphereSurface": ".integrals.domains",
    "Triangle": ".integrals.domains",
    "Triangulation": ".geometry.triangulation",
    "bias_function": ".rules.bias",
    "cells": ".geometry.cells",
    "density_compensation": ".geometry.density_compensation",
    "get_cmake_dir": "._support.headers",
    "get_include": "._support.headers",
    "quad": ".integrals.quad",
    "sample": ".designs.sampling",
    "sphere_points": ".geometry.sphere",
    "sphere_weights": ".geometry.sphere",
    "weights": ".rules.registry",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(importlib.import_module(_HOMES[name], __name__), name)
    return value


def __dir__() -> list[str]:
    return sorted(globals() | _HOMES)
