"""What :func:`voroquad.quad` warns of: one text for each kind, and the numbers as attributes."""

from __future__ import annotations

import sys
import warnings
from typing import Any

#: The text of each kind of warning. It holds no numbers, so that Python shows it once for a line of the caller's code.
TEXTS = {
    "not-finite": "func is not finite everywhere, so the integral is NaN",
    "point-by-point": (
        "func failed on points of shape (d, n) and is called point by point, which is slow; "
        "let it take (d, n) and return (n,)"
    ),
    "zero": (
        "func is 0 at every point: either it is 0 everywhere, or its support was missed; "
        "use more points, or limits close to where func differs from 0"
    ),
    "few-samples": (
        "the estimate rests on fewer than ten samples, so neither it nor its error is reliable; "
        "use more points, adapt=True, or limits close to where func is large"
    ),
    "heavy-tail": (
        "the largest values of func grow like those of an integrand of infinite variance, so neither the estimate nor "
        "its error is reliable, and the integral may not exist; substitute variables that remove the singularity, "
        "or use adapt=True if it is a narrow peak"
    ),
    "one-stratum": (
        "a single stratum causes most of the error: the integrand is not resolved there and the error is "
        "uncertain; use more points or split the box there"
    ),
    "unforeseen": (
        "samples miss their predictions by far more than the grid of the pilot rule led to expect: func oscillates in "
        "step with the grid, or is large between its points; use another number of points, or limits close to where "
        "func is large"
    ),
    "no-error": "a single set of points has no standard error; take n_points of at least 8",
    "no-finite-error": "the standard error is not finite, though the integral is known; try func in other units",
    "give-atol": "the integral is 0 within its error, so rtol alone cannot be met; give atol as well",
    "vague-denominator": (
        "the denominator of a ratio is 0 within a few of its errors, so the error of the ratio is not reliable; "
        "use more points"
    ),
    "rounding": "the tolerance is smaller than the rounding error, which no number of points reduces; raise it",
    "stopped": "the integration was stopped before its end, and the estimate is that of the evaluations so far",
    "tolerance": "the tolerance is not met; raise max_evaluations or the tolerance",
}

#: Kinds that leave the result as reliable as it says.
ADVICE = ("point-by-point", "give-atol")


class IntegrationWarning(UserWarning):
    """The result of :func:`voroquad.quad` may be unreliable; the message says why.

    Attributes
    ----------
    kind : str
        ``"not-finite"``, ``"zero"``, ``"few-samples"``, ``"heavy-tail"``, ``"one-stratum"``, ``"unforeseen"``,
        ``"no-error"``, ``"no-finite-error"``, ``"tolerance"``, ``"rounding"``, ``"stopped"`` or, of a ratio,
        ``"vague-denominator"``. Advice, which leaves the result reliable, is ``"point-by-point"`` and
        ``"give-atol"``.
    details : dict
        The numbers behind it, such as the first point ``"x"`` where func is not finite.
    """

    def __init__(self, text: str, kind: str = "", details: dict[str, Any] | None = None):
        super().__init__(text)
        self.kind = kind
        self.details = details or {}


def described(warning: Warning | str) -> str:
    """The text of a warning, with the numbers behind it if it is one of ours."""
    if not isinstance(warning, IntegrationWarning) or not warning.details:
        return str(warning)
    numbers = ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in warning.details.items())
    return f"{warning} ({numbers})"


def diagnosis(kind: str, **details: Any) -> IntegrationWarning:
    """The warning of a kind in :data:`TEXTS`, not yet issued."""
    return IntegrationWarning(TEXTS[kind], kind, details)


def issue(warning: IntegrationWarning) -> None:
    """Issue a warning that points at the line which called into this package."""
    frame, level = sys._getframe(), 1
    while str(frame.f_globals.get("__name__")).startswith(f"{__package__}.") and frame.f_back is not None:
        frame, level = frame.f_back, level + 1
    warnings.warn(warning, stacklevel=level)


class Diagnoses:
    """The warnings of one call, each kind once, in the order in which they arose."""

    def __init__(self) -> None:
        self._by_kind: dict[str, IntegrationWarning] = {}

    def add(self, warning: IntegrationWarning) -> None:
        """Issue a warning, unless there was one of its kind."""
        if warning.kind not in self._by_kind:
            self._by_kind[warning.kind] = warning
            issue(warning)

    def all(self) -> tuple[IntegrationWarning, ...]:
        """Those added so far."""
        return tuple(self._by_kind.values())
