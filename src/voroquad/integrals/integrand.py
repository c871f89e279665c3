"""The integrand as the rules see it: real values on the unit box, one row per component."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from array_api_compat import array_namespace, is_array_api_obj, is_numpy_namespace
from numpy.typing import NDArray

Array = NDArray[np.float64]
Map = Callable[..., Any]


class IntegrationWarning(UserWarning):
    """The result of :func:`voroquad.quad` is not to be trusted as it stands; the message says why."""


def warn(message: str) -> None:
    """Issue an :class:`IntegrationWarning` that points at the line which called into this package."""
    frame, level = sys._getframe(), 1
    while frame.f_globals["__name__"].startswith(f"{__package__}.") and frame.f_back is not None:
        frame, level = frame.f_back, level + 1
    warnings.warn(message, IntegrationWarning, stacklevel=level)


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
        self.xp = _namespace(a, b)
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
        self._spread, self._parts = spread, parts

    @property
    def d(self) -> int:
        """Dimension."""
        return len(self.a)

    def __call__(self, u: Array) -> Array:
        """Values times the Jacobian, (fields, n), at points u (n, d) of the unit box; NaN where not finite."""
        x, jacobian = self.pull_back(u.T)
        values = self._evaluate(x)
        n = u.shape[0]
        if values.ndim == 0 or values.shape[-1] != n:
            raise ValueError(
                f"func must return shape ({n},) or (..., {n}) for points of shape ({self.d}, {n}), got {values.shape}"
            )
        if values.size == 0:
            raise ValueError(f"func must return one component or more, got shape {values.shape}")
        if not np.issubdtype(values.dtype, np.number) and values.dtype != bool:
            raise ValueError(f"func must return real numbers, got dtype {values.dtype}")
        if np.iscomplexobj(values):
            raise ValueError("func must return real numbers; integrate its real and imaginary parts as two components")
        self.shape = values.shape[:-1]
        with np.errstate(over="ignore", invalid="ignore"):
            fields = self.sign * jacobian * values.reshape(-1, n).astype(np.float64)
        bad = ~np.isfinite(fields)
        if bad.any():
            at = bad.any(axis=0)
            warn(
                f"the integrand is not finite at {np.count_nonzero(at)} of {n} points, the first "
                f"x = {x[:, np.argmax(at)].tolist()}"
            )
        return np.where(bad, np.nan, fields)

    def pull_back(self, u: Array) -> tuple[Array, Array]:
        """Points x (d, n) of the box and dx/du (n,) at u (d, n).

        Notes
        -----
        Between finite limits x = a + (b − a) u; on [a, ∞) x = a + u/(1 − u); on (−∞, b] mirrored; on
        the whole line x = t/(1 − t²) with t = 2u − 1. An empty interval, at infinity too, has dx/du = 0.
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
        return x, np.prod(jacobian, axis=0)

    def result(self, fields: Array) -> Any:
        """Numbers (fields,) in func's own shape and the caller's array library."""
        array = fields.reshape(self.shape)
        if is_numpy_namespace(self.xp):
            return float(array) if array.ndim == 0 else array
        return self.xp.asarray(array.copy())

    def _evaluate(self, x: Array) -> NDArray[Any]:
        parts = np.array_split(x, min(self._parts, x.shape[1]), axis=1)
        call = _Call(self.func, None if is_numpy_namespace(self.xp) else self.xp)
        try:
            results = list(self._spread(call, parts))
        except (TypeError, ValueError, IndexError) as error:
            # As SciPy's qmc_quad does: func may take one point at a time
            call.one_by_one = True
            try:
                results = list(self._spread(call, parts))
            except Exception:
                raise error from None
            warn(
                f"func failed on points of shape {parts[0].shape} ({type(error).__name__}: {error}) and is called "
                "point by point, which is slow; let it take (d, n) and return (n,)"
            )
        return np.concatenate(results, axis=-1) if len(results) > 1 else np.asarray(results[0])


class _Call:
    """func on NumPy points, for a worker process too."""

    def __init__(self, func: Callable[[Any], Any], xp: Any):
        self.func, self.xp = func, xp
        self.one_by_one = False

    def __call__(self, x: Array) -> NDArray[Any]:
        if self.one_by_one:
            return np.stack([self._numpy(self.func(point)) for point in self._own(x.T)], axis=-1)
        return self._numpy(self.func(self._own(x)))

    def _own(self, x: Array) -> Any:
        return x if self.xp is None else self.xp.asarray(np.ascontiguousarray(x))

    def _numpy(self, values: Any) -> NDArray[Any]:
        return np.asarray(values) if self.xp is None else np.asarray(np.from_dlpack(values))


def _namespace(a: Any, b: Any) -> Any:
    """The array library of a and b; NumPy for plain numbers and sequences."""
    arrays = [x for x in (a, b) if is_array_api_obj(x)] or [np.empty(0)]
    if len({array_namespace(x) for x in arrays}) > 1:
        libraries = " and ".join(type(x).__module__.split(".")[0] for x in arrays)
        raise ValueError(f"a and b must be arrays of one library, got {libraries}; convert one of them")
    return array_namespace(*arrays)


def _limits(name: str, limits: Any) -> Array:
    try:
        array = np.asarray(limits, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must be numbers, got {limits!r}") from error
    if np.isnan(array).any() or array.size == 0:
        raise ValueError(f"{name} must be numbers, finite or infinite, got {limits!r}")
    if array.ndim > 1:
        raise ValueError(f"{name} must be a number or have shape (d,), got shape {array.shape}")
    return np.atleast_1d(array)
