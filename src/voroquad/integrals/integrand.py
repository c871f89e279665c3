"""The integrand as the rules see it: real values on the unit box, one row per component."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.checks import real_numbers
from .diagnostics import Diagnoses, diagnosis
from .evaluation import Map, evaluate
from .library import Library, to_numpy

Array = NDArray[np.float64]


class Integrand:
    """f on a box [a, b] of R^d, pulled back to the unit box.

    Parameters
    ----------
    func : callable
        Takes points (d, n), returns values (n,) or (..., n).
    a, b : array_like, (d,)
        Lower and upper limits; infinite ones are mapped to finite ones as :meth:`pull_back` says.
    spread : callable
        ``spread(func, parts)`` calls func on each part, as the built-in map does.
    parts : int
        Number of parts that the points of a call are split into.
    """

    def __init__(self, func: Callable[[Any], Any], a: Any, b: Any, spread: Map = map, parts: int = 1):
        if not callable(func):
            raise TypeError(f"func must be callable, as lambda x: x[0] ** 2 is, got {func!r}")
        self.library = Library.of(a, b)
        low, high = _limits("a", a), _limits("b", b)
        if low.size != high.size and 1 not in (low.size, high.size):
            raise ValueError(f"a and b must have a number for each dimension, got {low.size} and {high.size}")
        low, high = np.broadcast_arrays(low, high)
        swapped = low > high
        self.sign = -1.0 if np.count_nonzero(swapped) % 2 else 1.0
        self.a, self.b = np.where(swapped, high, low), np.where(swapped, low, high)
        finite = np.isfinite(low) & np.isfinite(high)
        with np.errstate(over="ignore"):
            volume = np.prod(self.b[finite] - self.a[finite])
        if not np.isfinite(volume):
            raise ValueError("a and b: the box is too large for floating point; scale x, or take infinite limits")
        self.func = func
        self.shape: tuple[int, ...] = ()
        #: Relative rounding error of func's values, of the dtype that it returns
        self.epsilon = float(np.finfo(np.float64).eps)
        self.diagnoses = Diagnoses()
        self._spread, self._parts = spread, parts

    @property
    def d(self) -> int:
        """Dimension."""
        return len(self.a)

    @property
    def empty(self) -> bool:
        """Whether the box is empty, so that the integral is 0 whatever f is."""
        return bool((self.a == self.b).any())

    def __call__(self, u: Array) -> Array:
        """Values times the Jacobian, (fields, n), at points u (n, d) of the unit box; NaN where not finite."""
        x, jacobian = self.pull_back(u.T)
        values, epsilon = evaluate(self.func, x, self.library, self._spread, self._parts, self.diagnoses)
        self.epsilon = max(self.epsilon, epsilon)
        n = u.shape[0]
        if values.ndim == 0 or values.shape[-1] != n:
            last = "; put the points last, as values.T does" if values.ndim and values.shape[0] == n else ""
            raise ValueError(
                f"func must return shape ({n},) or (..., {n}) for points of shape ({self.d}, {n}), "
                f"got {values.shape}{last}"
            )
        if values.size == 0:
            raise ValueError(f"func must return one component or more, got shape {values.shape}")
        self.shape = values.shape[:-1]
        with np.errstate(over="ignore", invalid="ignore"):
            fields = self.sign * jacobian * values.reshape(-1, n)
        bad = ~np.isfinite(fields)
        if bad.any():
            at = bad.any(axis=0)
            first = np.asarray(x, dtype=np.float64)[:, np.argmax(at)].tolist()
            self.diagnoses.add(diagnosis("not-finite", first_x=first, points=int(np.count_nonzero(at)), of=n))
        return np.where(bad, np.nan, fields)

    def pull_back(self, u: Array) -> tuple[Array, Array]:
        """Points x (d, n) inside the box and dx/du (n,) at u (d, n).

        Notes
        -----
        Between finite limits x = a + (b − a) u; on [a, ∞) x = a + u/(1 − u); on (−∞, b] mirrored; on
        the whole line x = t/(1 − t²) with t = 2u − 1. An empty interval, at infinity too, has dx/du = 0.
        What rounding in the precision of func's points puts on a limit or beyond is moved inside.
        """
        u = np.clip(u, 2.0**-54, 1 - 2.0**-53)  # no infinite point
        a, b = self.a[:, None], self.b[:, None]
        below, above = np.isinf(a), np.isinf(b)
        with np.errstate(invalid="ignore"):  # of the cases that are not taken
            t = 2 * u - 1
            cases = [
                (~below & ~above, a + (b - a) * u, (b - a) * np.ones_like(u)),
                (~below & above, a + u / (1 - u), (1 - u) ** -2),
                (below & ~above, b - (1 - u) / u, u**-2.0),
                (below & above, t / (4 * u * (1 - u)), (a != b) * 2 * (1 + t**2) / (4 * u * (1 - u)) ** 2),
            ]
            conditions = [np.broadcast_to(c[0], u.shape) for c in cases]
            x = np.select(conditions, [c[1] for c in cases])
            jacobian = np.select(conditions, [c[2] for c in cases])
        return self._inside(x), np.prod(jacobian, axis=0)

    def _inside(self, x: Array) -> Array:
        precision = self.library.precision()
        with np.errstate(over="ignore"):
            low, high, x = (limits.astype(precision) for limits in (self.a[:, None], self.b[:, None], x))
        return np.clip(x, np.nextafter(low, high), np.nextafter(high, low))

    def result(self, fields: Array) -> Any:
        """Numbers (fields,) in func's own shape and the caller's array library."""
        array = fields.reshape(self.shape)
        if self.library.is_numpy:
            return float(array) if array.ndim == 0 else array
        return self.library.array(array)


def _limits(name: str, limits: Any) -> Array:
    """Limits as an array (d,)."""
    array = real_numbers(name, to_numpy(limits))
    if np.isnan(array).any() or array.size == 0:
        raise ValueError(f"{name} must be numbers, finite or infinite, got {limits!r}")
    if array.ndim > 1:
        raise ValueError(f"{name} must be a number or have shape (d,), got shape {array.shape}")
    return np.atleast_1d(array)
