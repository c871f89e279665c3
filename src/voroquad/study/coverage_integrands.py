"""Integrands with exact integrals for what an error bar finds hard: ends, peaks, edges, waves, infinite ranges."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial, reduce

import numpy as np
from scipy.special import erf, gamma

from .._support.arrays import Array

Function = Callable[[Array], Array]


@dataclass(frozen=True)
class Case:
    """A function over a box, infinite where its limits are, and its integral.

    Calling it with points (d, n) gives its values (n,), or (components, n).
    """

    kind: str
    formula: str
    values: Function
    integral: Array
    lower: Array
    upper: Array
    calibrated: bool

    @property
    def name(self) -> str:
        """Kind and formula."""
        return f"{self.kind}: {self.formula}"

    def __call__(self, x: Array) -> Array:
        """Values at points (d, n)."""
        return self.values(np.asarray(x))


@dataclass(frozen=True)
class _Factor:
    """A function of one variable, with its integral from `lower` to `upper`."""

    formula: str
    values: Function
    integral: float
    lower: float = 0.0
    upper: float = 1.0


_ONE = _Factor("1", np.ones_like, 1.0)


def _power(p: float) -> _Factor:
    return _Factor(f"x^{p:g}", lambda x: x**p, 1 / (1 + p))


def _bell(width: float, centre: float) -> _Factor:
    s = math.sqrt(2) * width
    integral = width * math.sqrt(math.pi / 2) * float(erf((1 - centre) / s) + erf(centre / s))
    return _Factor(f"bell of width {width:g} at {centre:g}", lambda x: np.exp(-(((x - centre) / s) ** 2)), integral)


def _lorentz(width: float, centre: float) -> _Factor:
    integral = width * (math.atan((1 - centre) / width) + math.atan(centre / width))
    return _Factor(
        f"Lorentz curve of width {width:g} at {centre:g}", lambda x: 1 / (1 + ((x - centre) / width) ** 2), integral
    )


def _step(at: float) -> _Factor:
    return _Factor(f"1 where x < {at:g}", lambda x: np.where(x < at, 1.0, 0.0), at)


def _wave(rate: float, phase: float) -> _Factor:
    integral = (math.sin(rate + phase) - math.sin(phase)) / rate
    return _Factor(f"cos({rate:g} x + {phase:g})", lambda x: np.cos(rate * x + phase), integral)


def _kink(at: float, p: float = 1.0) -> _Factor:
    integral = (at ** (p + 1) + (1 - at) ** (p + 1)) / (p + 1)
    return _Factor(f"|x − {at:g}|^{p:g}", lambda x: abs(x - at) ** p, integral)


def _decay(rate: float, at: float) -> _Factor:
    integral = (2 - math.exp(-rate * at) - math.exp(-rate * (1 - at))) / rate
    return _Factor(f"exp(−{rate:g} |x − {at:g}|)", lambda x: np.exp(-rate * abs(x - at)), integral)


_HEAVY = math.sqrt(math.pi) * float(gamma(0.75) / gamma(1.25))

#: Factors by kind; True: the error bar's constants were chosen while it was looked at.
_FACTORS: dict[str, tuple[tuple[_Factor, bool], ...]] = {
    "end": (
        (_power(0.5), True), (_power(0.3), True), (_power(-0.4), True), (_power(1.5), True),
        (_Factor("−log x", lambda x: -np.log(x), 1.0), True),
        (_Factor("log x / √x", lambda x: np.log(x) / np.sqrt(x), -4.0), True),
        (_Factor("√(1 − x²)", lambda x: np.sqrt(1 - x * x), math.pi / 4), True),
        (_power(0.7), False), (_power(2.5), False), (_power(-0.25), False),
        (_Factor("√x log x", lambda x: np.sqrt(x) * np.log(x), -4 / 9), False),
        (_Factor("√(x (1 − x))", lambda x: np.sqrt(x * (1 - x)), math.pi / 8), True),
        (_Factor("(1 − x)^-0.35", lambda x: (1 - x) ** -0.35, 1 / 0.65), False),
    ),
    "singularity inside": (
        (_kink(0.31, -0.3), False),
        (_Factor("−log|x − ½|", lambda x: -np.log(abs(x - 0.5)), 1 + math.log(2)), False),
        (_kink(0.43, 0.5), False),
    ),
    "peak": (
        (_bell(0.2, 0.4), False), (_bell(0.1, 0.55), False), (_bell(0.05, 0.4), True), (_bell(0.02, 0.63), False),
        (_bell(0.01, 0.4), True), (_lorentz(0.1, 0.35), False), (_lorentz(0.01, 0.7), False),
    ),
    "kink": (
        (_kink(0.37), True), (_kink(0.61, 1.5), False),
        (_Factor("max(0, x − 0.7)", lambda x: np.maximum(0, x - 0.7), 0.045), False),
        (_decay(20, 0.45), False),
    ),
    "step": (
        (_step(0.37), True), (_step(0.83), False),
        (_Factor("1 where 0.41 < x < 0.53", lambda x: np.where(abs(x - 0.47) < 0.06, 1.0, 0.0), 0.12), False),
        (_Factor("exp(x) where x < 0.71", lambda x: np.where(x < 0.71, np.exp(x), 0.0), math.expm1(0.71)), False),
    ),
    "wave": (
        (_wave(7, 1), False), (_wave(30, 0.5), False), (_wave(200, 2), False), (_wave(7777.7, 1), True),
        (_wave(3333.3, 0.7), False),
    ),
    "smooth": (
        (_Factor("exp(x)", np.exp, math.e - 1), True),
        (_power(20.0), True), (_power(5.0), False),
        (_Factor("1/(1 + x)", lambda x: 1 / (1 + x), math.log(2)), False),
        (_Factor("1/(1 + 25 (x − ½)²)", lambda x: 1 / (1 + 25 * (x - 0.5) ** 2), 2 / 5 * math.atan(2.5)), False),
        (_Factor("x exp(−3x)", lambda x: x * np.exp(-3 * x), (1 - 4 * math.exp(-3)) / 9), False),
    ),
    "infinite range": (
        (_Factor("x^-1.5", lambda x: x**-1.5, 2.0, 1, math.inf), True),
        (_Factor("(1 + x²)^-1.25", lambda x: (1 + x * x) ** -1.25, _HEAVY, -math.inf, math.inf), True),
        (_Factor("exp(−x²/2)", lambda x: np.exp(-x * x / 2), math.sqrt(2 * math.pi), -math.inf, math.inf), False),
        (_Factor("exp(−x)", lambda x: np.exp(-x), 1.0, 0, math.inf), False),
        (_Factor("x^-3", lambda x: x**-3, 0.5, 1, math.inf), False),
        (_Factor("1/(1 + x²)²", lambda x: (1 + x * x) ** -2, math.pi / 2, -math.inf, math.inf), False),
        (_Factor("x² exp(−x²)", lambda x: x * x * np.exp(-x * x), math.sqrt(math.pi) / 2, -math.inf, math.inf), False),
    ),
}  # fmt: skip


def cases(d: int) -> list[Case]:
    """All integrands of d dimensions: each factor along the first axis, as products, and those that are no products."""
    found = [
        _product(kind, [factor, *[_ONE] * (d - 1)], used) for kind, few in _FACTORS.items() for factor, used in few
    ]
    if d == 1:
        return [*found, _vector(d)]
    alike = [_product(kind, [factor] * d, used) for kind, factor, used in _alike()]
    return [*found, *alike, *_oblique(d), _vector(d)]


def _alike() -> Iterator[tuple[str, _Factor, bool]]:
    """Factors whose product over all axes is an integrand of its own."""
    for kind, number in (("end", 1), ("end", 4), ("end", 9), ("peak", 0), ("peak", 1), ("peak", 3), ("peak", 5)):
        factor, used = _FACTORS[kind][number]
        yield kind, factor, used
    for kind, number in (
        ("kink", 0),
        ("kink", 3),
        ("step", 1),
        ("smooth", 0),
        ("infinite range", 1),
        ("infinite range", 2),
    ):
        factor, used = _FACTORS[kind][number]
        yield kind, factor, used


def _product(kind: str, factors: Sequence[_Factor], calibrated: bool) -> Case:
    """Π g_a(x_a)."""
    alike = all(factor is factors[0] for factor in factors) and len(factors) > 1
    formula = f"product over the axes of {factors[0].formula}" if alike else factors[0].formula
    return Case(
        kind,
        formula,
        partial(_values_of_product, factors),
        np.array(math.prod(factor.integral for factor in factors)),
        np.array([factor.lower for factor in factors]),
        np.array([factor.upper for factor in factors]),
        calibrated,
    )


def _values_of_product(factors: Sequence[_Factor], x: Array) -> Array:
    return reduce(np.multiply, (factor.values(along) for factor, along in zip(factors, x, strict=True)))


def _oblique(d: int) -> Iterator[Case]:
    """Edges, kinks, waves and decays along n·x with n = (1, 2, … d) / d."""
    n = np.arange(1, d + 1) / d
    whole = float(n.sum())

    def case(kind: str, formula: str, g: Function, integral: float) -> Case:
        return Case(kind, formula, lambda x: g(n @ x), np.array(integral), np.zeros(d), np.ones(d), False)

    for share in (0.4, 0.7):
        step = _step(share * whole)
        yield case("step", f"1 where n·x < {share * whole:g}", step.values, _half_space(n, share * whole, 0))
    c = 0.55 * whole
    both = _half_space(n, c, 1) + _half_space(n, whole - c, 1)
    yield case("kink", f"|n·x − {c:g}|", lambda t: abs(t - c), both)
    yield case("kink", f"max(0, {c:g} − n·x)²", lambda t: np.maximum(0, c - t) ** 2, _half_space(n, c, 2))
    for rate in (5.0, 40.0, 900.0):
        product = reduce(np.multiply, [(np.exp(1j * rate * a) - 1) / (1j * rate * a) for a in n]) * np.exp(1j)
        yield case("wave", f"cos({rate:g} n·x + 1)", _wave(rate, 1).values, float(product.real))
    decay = math.prod(-math.expm1(-3 * a) / (3 * a) for a in n)
    yield case("smooth", "exp(−3 n·x)", lambda t: np.exp(-3 * t), decay)
    terms = [(-1) ** sum(v) / (1 + np.dot(v, n)) for v in itertools.product((0, 1), repeat=d)]
    corner = math.fsum(terms) / (math.factorial(d) * float(np.prod(n)))
    yield case("smooth", "(1 + n·x)^−(d + 1)", lambda t: (1 + t) ** -(d + 1.0), corner)


def _half_space(n: Array, c: float, p: int) -> float:
    """∫ max(0, c − n·x)^p over the unit box, where p = 0 stands for 1 where n·x < c.

    With the corners v of the box it is Σ_v (−1)^|v| max(0, c − n·v)^(d+p) p! / ((d+p)! Π n).
    """
    d = len(n)
    terms = [(-1) ** sum(v) * max(0.0, c - float(np.dot(v, n))) ** (d + p) for v in itertools.product((0, 1), repeat=d)]
    return math.fsum(terms) * math.factorial(p) / (math.factorial(d + p) * float(np.prod(n)))


def _vector(d: int) -> Case:
    """Three components that ask for different rules."""

    def values(x: Array) -> Array:
        return np.stack([np.exp(x[0]), np.sqrt(x[-1]), np.where(x[0] < 0.29, 1.0, 0.0)])

    integral = np.array([math.e - 1, 2 / 3, 0.29])
    return Case("vector", "exp(x), √y, 1 where x < 0.29", values, integral, np.zeros(d), np.ones(d), False)
