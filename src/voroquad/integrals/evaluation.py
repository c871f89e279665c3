"""Calls of func: on all points at once, in parts on several processes, or point by point."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.checks import real_numbers
from .diagnostics import Diagnoses, diagnosis
from .library import Library, to_numpy

Array = NDArray[np.float64]
Map = Callable[..., Any]


class _UnusableValueError(Exception):
    """What func returned are no real numbers. No ValueError: to call func point by point would not help."""


def evaluate(
    func: Callable[[Any], Any], x: NDArray[Any], library: Library, spread: Map, parts: int, diagnoses: Diagnoses
) -> tuple[Array, float]:
    """Values (..., n) of func at points x (d, n), and the relative rounding error of the dtype it returns.

    Where func raises TypeError, ValueError or IndexError it is called point by point, as `scipy.integrate.qmc_quad`
    does; if that fails too, the first exception is raised.
    """
    pieces = np.array_split(x, min(parts, x.shape[1]), axis=1)
    call = _Call(func, library, remote=spread is not map)
    try:
        try:
            results = list(spread(call, pieces))
        except (TypeError, ValueError, IndexError) as error:
            call.one_by_one = True
            try:
                results = list(spread(call, pieces))
            except _UnusableValueError:
                raise
            except Exception:
                raise error from None
            reason = f"{type(error).__name__}: {error}"
            diagnoses.add(diagnosis("point-by-point", shape=pieces[0].shape, reason=reason))
    except _UnusableValueError as error:
        raise ValueError(str(error)) from None
    values = np.concatenate([v for v, _ in results], axis=-1) if len(results) > 1 else results[0][0]
    return values, max(epsilon for _, epsilon in results)


class _Call:
    """func on points of the caller's array library, in a worker process too."""

    def __init__(self, func: Callable[[Any], Any], library: Library, remote: bool):
        self.func, self.library, self.remote = func, library, remote
        self.one_by_one = False

    def __call__(self, x: NDArray[Any]) -> tuple[Array, float]:
        try:
            if not self.one_by_one:
                return _real(self.func(self.library.array(x)))
            points = [_real(self.func(point)) for point in self.library.array(x.T)]
            return np.stack([v for v, _ in points], axis=-1), max(epsilon for _, epsilon in points)
        except StopIteration as error:  # which would end the map silently
            raise RuntimeError("func raised StopIteration") from error
        except Exception as error:
            if self.remote and not _survives_pickling(error):
                raise RuntimeError(f"func raised {type(error).__name__}: {error}") from None
            raise


def _real(values: Any) -> tuple[Array, float]:
    """Values of func as float64, and the relative rounding error of their own dtype."""
    given = to_numpy(values)
    try:
        numbers = real_numbers("values of func", given, "integrate its real and imaginary parts as two components")
    except ValueError as error:
        raise _UnusableValueError(str(error)) from None
    dtype = np.asarray(given).dtype
    return numbers, float(np.finfo(dtype if dtype.kind == "f" else np.float64).eps)


def _survives_pickling(error: Exception) -> bool:
    """Whether an exception reaches the process that waits for it, rather than ending the pool."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return False
    return True
