"""What :func:`voroquad.quad` returns, and how it is printed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from .._support.numbers import with_uncertainty
from .diagnostics import ADVICE, IntegrationWarning
from .library import to_numpy


class ConfidenceInterval(NamedTuple):
    """Ends of an interval; arrays for vector-valued integrands."""

    low: Any
    high: Any


@dataclass(frozen=True)
class QuadResult:
    """What :func:`quad` returns. ``print`` shows it as a value with its uncertainty, 2.66613(4).

    It unpacks into value and error, ``integral, error = vq.quad(...)``, as results of `scipy.integrate` do.

    Attributes
    ----------
    integral : float or array
        The estimate, in the shape of func's values.
    standard_error : float or array
        Its standard error.
    n_evaluations : int
        Number of points func was evaluated at.
    degrees_of_freedom : float
        Of the Student-t distribution that :meth:`confidence_interval` takes.
    warnings : tuple of IntegrationWarning
        What the call warned of, each with its ``kind`` and ``details``.

    Examples
    --------
    >>> import voroquad as vq
    >>> integral, error = vq.quad(lambda x: x[0] ** 2, 0, 1, rng=7)
    >>> round(integral, 12), error < 1e-12
    (0.333333333333, True)
    """

    integral: Any
    standard_error: Any
    n_evaluations: int
    degrees_of_freedom: float = field(default=math.inf, repr=False)
    warnings: tuple[IntegrationWarning, ...] = field(default=(), repr=False)

    @property
    def success(self) -> bool:
        """Whether nothing was found that makes value or error unreliable, and the tolerance, if any, is met."""
        return all(warning.kind in ADVICE for warning in self.warnings)

    def confidence_interval(self, level: float = 0.95) -> ConfidenceInterval:
        """The interval that holds the integral in a fraction `level` of repetitions.

        Raises ValueError for a level outside (0, 1).
        """
        if not 0 < level < 1:
            raise ValueError(f"level must be between 0 and 1, got {level!r}; 0.95 is the usual one")
        half = float(stats.t.ppf((1 + level) / 2, self.degrees_of_freedom)) * self.standard_error
        return ConfidenceInterval(self.integral - half, self.integral + half)

    def __iter__(self) -> Iterator[Any]:
        return iter((self.integral, self.standard_error))

    def __str__(self) -> str:
        value, error = np.asarray(to_numpy(self.integral)), np.asarray(to_numpy(self.standard_error))
        texts = [with_uncertainty(v, e) for v, e in zip(value.flat, error.flat, strict=True)]
        if value.ndim == 0:
            return texts[0]
        return np.array2string(np.array(texts).reshape(value.shape), formatter={"all": str})
