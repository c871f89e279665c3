"""Checks of arguments, shared by all entry points, so that their messages are uniform."""

from __future__ import annotations

import reprlib
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Array

#: The largest whole number that arrays and the core can count to
MOST = 2**63 - 1


def positive_int(name: str, value: Any, most: int = MOST) -> int:
    """Return `value` as an int from 1 to `most`."""
    try:
        number = int(value)
    except (TypeError, ValueError, OverflowError):
        number = 0
    if isinstance(value, bool) or number < 1 or number != value:
        raise ValueError(f"{name} must be a whole number of at least 1, got {value!r}")
    if number > most:
        raise ValueError(f"{name} must be at most {'2^63 - 1' if most == MOST else most}, got {value!r}")
    return number


def truth(name: str, value: Any) -> bool:
    """Return `value` if it is True or False; a text such as "no" would count as True."""
    if not isinstance(value, bool | np.bool_) and not (isinstance(value, int) and value in (0, 1)):
        raise ValueError(f"{name} must be True or False, got {value!r}")
    return bool(value)


def whole_numbers(name: str, text: str) -> tuple[int, ...]:
    """Read "16,64,256", each a whole number of at least 1."""
    try:
        numbers = [int(part) for part in text.split(",")]
    except ValueError:
        raise ValueError(f"{name} must be whole numbers separated by commas, got {text!r}") from None
    return tuple(positive_int(name, number) for number in numbers)


def one_of(name: str, value: Any, known: Iterable[str]) -> str:
    """Return `value` if it is one of the `known` names."""
    names = list(known)
    if value not in names:
        raise ValueError(f"unknown {name} {value!r}; choose one of {', '.join(names)}")
    return str(value)


def refuse_masks(name: str, values: Any) -> None:
    """Raise ValueError for masked values, whose masks NumPy would drop."""
    if _is_masked(values):
        raise ValueError(
            f"{name} must not be masked; drop the masked rows, as numpy.ma.compress_rows does, "
            "or fill the masked entries, as numpy.ma.filled does"
        )


def refuse_lossy(name: str, values: Any, of_complex: str = "give their two parts as two coordinates") -> None:
    """Raise ValueError for what NumPy would drop on the way to real numbers: masks and imaginary parts.

    `of_complex` is the remedy for complex numbers.
    """
    refuse_masks(name, values)
    if np.iscomplexobj(values):
        raise ValueError(f"{name} must be real, got complex numbers; {of_complex}")


def _is_masked(values: Any) -> bool:
    """Whether a value of an array, or of an array in a sequence of arrays, is masked."""
    if isinstance(values, list | tuple):
        return any(_is_masked(v) for v in values if isinstance(v, list | tuple | np.ma.MaskedArray))
    return np.ma.is_masked(values)


def real_numbers(name: str, values: Any, of_complex: str = "give their two parts as two coordinates") -> Array:
    """Return `values` as a float64 array: the check that arrays from outside go through.

    Raises ValueError for masked values, complex numbers, texts, dates and other objects.
    """
    try:
        array = np.asarray(values)
        numbers = array if array.dtype.kind == "c" else array.astype(np.float64, copy=False)
        if array.dtype.kind not in "biufcO" or (array.dtype == object and any(v is None for v in array.flat)):
            raise TypeError
    except (TypeError, ValueError) as error:
        given = reprlib.repr(values) if isinstance(values, str | bytes | None) else type(values).__name__
        if isinstance(values, np.ndarray):
            given = f"an array of {values.dtype}"
        raise ValueError(f"{name} must be an array of numbers, got {given}") from error
    refuse_lossy(name, values, of_complex)
    return numbers


def point_array(points: ArrayLike, *, name: str = "points") -> Array:
    """Return `points` as a float64 array, of any strides, (n, d) or (sets, n, d).

    One-dimensional input is read as (n, 1).
    """
    array = real_numbers(name, points)
    if array.ndim == 1:
        array = array[:, None]
    if array.ndim not in (2, 3):
        raise ValueError(f"{name} must have shape (n, d) or (sets, n, d), got {array.shape}")
    if 0 in array.shape:
        raise ValueError(f"{name} must hold at least one point and one coordinate, got shape {array.shape}")
    return array


def refuse_transposed(points: ArrayLike, *, name: str = "points") -> None:
    """Raise ValueError for an array (n, d) of fewer points than dimensions.

    It may as well be (d, n), the shape in which SciPy's integrands take points. A batch of one set, (1, n, d), says
    that it is not. Arrays with as many points as dimensions or more are read as documented, (n, d).
    """
    shape = np.shape(points)
    if len(shape) == 2 and shape[0] < shape[1]:
        count = "1 point" if shape[0] == 1 else f"{shape[0]} points"
        raise ValueError(
            f"{name} of shape {shape} may be (n, d) or (d, n): pass {name}.T for {shape[1]} points in d = {shape[0]}, "
            f"{name}[None] for {count} in d = {shape[1]}"
        )


def extent(points: Array) -> tuple[Array, Array]:
    """The least and the greatest coordinate (d,) of points (..., d); NaN where there is one."""
    axes = [
        points[..., a] for a in range(points.shape[-1])
    ]  # faster than a reduction over an axis that is not the last
    return np.array([x.min() for x in axes]), np.array([x.max() for x in axes])


def refuse_outside(
    name: str,
    points: Array,
    low: ArrayLike,
    high: ArrayLike,
    remedy: str,
    *,
    closed: bool = True,
    slack: ArrayLike = 0.0,
) -> None:
    """Raise ValueError unless points (..., d) lie in [low, high], or in [low, high) if not `closed`; up to `slack`."""
    low, high, slack = (np.broadcast_to(end, points.shape[-1:]) for end in (low, high, slack))
    lowest, highest = low - slack, high + slack
    least, most = extent(points)
    if ((least >= lowest) & ((most <= highest) if closed else (most < highest))).all():  # NaN is neither
        return
    inside = (points >= lowest) & ((points <= highest) if closed else (points < highest))
    first = tuple(int(i) for i in np.argwhere(~inside.all(axis=-1))[0])
    index = first[0] if len(first) == 1 else first
    ends = [f"[{a:g}, {b:g}{']' if closed else ')'}" for a, b in zip(low, high, strict=True)]
    box = f"{ends[0]}^{len(ends)}" if len(set(ends)) == 1 else " × ".join(ends)
    raise ValueError(f"{name}[{index}] = {points[first].tolist()} is not inside {box}; {remedy}")


def unit_points(
    points: ArrayLike,
    *,
    closed: bool = False,
    name: str = "points",
    remedy: str = "scale the points to the unit box or drop it",
) -> Array:
    """Return `points` as a float64 array, of any strides, (n, d) or (sets, n, d) inside [0, 1)^d.

    One-dimensional input is read as (n, 1). With `closed`, 1 is allowed too. The error for a point outside ends with
    `remedy`.
    """
    array = point_array(points, name=name)
    least, most = array.min(), array.max()
    if not (least >= 0 and (most <= 1 if closed else most < 1)):  # NaN is neither
        refuse_outside(name, array, 0.0, 1.0, remedy, closed=closed)
    return array


#: Largest number of threads, since each thread allocates scratch memory.
MOST_THREADS = 1024


def thread_count(threads: int | None) -> int:
    """Return the number of threads to use: `threads`, else VOROQUAD_NUM_THREADS, else all processors."""
    from .. import _core

    return _core.default_thread_count() if threads is None else min(positive_int("threads", threads), MOST_THREADS)
