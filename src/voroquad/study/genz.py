"""Test integrands on the unit box with known integrals: Genz's six families and two with slanted edges."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Integrand:
    """A function of points (d, n) with its integral over the unit box.

    Calling it gives the values (n,), as :func:`voroquad.quad` wants them.
    """

    family: str
    d: int
    func: Callable[[Array], Array]
    integral: float

    def __call__(self, x: Array) -> Array:
        return self.func(x)


def instances(d: int, count: int, rng: int | np.random.Generator | None = None) -> Iterator[Integrand]:
    """Draw `count` random members of each of the eight families.

    Parameters
    ----------
    d : int
        Dimension, at least 1.
    count : int
        Members per family.
    rng : int, numpy.random.Generator or None
        Seed.

    Yields
    ------
    Integrand
        Family by family, in the order of :data:`FAMILIES`.

    Notes
    -----
    Genz's families have a random place u in the unit box and random rates a > 0 whose sum is a
    difficulty h that does not depend on d: 9, 7.25, 1.85, 7.03, 20.4 and 4.3.

    References
    ----------
    A. Genz, "Testing multidimensional integration routines", in Tools, Methods and Languages for
    Scientific and Engineering Computation, 1984.

    Examples
    --------
    >>> from voroquad.study.genz import instances
    >>> [f.family for f in instances(d=2, count=1, rng=1)]
    ['oscillatory', 'peak', 'corner', 'gaussian', 'kink', 'jump', 'half-plane', 'ball']
    """
    generator = np.random.default_rng(rng)
    for family, draw in FAMILIES.items():
        for _ in range(count):
            func, integral = draw(d, generator)
            yield Integrand(family, d, func, integral)


Drawn = tuple[Callable[[Array], Array], float]


def _rates(d: int, difficulty: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Rates a (d, 1) that sum to the difficulty, and a place u (d, 1)."""
    a = rng.random((d, 1)) + 0.05
    return a * (difficulty * d / 3 / a.sum()), rng.random((d, 1))


def oscillatory(d: int, rng: np.random.Generator) -> Drawn:
    """cos(2π u_1 + a·x)."""
    a, u = _rates(d, 9.0, rng)
    phase = 2 * np.pi * u[0, 0]
    # Re ∫ e^{i(phase + a·x)} = Re e^{i(phase + Σa/2)} Π sin(a/2) / (a/2)
    exact = np.cos(phase + a.sum() / 2) * np.prod(np.sinc(a / (2 * np.pi)))
    return lambda x: np.cos(phase + (a * x).sum(axis=0)), float(exact)


def peak(d: int, rng: np.random.Generator) -> Drawn:
    """Π 1 / (a⁻² + (x − u)²)."""
    a, u = _rates(d, 7.25, rng)
    exact = np.prod(a * (np.arctan(a * (1 - u)) + np.arctan(a * u)))
    return lambda x: np.prod(1 / (a**-2 + (x - u) ** 2), axis=0), float(exact)


def corner(d: int, rng: np.random.Generator) -> Drawn:
    """(1 + a·x)^−(d+1)."""
    a, _ = _rates(d, 1.85, rng)
    # d antiderivatives, at the corners v of the box: Σ (−1)^|v| / (1 + a·v) over d! Π a
    terms = [(-1) ** sum(v) / (1 + np.dot(v, a[:, 0])) for v in itertools.product((0, 1), repeat=d)]
    exact = math.fsum(terms) / (math.factorial(d) * np.prod(a))
    return lambda x: (1 + (a * x).sum(axis=0)) ** -(d + 1.0), float(exact)


def gaussian(d: int, rng: np.random.Generator) -> Drawn:
    """exp(−|a (x − u)|²)."""
    a, u = _rates(d, 7.03, rng)
    exact = np.prod(np.sqrt(np.pi) / (2 * a) * (erf(a * (1 - u)) + erf(a * u)))
    return lambda x: np.exp(-((a * (x - u)) ** 2).sum(axis=0)), float(exact)


def kink(d: int, rng: np.random.Generator) -> Drawn:
    """exp(−a·|x − u|)."""
    a, u = _rates(d, 20.4, rng)
    exact = np.prod((2 - np.exp(-a * u) - np.exp(-a * (1 - u))) / a)
    return lambda x: np.exp(-(a * np.abs(x - u)).sum(axis=0)), float(exact)


def jump(d: int, rng: np.random.Generator) -> Drawn:
    """exp(a·x) where x_1 < u_1 and x_2 < u_2, else 0: edges along the axes."""
    a, u = _rates(d, 4.3, rng)
    u[2:] = 1.0
    exact = np.prod(np.expm1(a * u) / a)
    return lambda x: np.where((x < u).all(axis=0), np.exp((a * x).sum(axis=0)), 0.0), float(exact)


def half_plane(d: int, rng: np.random.Generator) -> Drawn:
    """1 on one side of a slanted hyperplane through a point of [¼, ¾]^d."""
    normal = rng.standard_normal((d, 1))
    normal = np.copysign(np.maximum(np.abs(normal), 0.1), normal)  # the closed form divides by each entry
    normal /= np.linalg.norm(normal)
    level = float((normal * rng.uniform(0.25, 0.75, (d, 1))).sum())
    # Mirror the axes with a negative entry; then Σ (−1)^|v| (level − n·v)₊^d over d! Π n at the corners v
    n, c = np.abs(normal[:, 0]), level - normal[normal < 0].sum()
    terms = [(-1) ** sum(v) * max(0.0, c - np.dot(v, n)) ** d for v in itertools.product((0, 1), repeat=d)]
    exact = math.fsum(terms) / (math.factorial(d) * np.prod(n))
    return lambda x: ((normal * x).sum(axis=0) < level).astype(np.float64), float(exact)


def ball(d: int, rng: np.random.Generator) -> Drawn:
    """1 inside a ball that lies in the box."""
    radius = rng.uniform(0.25, 0.4)
    centre = rng.uniform(radius, 1 - radius, (d, 1))
    exact = np.pi ** (d / 2) / math.gamma(d / 2 + 1) * radius**d
    return lambda x: (((x - centre) ** 2).sum(axis=0) < radius**2).astype(np.float64), float(exact)


#: The families by name.
FAMILIES: dict[str, Callable[[int, np.random.Generator], Drawn]] = {
    "oscillatory": oscillatory,
    "peak": peak,
    "corner": corner,
    "gaussian": gaussian,
    "kink": kink,
    "jump": jump,
    "half-plane": half_plane,
    "ball": ball,
}
