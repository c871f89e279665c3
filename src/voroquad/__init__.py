"""voroquad: random samples into good quadrature.

Each sample is weighted with the piece of the domain it stands for, without bias.

>>> import numpy as np, voroquad as vq
>>> s = vq.sample("stratified", n=256, d=2, rng=7)
>>> w = vq.weights(s)
>>> estimate = w @ np.exp(s.points.sum(axis=1))
"""

from ._support.headers import get_cmake_dir, get_include
from ._support.version import __version__ as __version__
from .designs.sampling import SampleSet, sample
from .geometry.cells import Cells, cells
from .geometry.density_compensation import density_compensation
from .geometry.neighbours import Neighbours
from .geometry.shapes import Polygons, Polyhedra
from .geometry.sphere import sphere_points, sphere_weights
from .geometry.triangulation import Triangulation
from .integrals.diagnostics import IntegrationWarning
from .integrals.measures import PiecewiseUniform, ProductMeasure
from .integrals.quad import quad
from .integrals.result import QuadResult
from .rules.bias import bias_function
from .rules.registry import weights
from .sample_tables import SampleTable

__all__ = [
    "Cells",
    "IntegrationWarning",
    "Neighbours",
    "PiecewiseUniform",
    "Polygons",
    "Polyhedra",
    "ProductMeasure",
    "QuadResult",
    "SampleSet",
    "SampleTable",
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
