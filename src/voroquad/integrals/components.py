"""Several integrals over the same points: their covariance, and the errors of sums and ratios."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._support.arrays import Array, Numbers
from .estimates import Estimate
from .structures import Form, mapped, part
from .units import norm, scaled

#: If a denominator is smaller than this number of its standard errors, the error of the ratio is not reliable.
FEWEST_ERRORS = 4.0


@dataclass(frozen=True)
class Linked:
    """Numbers that depend on the same samples, real or complex.

    Attributes
    ----------
    value : ndarray, (...)
        The numbers.
    deviations : ndarray, (..., m)
        Deviations D that make up the errors: the covariance of numbers k and l is Σ_m D_km conj(D_lm), plus rounding.
    rounding : ndarray, (...)
        Standard error by rounding, which is independent from number to number.
    """

    value: Numbers
    deviations: Numbers
    rounding: Array

    @property
    def error(self) -> Numbers:
        """Standard error (...); of complex numbers those of the real and of the imaginary part."""

        def of(part: Array) -> Array:
            return np.hypot(norm(part, axis=-1), self.rounding)

        if not np.iscomplexobj(self.value):
            return of(self.deviations)
        return of(self.deviations.real) + 1j * of(self.deviations.imag)

    def over(self, other: Linked) -> Linked:
        r"""The ratios q = self / other, which broadcast as arrays do.

        Notes
        -----
        The delta method: q = a/b deviates by (δa − q δb)/b to first order. Its bias is of second order, about
        q Var(b)/b² − Cov(a, b)/b², which is less than its error by the relative error of b.
        """
        q = self.value / other.value
        deviations = (self.deviations - q[..., None] * other.deviations) / other.value[..., None]
        rounding = np.hypot(self.rounding, np.abs(q) * other.rounding) / np.abs(other.value)
        return Linked(q, deviations, rounding)

    def combined(self, c: Numbers) -> Linked:
        """The sums Σ_k c_k self_k, (...), of coefficients c (..., M) and numbers (M,)."""
        return Linked(c @ self.value, c @ self.deviations, norm(np.abs(c) * self.rounding, axis=-1))

    @property
    def covariance(self) -> Numbers:
        """Of numbers (M,): E δ_k conj(δ_l), (M, M)."""
        return self.deviations @ self.deviations.conj().T + np.diag(np.square(self.rounding))

    @property
    def vague(self) -> bool:
        """Whether a number is 0 within a few of its errors."""
        return bool((np.abs(self.value) < FEWEST_ERRORS * np.abs(self.error)).any())


def scaled_deviations(estimate: Estimate) -> Array | None:
    """Deviations (fields, m) whose squares sum to those of the errors without rounding; None if there are none."""
    error, rounding = estimate.error, estimate.rounding
    own = np.sqrt(np.maximum(error - rounding, 0)) * np.sqrt(error + rounding)  # no square overflows
    deviations = np.ones((1, 1)) if len(own) == 1 else estimate.deviations
    if deviations is None:
        return None
    deviations = scaled(deviations, axis=1)
    size = np.sqrt(np.square(deviations).sum(axis=1))
    return deviations * np.divide(own, size, out=np.zeros_like(own), where=size > 0)[:, None]


@dataclass(frozen=True)
class Components:
    """The components of an estimate in the form of func's values.

    Attributes
    ----------
    form : Form
        What func returns.
    rows : Linked
        Its rows of real numbers, (fields,).
    """

    form: Form
    rows: Linked

    @classmethod
    def of(cls, estimate: Estimate, form: Form) -> Components | None:
        """Those of an estimate; None if the correlations of the errors of several components are unknown."""
        deviations = scaled_deviations(estimate)
        if deviations is None:
            return None
        return cls(form, Linked(estimate.mean, deviations, estimate.rounding))

    def linear(self, c: Any) -> Linked:
        """The sum of all components times c, which is of the shape or structure of the integral.

        Of arrays it may have further axes in front, one sum for each.
        """
        return self._flat().combined(self._coefficients(c))

    def covariance(self) -> Numbers:
        """Of the components of an array, (*shape, *shape); of a structure those of its arrays one after the other."""
        flat = self._flat().covariance
        return flat.reshape(self.form.shapes[0] * 2) if self.form.branch is None else flat

    def part(self, name: str, where: Any) -> Linked:
        """A component: an index of an array, a key of a dict, or a tuple of a key and what follows within it.

        `name` is the argument that errors name.
        """
        try:
            found = [part(self.form.assemble(x), where) for x in (self.rows.value, self.rows.deviations)]
            rounding = part(self.form.assemble(self.rows.rounding), where)
        except (KeyError, IndexError, TypeError) as error:
            raise ValueError(f"{name} = {where!r} is no component: {type(error).__name__}: {error}") from None
        if not isinstance(found[0], np.ndarray | np.generic):
            raise ValueError(f"{name} = {where!r} holds several arrays; name one of them, as ('key', 0) does")
        return Linked(np.asarray(found[0]), np.asarray(found[1]), _size(rounding))

    def _flat(self) -> Linked:
        """All components one after the other, (M,)."""
        value, deviations, rounding = (
            np.concatenate([leaf.reshape(-1, *rows.shape[1:]) for leaf in self.form.leaves(rows)])
            for rows in (self.rows.value, self.rows.deviations, self.rows.rounding)
        )
        return Linked(value, deviations, _size(rounding))

    def _coefficients(self, c: Any) -> Numbers:
        """The coefficients (..., M) of the flat components."""
        indices = self.form.assemble(np.zeros(len(self.rows.value)))
        try:
            found: list[Numbers] = []
            mapped(lambda leaf, given: found.append(_flattened(np.asarray(given), leaf.shape)), indices, c)
            return np.concatenate(found, axis=-1)
        except (KeyError, TypeError, ValueError, IndexError) as error:
            shapes = ", ".join(map(str, self.form.shapes))
            raise ValueError(f"c must be of the integral's shape or structure ({shapes}); {error}") from None


def _size(rounding: Numbers) -> Array:
    """Error of either part of a complex number by rounding, at most."""
    rounding = np.asarray(rounding)
    return np.maximum(rounding.real, rounding.imag) if np.iscomplexobj(rounding) else rounding


def _flattened(c: Numbers, shape: tuple[int, ...]) -> Numbers:
    """Coefficients (..., *shape) as (..., size)."""
    extra = c.ndim - len(shape)
    if extra < 0 or c.shape[extra:] != shape:
        raise ValueError(f"got shape {c.shape}")
    return c.reshape(*c.shape[:extra], -1)
