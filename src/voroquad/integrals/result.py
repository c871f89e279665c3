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
from .estimates import Estimate
from .evaluation import Function
from .library import to_numpy
from .structures import mapped


class ConfidenceInterval(NamedTuple):
    """Ends of an interval, in the shape or structure of func's values; of complex ones both parts."""

    low: Any
    high: Any


@dataclass(frozen=True)
class QuadResult:
    """What :func:`quad` returns. ``print`` shows it as a value with its uncertainty, 2.66613(4).

    It unpacks into value and error, ``integral, error = vq.quad(...)``, as results of `scipy.integrate` do.

    Attributes
    ----------
    integral : float, complex, array, or dict or tuple of these
        The estimate, in the shape or structure of func's values.
    standard_error : as integral
        Its standard error. That of a complex estimate is complex: the errors of its real and its imaginary part, as
        `scipy.integrate.quad` has them.
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

    @classmethod
    def of(cls, estimate: Estimate, function: Function) -> QuadResult:
        """The result that an estimate of a function's integrals makes, in the structure of the function's values."""
        assert function.form is not None
        integral, error = (function.form.assemble(x, function.library.number) for x in (estimate.mean, estimate.error))
        return cls(integral, error, estimate.n, estimate.degrees_of_freedom, function.diagnoses.all())

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
        factor = float(stats.t.ppf((1 + level) / 2, self.degrees_of_freedom))
        low = mapped(lambda value, error: value - factor * error, self.integral, self.standard_error)
        high = mapped(lambda value, error: value + factor * error, self.integral, self.standard_error)
        return ConfidenceInterval(low, high)

    def __iter__(self) -> Iterator[Any]:
        return iter((self.integral, self.standard_error))

    def __str__(self) -> str:
        return str(mapped(_Text.of, self.integral, self.standard_error))


class _Text(str):
    """A text that shows itself without quotes, within dicts and tuples too."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)

    @classmethod
    def of(cls, integral: Any, standard_error: Any) -> _Text:
        """Values with their uncertainties, in the shape of the array."""
        value, error = np.asarray(to_numpy(integral)), np.asarray(to_numpy(standard_error))
        texts = [_with_uncertainty(v, e) for v, e in zip(value.flat, error.flat, strict=True)]
        if value.ndim == 0:
            return cls(texts[0])
        return cls(np.array2string(np.array(texts).reshape(value.shape), formatter={"all": str}))


def _with_uncertainty(value: Any, error: Any) -> str:
    """As :func:`with_uncertainty`; a complex number as 1.50(2)+0.3(1)j."""
    if not np.iscomplexobj(value):
        return with_uncertainty(value, error)
    real, imaginary = with_uncertainty(value.real, error.real), with_uncertainty(value.imag, error.imag)
    return f"{real}{'' if imaginary.startswith('-') else '+'}{imaginary}j"
