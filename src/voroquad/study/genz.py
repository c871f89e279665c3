"""Families of test integrands on the unit box: Genz's six and two with edges that follow no axis."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator

import numpy as np
from scipy.special import erf

from .._support.arrays import Array
from .integrand import KnownIntegrand


def instances(d: int, count: int, rng: int | list[int] | np.random.Generator | None = None) -> Iterator[KnownIntegrand]:
    """Draw `count` random members of each of the eight families.

    Parameters
    ----------
    d : int
        Dimension, at least 1.
    count : int
        Members per family.
    rng : int, list of int, numpy.random.Generator or None
        Seed.

    Yields
    ------
    KnownIntegrand
        Family by family, in the order of :data:`FAMILIES`.

    Notes
    -----
    Genz's families have a random place u in the unit box and random rates a > 0 whose mean is a third
    of a difficulty h that does not depend on d: 9, 7.25, 1.85, 7.03, 20.4 and 4.3.

    References
    ----------
    A. Genz, "Testing multidimensional integration routines", in Tools, Methods and Languages for
    Scientific and Engineering Computation, 1984.

    Examples
    --------
    >>> from voroquad.study.genz import instances
    >>> [f.name for f in instances(d=2, count=1, rng=1)]
    ['oscillatory', 'peak', 'corner', 'gaussian', 'kink', 'jump', 'half-plane', 'ball']
    """
    generator = np.random.default_rng(rng)
    for draw in FAMILIES.values():
        for _ in range(count):
            yield draw(d, generator)


def _rates(d: int, difficulty: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Rates a (d,) whose mean is a third of the difficulty, and a place u (d,)."""
    a = rng.random(d) + 0.05
    return a * (difficulty * d / 3 / a.sum()), rng.random(d)


def oscillatory(d: int, rng: np.random.Generator) -> KnownIntegrand:
    """A wave in a random direction."""
    a, u = _rates(d, 9.0, rng)
    phase = 2 * np.pi * u[0]
    # Re ∫ e^{i(phase + a·x)} = Re e^{i(phase + Σa/2)} Π sin(a/2) / (a/2)
    exact = float(np.cos(phase + a.sum() / 2) * np.prod(np.sinc(a / (2 * np.pi))))
    return KnownIntegrand("oscillatory", "Oscillatory", "cos(2π u_1 + a·x)", d, lambda x: np.cos(phase + x @ a), exact)


def peak(d: int, rng: np.random.Generator) -> KnownIntegrand:
    """A product of Lorentz curves."""
    a, u = _rates(d, 7.25, rng)
    exact = float(np.prod(a * (np.arctan(a * (1 - u)) + np.arctan(a * u))))
    return KnownIntegrand(
        "peak", "Peak", "Π 1 / (a⁻² + (x − u)²)", d, lambda x: np.prod(1 / (a**-2 + (x - u) ** 2), axis=-1), exact
    )


def corner(d: int, rng: np.random.Generator) -> KnownIntegrand:
    """Large in one corner."""
    a, _ = _rates(d, 1.85, rng)
    # d antiderivatives, at the corners v of the box: Σ (−1)^|v| / (1 + a·v) over d! Π a
    terms = [(-1) ** sum(v) / (1 + np.dot(v, a)) for v in itertools.product((0, 1), repeat=d)]
    exact = math.fsum(terms) / (math.factorial(d) * float(np.prod(a)))
    return KnownIntegrand("corner", "Corner", "(1 + a·x)^−(d+1)", d, lambda x: (1 + x @ a) ** -(d + 1.0), exact)


def gaussian(d: int, rng: np.random.Generator) -> KnownIntegrand:
    """A bell."""
    a, u = _rates(d, 7.03, rng)
    exact = float(np.prod(np.sqrt(np.pi) / (2 * a) * (erf(a * (1 - u)) + erf(a * u))))
    return KnownIntegrand(
        "gaussian", "Gaussian", "exp(−|a (x − u)|²)", d, lambda x: np.exp(-((a * (x - u)) ** 2).sum(axis=-1)), exact
    )


def kink(d: int, rng: np.random.Generator) -> KnownIntegrand:
    """A ridge along the axes through u."""
    a, u = _rates(d, 20.4, rng)
    exact = float(np.prod((2 - np.exp(-a * u) - np.exp(-a * (1 - u))) / a))
    return KnownIntegrand(
        "kink", "Kink", "exp(−a·|x − u|)", d, lambda x: np.exp(-(a * np.abs(x - u)).sum(axis=-1)), exact
    )


def jump(d: int, rng: np.random.Generator) -> KnownIntegrand:
    """Edges along the axes."""
    a, u = _rates(d, 4.3, rng)
    u[2:] = 1.0
    exact = float(np.prod(np.expm1(a * u) / a))
    return KnownIntegrand(
        "jump",
        "Jump",
        "exp(a·x) where x_1 < u_1 and x_2 < u_2, else 0",
        d,
        lambda x: np.where((x < u).all(axis=-1), np.exp(x @ a), 0.0),
        exact,
    )


def half_plane(d: int, rng: np.random.Generator) -> KnownIntegrand:
    """1 on one side of a slanted hyperplane through a point of [¼, ¾]^d."""
    normal = rng.standard_normal(d)
    normal = np.copysign(np.maximum(np.abs(normal), 0.1), normal)  # the closed form divides by each entry
    normal /= np.linalg.norm(normal)
    level = float(normal @ rng.uniform(0.25, 0.75, d))
    # Mirror the axes with a negative entry; then Σ (−1)^|v| (level − n·v)₊^d over d! Π n at the corners v
    n, c = np.abs(normal), level - normal[normal < 0].sum()
    terms = [(-1) ** sum(v) * max(0.0, c - np.dot(v, n)) ** d for v in itertools.product((0, 1), repeat=d)]
    exact = math.fsum(terms) / (math.factorial(d) * float(np.prod(n)))
    return KnownIntegrand(
        "half-plane",
        "Half-plane",
        "1 where n·x < c, else 0",
        d,
        lambda x: np.where(x @ normal < level, 1.0, 0.0),
        exact,
    )


def ball(d: int, rng: np.random.Generator) -> KnownIntegrand:
    """1 inside a ball that lies in the box."""
    radius = rng.uniform(0.25, 0.4)
    centre = rng.uniform(radius, 1 - radius, d)
    exact = np.pi ** (d / 2) / math.gamma(d / 2 + 1) * radius**d
    return KnownIntegrand(
        "ball",
        "Ball",
        "1 where |x − c| < r, else 0",
        d,
        lambda x: np.where(((x - centre) ** 2).sum(axis=-1) < radius**2, 1.0, 0.0),
        exact,
    )


#: How to draw a member of a family, by its name.
FAMILIES: dict[str, Callable[[int, np.random.Generator], KnownIntegrand]] = {
    "oscillatory": oscillatory,
    "peak": peak,
    "corner": corner,
    "gaussian": gaussian,
    "kink": kink,
    "jump": jump,
    "half-plane": half_plane,
    "ball": ball,
}
