"""Integrands over the unit box with their exact integrals."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np

from .._support.arrays import Array
from .integrand import KnownIntegrand

# ---------------------------------------------------------------------- the talk's test function


def talk_profile(x: Array) -> Array:
    """The test function of Guo and Eisemann's talk, elementwise on [0, 1].

    Two quarter circles (vertical tangents at 0 and ½), a trapezium and three arches of growing
    height. Continuous, non-negative and 0 at both ends.
    """
    rising = np.sqrt(np.maximum(x * (0.5 - x), 0))
    falling = 0.25 - np.sqrt(np.maximum((x - 0.25) * (0.75 - x), 0))
    trapezium = np.clip(np.minimum(20 * (x - 0.5), 20 * (0.7 - x)), 0, 1)
    height = np.where(x <= 0.8, 0.1, np.where(x <= 0.9, 0.25, 0.5))
    arches = height * np.abs(np.sin(10 * np.pi * (x - 0.7)))
    profile = np.select([x <= 0.25, x <= 0.5, x <= 0.7], [rising, falling, trapezium], arches)
    return np.asarray(10 * profile)


#: The quarter circles make (¼)² together, the trapezium 0.15, an arch of height h makes h · 2/(10π).
TALK_INTEGRAL = 10 * (0.25**2 + 0.15 + (0.1 + 0.25 + 0.5) * 2 / (10 * math.pi))


# ---------------------------------------------------------------------- integrals


def gauss_legendre_square(values: Callable[[Array], Array], nodes: int = 64) -> float:
    """∫ f over [0, 1]² by a product Gauss–Legendre rule; exact to rounding for entire f of a few waves."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    grid = np.stack(np.meshgrid((x + 1) / 2, (x + 1) / 2, indexing="ij"), axis=-1)
    return float(w @ values(grid) @ w / 4)


def half_plane_moment(a: float, b: float, c: float, p: int) -> float:
    """∫ over [0, 1]² of max(0, a x + b y − c)^p, a and b not 0; p = 0 is the area of a x + b y > c.

    Integrating u₊^p twice gives u₊^(p+2) / (a b (p+1)(p+2)), a sum over the square's corners.
    """
    corners = itertools.product((0, 1), repeat=2)
    total = sum((-1) ** (x + y) * max(0.0, a * x + b * y - c) ** (p + 2) for x, y in corners)
    return total / (a * b * (p + 1) * (p + 2))


# ---------------------------------------------------------------------- the integrands


def _product(p: Array) -> Array:
    x, y = p[..., 0], p[..., 1]
    return np.exp(x + y / 2) * (1 + np.sin(5 * x * y))


def _fold(p: Array) -> Array:
    return np.abs(p[..., 0] + 0.6 * p[..., 1] - 0.7)


_DISC = (0.35, 0.4, 0.25)  # centre and radius


def _edges(p: Array) -> Array:
    x, y = p[..., 0], p[..., 1]
    in_disc = (x - _DISC[0]) ** 2 + (y - _DISC[1]) ** 2 < _DISC[2] ** 2
    return in_disc + 0.5 * (x + 0.6 * y > 1.1)


INTEGRANDS_1D = (
    KnownIntegrand(
        "talk",
        "Talk's test function",
        "circles, ramps and arches; 0 at both ends",
        1,
        lambda p: talk_profile(p[..., 0]),
        TALK_INTEGRAL,
    ),
    KnownIntegrand("smooth", "Smooth", "exp(x)", 1, lambda p: np.exp(p[..., 0]), math.e - 1),
    KnownIntegrand("kink", "Kink", "|3x − 1|", 1, lambda p: np.abs(3 * p[..., 0] - 1), 5 / 6),
    KnownIntegrand(
        "jump",
        "Jump",
        "exp(−x) + [x < 1/3]",
        1,
        lambda p: np.exp(-p[..., 0]) + (p[..., 0] < 1 / 3),
        1 - math.exp(-1) + 1 / 3,
    ),
)

INTEGRANDS_2D = (
    KnownIntegrand(
        "talk-2d",
        "Talk's, f(x) f(y)",
        "the talk's function of x times that of y",
        2,
        lambda p: talk_profile(p[..., 0]) * talk_profile(p[..., 1]),
        TALK_INTEGRAL**2,
    ),
    KnownIntegrand("smooth-2d", "Smooth", "exp(x + y/2) (1 + sin 5xy)", 2, _product, gauss_legendre_square(_product)),
    KnownIntegrand(
        "kink-2d",
        "Kink",
        "|x + 0.6 y − 0.7|",
        2,
        _fold,
        # |u| = 2 u₊ − u
        2 * half_plane_moment(1, 0.6, 0.7, 1) - (0.5 + 0.3 - 0.7),
    ),
    KnownIntegrand(
        "jump-2d",
        "Jumps",
        "a disc of height 1 and a half-plane of height ½",
        2,
        _edges,
        math.pi * _DISC[2] ** 2 + 0.5 * half_plane_moment(1, 0.6, 1.1, 0),
    ),
)

INTEGRANDS = {f.name: f for f in (*INTEGRANDS_1D, *INTEGRANDS_2D)}
