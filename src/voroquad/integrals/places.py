"""What `quad` integrates over: limits, a domain or a measure, as parts that are maps from the unit box."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._support.arrays import Array
from .._support.checks import positive_int, real_numbers
from .library import Library
from .measures import PiecewiseUniform, ProductMeasure
from .pieces import Part
from .regions import Box, IteratedBox, Region


def parts_of(a: Any, b: Any, measure: Any, loc: Any, scale: Any) -> tuple[list[Part], Library]:
    """The parts that the arguments of :func:`voroquad.quad` describe, and the array library of func's points."""
    plain = Library.of(0, 1)
    if measure is not None:
        if a is not None or b is not None:
            raise ValueError("give only one of limits, a domain and a measure; a measure has its own support")
        if not isinstance(measure, ProductMeasure | PiecewiseUniform):
            raise ValueError(
                f"measure must be a vq.ProductMeasure or a vq.PiecewiseUniform, got {type(measure).__name__}"
            )
        return _split(measure), plain
    if hasattr(a, "pull_back") or hasattr(a, "parts"):
        if isinstance(a, ProductMeasure | PiecewiseUniform):
            raise ValueError(f"a is a {type(a).__name__}; write quad(func, measure=...)")
        if b is not None:
            raise ValueError(f"b: a {type(a).__name__} is the whole domain; leave b out, got {b!r}")
        return _split(a), plain
    if a is None or b is None:
        raise ValueError("a and b: give both limits, as in quad(func, 0, 1), or a domain, or measure=")
    region, library = _box(a, b, loc, scale)
    return [Part(region, 1.0)], library


class OfCaller:
    """A domain of a class of the caller's own, whose answers are checked."""

    def __init__(self, place: Any):
        name = type(place).__name__
        lacking = [part for part in ("d", "empty", "pull_back") if not hasattr(place, part)]
        if lacking:
            raise ValueError(f"a: the domain {name} lacks {', '.join(lacking)}; it needs d, empty and pull_back(u)")
        self.d, self._place, self._name = positive_int(f"a: d of the domain {name}", place.d), place, name

    @property
    def empty(self) -> bool:
        """As it says."""
        return bool(self._place.empty)

    def pull_back(self, u: Array) -> tuple[Array, Array]:
        """Points x (k, n) and the volume element (n,) at u (d, n)."""
        n = u.shape[1]
        answer = self._place.pull_back(u)
        if not isinstance(answer, tuple | list) or len(answer) != 2:
            raise ValueError(f"a: pull_back(u) of the domain {self._name} must return points and volume elements")
        x, volume = (real_numbers(f"a: what pull_back(u) of the domain {self._name} returns", part) for part in answer)
        if x.ndim != 2 or x.shape[1] != n or volume.shape != (n,):
            raise ValueError(
                f"a: pull_back(u) of the domain {self._name} must return points (k, {n}) and volume elements ({n},) "
                f"for u of shape {u.shape}, got shapes {x.shape} and {volume.shape}"
            )
        return x, volume


def _split(place: Any) -> list[Part]:
    if isinstance(place, type):
        raise ValueError(f"a is the class {place.__name__}; give a domain, such as vq.Ball([0, 0], radius=1)")
    if hasattr(place, "parts"):
        return place.parts()
    own = type(place).__module__.startswith(__package__.partition(".")[0] + ".")
    return [Part(place if own else OfCaller(place), 1.0)]


def _box(a: Any, b: Any, loc: Any, scale: Any) -> tuple[Region, Library]:
    """The box between limits, which may be functions."""
    if not any(isinstance(x, list | tuple) and any(map(callable, x)) for x in (a, b)):
        library = Library.of(a, b)
        return Box(a, b, library, loc, scale), library
    d = max(len(x) if isinstance(x, list | tuple) else np.size(x) for x in (a, b))
    low, high = (x if isinstance(x, list | tuple) or np.ndim(x) else [x] * d for x in (a, b))
    library = Library.of(0, 1)
    return IteratedBox(list(low), list(high), library, loc, scale), library
