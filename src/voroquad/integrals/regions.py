"""Regions of integration as maps from the unit box: finite and infinite limits, and limits that are functions."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._support.arrays import Array
from .._support.checks import real_numbers
from .library import Library, to_numpy

Limit = float | Callable[..., Any]


class Region(Protocol):
    """A map from the unit box onto what is integrated over."""

    @property
    def d(self) -> int:
        """Dimension of the unit box."""

    @property
    def empty(self) -> bool:
        """Whether the integral is 0 whatever f is."""

    def pull_back(self, u: Array, /) -> tuple[Array, Array]:
        """Points x (k, n) and the volume element (n,) at u (d, n): ∫ f = ∫ f(x(u)) volume(u) du."""


@runtime_checkable
class ForSamples(Protocol):
    """A region whose map depends on how many samples there are."""

    def for_samples(self, n: int) -> Region:
        """The map for n samples."""


def for_samples(region: Region, n: int) -> Region:
    """A region by the map that has least error with n samples."""
    return region.for_samples(n) if isinstance(region, ForSamples) else region


class Box:
    """The box [a, b] of R^d.

    Parameters
    ----------
    a, b : array_like, (d,)
        Lower and upper limits; infinite ones are mapped to finite ones as :func:`interval` says.
    library : Library
        In whose precision the points stay within the box.
    loc, scale : array_like, (d,)
        Of the maps of infinite intervals.
    """

    empty: bool

    def __init__(self, a: Any, b: Any, library: Library, loc: Any = 0.0, scale: Any = 1.0):
        low, high = limits("a", a), limits("b", b)
        if low.size != high.size and 1 not in (low.size, high.size):
            raise ValueError(f"a and b must have a number for each dimension, got {low.size} and {high.size}")
        low, high = np.broadcast_arrays(low, high)
        swapped = low > high
        self.sign = -1.0 if np.count_nonzero(swapped) % 2 else 1.0
        self.a, self.b = np.where(swapped, high, low), np.where(swapped, low, high)
        self.empty = bool((self.a == self.b).any())
        self._library = library
        self._loc, self._scale = location_and_scale(loc, scale, self.a, self.b)
        ends = list(zip(self.a.tolist(), self.b.tolist(), strict=True))
        finite = [high - low for low, high in ends if math.isfinite(low) and math.isfinite(high)]
        volume = _product(finite)
        if not math.isfinite(volume):
            raise ValueError("a and b: the box is too large for floating point; scale x, or take infinite limits")
        if not self.empty and volume < np.finfo(float).tiny:
            raise ValueError("a and b: the volume of the box is too small for floating point; scale x")
        #: The volume element of a box with finite limits
        self._volume = self.sign * volume if len(finite) == len(ends) else None

    @property
    def d(self) -> int:
        """Dimension."""
        return len(self.a)

    def pull_back(self, u: Array) -> tuple[Array, Array]:
        """Points x (d, n) inside the box and the volume element (n,), with the sign of swapped limits, at u (d, n)."""
        if self._volume is not None:
            ends = np.nextafter(self.a, self.b), np.nextafter(self.b, self.a)
            x = _core.into_box(u, self.a, self.b - self.a, *ends)
            if self._library.precision() != np.float64:
                x = inside(x, self.a[:, None], self.b[:, None], self._library)
            return x, _repeated(self._volume, u.shape[1])
        a, b = self.a[:, None], self.b[:, None]
        x, jacobian = interval(u, a, b, self._loc[:, None], self._scale[:, None])
        return inside(x, a, b, self._library), self.sign * np.prod(jacobian, axis=0)


def _product(sides: list[float]) -> float:
    """The product of sides; only if it is itself out of range it is 0 or infinite."""
    if not all(map(math.isfinite, sides)):
        return math.inf
    mantissa, power = 1.0, 0
    for side in sides:
        fraction, exponent = math.frexp(side)
        mantissa, carry = math.frexp(mantissa * fraction)
        power += exponent + carry
    with np.errstate(over="ignore", under="ignore"):
        return float(np.ldexp(mantissa, power))


class WeighedBox:
    """A box [low, high] of R^d with a mass that is spread evenly over it."""

    empty = False

    def __init__(self, low: Array, high: Array, mass: float):
        self.low, self.high, self.mass = low[:, None], high[:, None], mass

    @property
    def d(self) -> int:
        """Dimension."""
        return len(self.low)

    def pull_back(self, u: Array) -> tuple[Array, Array]:
        """Points x (d, n) and their mass element (n,), which is constant, at u (d, n)."""
        x = np.clip(self.low + (self.high - self.low) * u, self.low, np.nextafter(self.high, self.low))
        return x, _repeated(self.mass, u.shape[1])


class IteratedBox:
    """x_i from a_i to b_i, where limits may be functions of the coordinates after x_i, as `scipy.integrate.nquad` has.

    Parameters
    ----------
    a, b : sequence of float or callable, (d,)
        Lower and upper limits. A callable takes the coordinates x_{i+1}, …, x_{d−1}, each (n,), and returns numbers
        (n,) or one number; the last coordinate has numbers for limits.
    library : Library
        As for :class:`Box`.
    loc, scale : array_like, (d,)
        As for :class:`Box`.

    Notes
    -----
    ∫ dx_{d−1} … ∫_{a_0(x_1, …)}^{b_0(x_1, …)} dx_0 f(x): an interval as long as the other coordinates say is mapped
    from [0, 1] as a fixed one is. Where b_i < a_i the sign changes, as in iterated integrals.
    """

    empty = False

    def __init__(self, a: list[Limit], b: list[Limit], library: Library, loc: Any = 0.0, scale: Any = 1.0):
        if len(a) != len(b):
            raise ValueError(f"a and b must have a limit for each dimension, got {len(a)} and {len(b)}")
        for name, last in (("a", a[-1]), ("b", b[-1])):
            if callable(last):
                raise ValueError(
                    f"{name}[-1] must be a number, got a callable: limits depend on the coordinates after their own"
                )
        self._ends = [_checked_ends(i, ends) for i, ends in enumerate(zip(a, b, strict=True))]
        self._library = library
        fixed = np.array([[np.nan if callable(e) else e for e in ends] for ends in self._ends])
        self._loc, self._scale = location_and_scale(loc, scale, fixed[:, 0], fixed[:, 1])

    @property
    def d(self) -> int:
        """Dimension."""
        return len(self._ends)

    def pull_back(self, u: Array) -> tuple[Array, Array]:
        """Points x (d, n) and the volume element (n,) at u (d, n), from the last coordinate to the first."""
        x, volume = np.empty(u.shape), np.ones(u.shape[1])
        for i in reversed(range(self.d)):
            after = [np.array(c, dtype=self._library.precision()) for c in x[i + 1 :]]
            start, stop = (
                _limit_at(f"{name}[{i}]", end, after, u.shape[1]) for name, end in zip("ab", self._ends[i], strict=True)
            )
            low, high = np.minimum(start, stop), np.maximum(start, stop)
            at, jacobian = interval(u[i], low, high, self._loc[i], self._scale[i])
            x[i] = inside(at, low, high, self._library)
            volume *= np.where(start > stop, -jacobian, jacobian)
        return x, volume


def _repeated(value: float, n: int) -> Array:
    """A number n times (n,), in the memory of one."""
    return np.ndarray((n,), np.float64, np.array(value), strides=(0,))


def interval(u: Array, a: Array, b: Array, loc: Any, scale: Any) -> tuple[Array, Array]:
    """Points x and dx/du at u, of intervals [a, b] with a ≤ b; all of one shape.

    Notes
    -----
    Between finite limits x = a + (b − a) u; on [a, ∞) x = a + s u/(1 − u) with s = scale, so that half of the points
    are below a + s; on (−∞, b] mirrored; on the whole line x = loc + s t/(1 − t²) with t = 2u − 1, so that half of the
    points are within ⅔ s of loc. An empty interval, at infinity too, has dx/du = 0.
    """
    u = within(u)
    a, b, u, loc, s = np.broadcast_arrays(a, b, u, loc, scale)
    below, above = np.isinf(a), np.isinf(b)
    with np.errstate(invalid="ignore", over="ignore"):  # in the branches that are not selected
        t = 2 * u - 1
        cases = [
            (~below & ~above, a + (b - a) * u, (b - a) * np.ones_like(u)),
            (~below & above, a + s * (u / (1 - u)), s * (1 - u) ** -2),
            (below & ~above, b - s * ((1 - u) / u), s * u**-2.0),
            (below & above, loc + s * (t / (4 * u * (1 - u))), (a != b) * s * 2 * (1 + t**2) / (4 * u * (1 - u)) ** 2),
        ]
    conditions = [c[0] for c in cases]
    return np.select(conditions, [c[1] for c in cases]), np.select(conditions, [c[2] for c in cases])


def within(u: Array) -> Array:
    """Points moved off the ends of the unit box, which may correspond to limits at infinity."""
    return np.clip(u, 2.0**-54, 1 - 2.0**-53)


def inside(x: Array, a: Array, b: Array, library: Library) -> Array:
    """Points x in the library's precision. Points that rounding puts on or beyond a limit are moved inside.

    The array x may be overwritten.
    """
    precision = library.precision()
    with np.errstate(over="ignore"):
        low, high, x = (limits.astype(precision, copy=False) for limits in (a, b, x))
    return np.clip(x, np.nextafter(low, high), np.nextafter(high, low), out=x)


def limits(name: str, given: Any) -> Array:
    """Limits as an array (d,)."""
    array = real_numbers(name, to_numpy(given))
    if np.isnan(array).any() or array.size == 0:
        raise ValueError(f"{name} must be numbers, finite or infinite, got {given!r}")
    if array.ndim > 1:
        raise ValueError(f"{name} must be a number or have shape (d,), got shape {array.shape}")
    return np.atleast_1d(array)


def location_and_scale(loc: Any, scale: Any, a: Array, b: Array) -> tuple[Array, Array]:
    """The loc (d,) and scale (d,) of the maps of infinite intervals [a, b], (d,); limits that are functions are NaN."""
    if type(loc) is type(scale) is float and (loc, scale) == (0.0, 1.0):  # the defaults go with all limits
        return np.zeros(len(a)), np.ones(len(a))
    found = []
    for name, given in (("loc", loc), ("scale", scale)):
        array = real_numbers(name, to_numpy(given))
        if array.ndim > 1 or array.size not in (1, len(a)) or not np.isfinite(array).all():
            raise ValueError(f"{name} must be a finite number or {len(a)} of them, one per coordinate, got {given!r}")
        found.append(np.broadcast_to(array, len(a)))
    location, s = found
    if (s <= 0).any():
        raise ValueError(f"scale must be positive, got {scale!r}")
    whole = ~np.isfinite(a) & ~np.isfinite(b)
    if (location[~whole] != 0).any() and np.ndim(loc):
        raise ValueError(f"loc is for coordinates that run from -inf to inf, got {loc!r}; give 0 for the others")
    if ((location != 0).any() and not whole.any()) or (
        (s != 1).any() and np.isfinite(a).all() and np.isfinite(b).all()
    ):
        raise ValueError("loc and scale are for infinite limits, and these are finite; leave them out")
    return location, s


def _checked_ends(i: int, ends: tuple[Any, Any]) -> tuple[Limit, Limit]:
    """The limits of coordinate i, each a number or a callable."""
    checked: list[Limit] = []
    for name, end in zip("ab", ends, strict=True):
        if callable(end):
            checked.append(end)
            continue
        number = limits(f"{name}[{i}]", end)
        if number.size != 1:
            raise ValueError(f"{name}[{i}] must be a number or a callable, got {end!r}")
        checked.append(float(number[0]))
    return checked[0], checked[1]


def _limit_at(name: str, limit: Limit, after: list[NDArray[Any]], n: int) -> Array:
    """A limit (n,) at the coordinates after its own."""
    if not callable(limit):
        return np.full(n, limit)
    values = real_numbers(name, limit(*after))
    if values.shape not in ((), (n,)) or np.isnan(values).any():
        raise ValueError(
            f"{name} must return a number or shape ({n},), none of them NaN, for {len(after)} coordinates of shape "
            f"({n},), got shape {values.shape}"
        )
    return np.broadcast_to(values, n).astype(np.float64)
