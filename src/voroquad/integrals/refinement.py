"""Tolerance mode: sets of growing size until the error is small enough."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from .integrand import warn

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Estimate:
    """Mean and standard error of each of the integrand's components, (fields,)."""

    mean: Array
    error: Array
    n: int
    degrees_of_freedom: float

    def times_two_to(self, power: NDArray[np.intc]) -> Estimate:
        """That of the components times 2^power, (fields,)."""
        return replace(self, mean=np.ldexp(self.mean, power), error=np.ldexp(self.error, power))


@dataclass(frozen=True)
class Tolerance:
    """Half the width of the 95 % interval that is small enough: at most max(atol, rtol |I|)."""

    rtol: float
    atol: float

    def excess(self, estimate: Estimate) -> float:
        """Half the interval over what is allowed, of the worst component; infinite where one is not a number."""
        half = float(stats.t.ppf(0.975, estimate.degrees_of_freedom)) * estimate.error
        allowed = np.maximum(self.atol, self.rtol * np.abs(estimate.mean))
        ratio = np.divide(half, allowed, out=np.where(half == 0, 0.0, np.inf), where=allowed > 0)
        return float(np.nan_to_num(ratio, nan=np.inf).max())


def tolerance(rtol: Any, atol: Any) -> Tolerance:
    """The tolerance that the arguments ask for; ValueError where one is no number of at least 0."""
    for name, value in (("rtol", rtol), ("atol", atol)):
        if not isinstance(value, int | float | np.integer | np.floating) or value is True or not 0 <= value < math.inf:
            raise ValueError(f"{name} must be a number of at least 0, got {value!r}")
    if rtol == 0 and atol == 0:
        raise ValueError("rtol and atol are both 0, which no error meets; give one, for example rtol=1e-6")
    return Tolerance(float(rtol), float(atol))


def refine(estimate: Callable[[int], Estimate], wanted: Tolerance, n: int, most: int, dimension: int) -> Estimate:
    """Estimates from independent sets, larger and larger, until one meets the tolerance; then a last one.

    A set that stops the refinement was chosen for what it showed, so its own value would be biased. It
    only settles the size: the value and error returned are those of one more set of that size, which is
    independent of all before, hence unbiased. All are counted in `n` of the result.

    Parameters
    ----------
    estimate : callable
        Takes the largest number of evaluations, draws a fresh set.
    wanted : Tolerance
        What to meet.
    n : int
        Evaluations of the first set.
    most : int
        Evaluations of all sets together.
    dimension : int
        Rough integrands gain N^(−½−1/d) or so; that predicts the next size.
    """
    spent = 0
    while 2 * n <= most - spent:
        trial = estimate(n)
        spent += trial.n
        excess = wanted.excess(trial)
        room = (most - spent) // 2
        # The last set's error may be a little larger. No number of points mends an integral that is not finite
        if excess <= 0.7 or room <= n or not np.isfinite(trial.mean).all():
            break
        growth = float(np.clip((excess / 0.5) ** (1 / (0.5 + 1 / dimension)), 2, 16))
        n = min(math.ceil(n * growth), room)
    last = estimate(min(n, most - spent))
    if not np.isfinite(last.mean).all():
        warn("the integral is not finite, so that no tolerance is met")
    elif (missed := wanted.excess(last)) > 1:
        warn(
            f"the 95 % interval is {missed:.3g} times as wide as the tolerance allows after {spent + last.n} "
            f"evaluations of at most {most}; raise max_evaluations or the tolerance"
        )
    return replace(last, n=spent + last.n)
