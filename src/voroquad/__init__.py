"""voroquad: random samples into good quadrature.

Each sample is weighted with the piece of the domain it stands for, without bias.

>>> import numpy as np, voroquad as vq
>>> s = vq.sample("stratified", n=256, d=2, rng=7)
>>> w = vq.weights(s)
>>> estimate = w @ np.exp(s.points.sum(axis=1))
"""

from .bias import bias_function
from .cells import Cells, cells
from .density_compensation import density_compensation
from .integrand import IntegrationWarning
from .measures import PiecewiseUniform, ProductMeasure
from .quadrature import QuadResult, quad
from .samplers import SampleSet, sample
from .sphere import sphere_points, sphere_weights
from .tables import SampleTable
from .weights import weights

__version__ = "0.1.0"
__all__ = [
    "Cells",
    "IntegrationWarning",
    "PiecewiseUniform",
    "ProductMeasure",
    "QuadResult",
    "SampleSet",
    "SampleTable",
    "bias_function",
    "cells",
    "density_compensation",
    "quad",
    "sample",
    "sphere_points",
    "sphere_weights",
    "weights",
]
