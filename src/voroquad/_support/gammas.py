"""Quotients of the gamma function in hundreds of dimensions, where it overflows itself."""

from __future__ import annotations

import math


def power_of_pi_over_gamma(x: float, a: float) -> float:
    """π^x / Γ(a), by logarithms where Γ(a) overflows."""
    try:
        return math.pi**x / math.gamma(a)
    except OverflowError:
        return math.exp(x * math.log(math.pi) - math.lgamma(a))


def beta_with_half(a: float) -> float:
    """B(a, ½) = √π Γ(a) / Γ(a + ½), by logarithms where Γ overflows."""
    try:
        return math.sqrt(math.pi) * math.gamma(a) / math.gamma(a + 0.5)
    except OverflowError:
        return math.sqrt(math.pi) * math.exp(math.lgamma(a) - math.lgamma(a + 0.5))
