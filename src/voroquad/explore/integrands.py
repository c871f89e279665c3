"""The integrands: those of the study, or a typed formula."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cubature

from .._support.arrays import Array
from ..designs.sampling import sample
from ..integrals.expression import compile_expression
from ..study.functions import INTEGRANDS_1D, INTEGRANDS_2D
from ..study.integrand import KnownIntegrand

PRESETS: dict[int, tuple[KnownIntegrand, ...]] = {1: INTEGRANDS_1D, 2: INTEGRANDS_2D}
#: The first integrand shown in each dimension.
FIRST = {1: "talk", 2: "smooth-2d"}
#: Name of every integrand that is a typed formula.
TYPED = "formula"
#: Points of the unit box at which a typed formula must be finite.
_CHECKED = 4096
#: About a twentieth of a second for each formula; the error estimate shows how accurate the result is.
_SUBDIVISIONS = 100
#: An integral whose error is a larger part of the mean of |f| is refused.
_DOUBTFUL = 0.05


@dataclass(frozen=True)
class Problem:
    """An integrand and the accuracy of its integral.

    Parameters
    ----------
    integrand : KnownIntegrand
        The function over [0, 1]^d.
    uncertainty : float
        Estimated error of ``integrand.integral``; 0 where it is a closed form.
    """

    integrand: KnownIntegrand
    uncertainty: float = 0.0

    @property
    def typed(self) -> bool:
        """Whether it is a typed formula: ``integrand.formula`` is then the text."""
        return self.integrand.name == TYPED


def preset(name: str, d: int) -> Problem:
    """The study's integrand of that name."""
    return Problem(next(f for f in PRESETS[d] if f.name == name))


def typed(text: str, d: int) -> Problem:
    """The integrand of a formula, with its integral by adaptive cubature.

    Parameters
    ----------
    text : str
        What :func:`voroquad.integrals.expression.compile_expression` reads, in x (and y).
    d : int
        Dimension, 1 or 2.

    Raises
    ------
    ValueError
        The text is not a formula, or its values are not finite.
    """
    of_rows = compile_expression(text, d)

    def values(points: Array) -> Array:
        return of_rows(np.moveaxis(points, -1, 0).reshape(d, -1)).reshape(points.shape[:-1])

    size = _mean_size(values, d)
    with np.errstate(invalid="ignore"):
        result = cubature(values, np.zeros(d), np.ones(d), rule="gk21", rtol=1e-10, max_subdivisions=_SUBDIVISIONS)
    integral, uncertainty = float(result.estimate), float(result.error)
    if not uncertainty <= _DOUBTFUL * size:
        raise ValueError(
            f"expression: its integral over the unit box may not exist ({integral:.3g} ± {uncertainty:.1g}); "
            "try a formula without such a pole"
        )
    return Problem(KnownIntegrand(TYPED, "Your formula", text.strip(), d, values, integral), uncertainty)


def _mean_size(values: Callable[[Array], Array], d: int) -> float:
    """Mean of |f| over a grid; ValueError where f is not finite."""
    points = sample("regular", _CHECKED, d).points
    f = values(points)
    if not (finite := np.isfinite(f)).all():
        bad = int(np.argmin(finite))
        where = ", ".join(f"{name} = {value:.3g}" for name, value in zip("xy", points[bad], strict=False))
        raise ValueError(f"expression: its value is {f[bad]} at {where}; it must be finite inside the unit box")
    return float(np.abs(f).mean())
