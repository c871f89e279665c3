"""Gradients: an integral as a weighted sum of the very arrays that func returned, so that it keeps their graph."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from array_api_compat import array_namespace, device

from .._support.arrays import Array
from .structures import Form

#: The arrays (..., n) that func returned in each call, in order
Tape = list[list[Any]]


@dataclass(frozen=True)
class WeightedCalls:
    """The weights by which an estimate sums what func returned in the calls from `begin` to `end` of a tape.

    ``weights`` are (fields, n), or (1, n) where all fields have the same. They are constants: where a rule chooses
    them by the values, they do not follow a change of these, and the derivative is as unbiased as the estimate.
    """

    begin: int
    end: int
    weights: Array


def has_gradient(values: Any) -> bool:
    """Whether an array of PyTorch or JAX remembers what it was computed from."""
    return bool(getattr(values, "requires_grad", False)) or is_traced(values)


def is_traced(values: Any) -> bool:
    """Whether it is a tracer of JAX."""
    jax = sys.modules.get("jax")
    return jax is not None and isinstance(values, jax.core.Tracer)


def without_gradient(values: Any) -> Any:
    """The numbers alone; ValueError if they are not known yet."""
    if hasattr(values, "detach"):  # PyTorch's
        return values.detach()
    if not is_traced(values):
        return values
    numbers = sys.modules["jax"].lax.stop_gradient(values)
    if is_traced(numbers):
        raise ValueError(
            "values of func have no numbers yet inside jax.jit or jax.vmap; call quad outside of them, or sum "
            "vq.weights(samples) times func there"
        )
    return numbers


def joined_points(points: Sequence[list[Any]]) -> list[Any]:
    """What func returned point by point, as if it had been called once."""
    leaves = zip(*points, strict=True)
    return [array_namespace(*parts).stack(list(parts), axis=-1) for parts in leaves]


def sums(terms: Sequence[WeightedCalls], tape: Tape, form: Form, plain: list[Any]) -> list[Any]:
    """The integrals of the arrays of a form that have gradients; in the places of the others what is `plain`."""
    found, start = list(plain), 0
    for leaf, shape in enumerate(form.shapes):
        size = form.size(leaf)
        if has_gradient(tape[0][leaf]):
            if form.is_complex[leaf]:
                raise ValueError(
                    "complex values of func have no gradients in quad; return their real and imaginary parts instead"
                )
            rows = slice(start, start + size)
            parts = [_sum(t, [call[leaf] for call in tape[t.begin : t.end]], rows, shape) for t in terms]
            found[leaf] = sum(parts[1:], start=parts[0])
        start += size
    return found


def _sum(terms: WeightedCalls, values: list[Any], rows: slice, shape: tuple[int, ...]) -> Any:
    """Σ w f over the points of all calls, in the library of f."""
    xp = array_namespace(*values)
    joined = xp.concat(values, axis=-1) if len(values) > 1 else values[0]
    w = terms.weights
    w = w if len(w) == 1 else w[rows].reshape(*shape, -1)
    factor = xp.asarray(w.reshape(-1) if not shape else w, dtype=joined.dtype, device=device(joined))
    return xp.sum(factor * joined, axis=-1)
