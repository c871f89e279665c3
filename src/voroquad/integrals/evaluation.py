"""Calls of func: on all points at once, in parts on several processes, or point by point."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.arrays import Array
from .._support.checks import real_numbers, refuse_masks
from .diagnostics import Diagnoses, diagnosis
from .gradients import Tape, has_gradient, joined_points
from .kept import KeptEvaluations
from .library import Library, to_numpy
from .structures import Answer, Branch, Form, check_shapes, names_of, take_apart

Map = Callable[..., Any]


class _UnusableValueError(Exception):
    """func did not return numbers. It is not a ValueError, since calling func point by point would not help."""


class Function:
    """func as rows of real numbers, one for each component; complex components have two.

    Parameters
    ----------
    func : callable
        ``func(x, *args, **kwargs)`` takes points x (d, n) and returns an array (..., n), or a dict or tuple of such.
    library : Library
        Whose arrays func gets.
    args, kwargs : tuple, mapping
        Further arguments of func.
    vectorized : bool
        Whether func takes (d, n). Else it is called with each point (d,).
    spread : callable
        ``spread(func, parts)`` calls func on each part, as the built-in map does.
    parts : int
        Number of parts that points are split into where their number is not limited.
    batch : callable
        The most points of a call of func, None for any number, from the number of points to evaluate.
    kept : KeptEvaluations, optional
        Where batches are kept, and those of a call before are found.
    """

    def __init__(
        self,
        func: Callable[..., Any],
        library: Library,
        args: tuple[Any, ...] = (),
        kwargs: Mapping[str, Any] | None = None,
        vectorized: bool = True,
        spread: Map = map,
        parts: int = 1,
        batch: Callable[[int], int | None] = lambda n: None,
        kept: KeptEvaluations | None = None,
    ):
        if not callable(func):
            raise TypeError(f"func must be callable, as lambda x: x[0] ** 2 is, got {func!r}")
        if not isinstance(args, tuple | list):
            raise TypeError(f"args must be a tuple of further arguments of func, such as (2.0,), got {args!r}")
        if not isinstance(kwargs, Mapping | None):
            raise TypeError(f"kwargs must be a mapping of names to arguments, such as {{'k': 2.0}}, got {kwargs!r}")
        self.library = library
        self.diagnoses = Diagnoses()
        #: Relative rounding error of func's values, of the dtype that it returns
        self.epsilon = float(np.finfo(np.float64).eps)
        self.form: Form | None = None
        #: What func returned, where gradients are to be kept
        self.tape: Tape = []
        self._call = _Call(
            func, args, kwargs or {}, library, self.tape, one_by_one=not vectorized, remote=spread is not map
        )
        self.batch, self._spread, self._parts, self._kept = batch, spread, parts, kept

    def batches(self, x: NDArray[Any]) -> Iterator[Array]:
        """Values (fields, m) at points x (d, n), batch after batch as they come."""
        n = x.shape[1]
        most = self.batch(n)
        pieces = np.array_split(x, min(self._parts, n), axis=1) if most is None else _cut(x, most)
        answers = self._answers(pieces) if self._kept is None else self._kept.completed(pieces, self._answers)
        try:
            if most is None:
                yield self._rows(_joined(list(answers)), x.shape)
                return
            for piece, answer in zip(pieces, answers, strict=True):
                yield self._rows(answer, piece.shape)
        except _UnusableValueError as error:
            raise ValueError(str(error)) from None

    def _rows(self, answer: Answer, shape: tuple[int, ...]) -> Array:
        """An answer for points of this shape as real numbers (fields, n)."""
        branch, leaves, epsilon = answer
        self.epsilon = max(self.epsilon, epsilon)
        check_shapes(branch, leaves, shape)
        form = Form.of(branch, leaves)
        self.form = form if self.form is None else _common(self.form, form)
        return self.form.rows(leaves)

    def _answers(self, pieces: list[NDArray[Any]]) -> Iterator[Answer]:
        """Those of the pieces (d, m), in order.

        Where func raises TypeError, ValueError or IndexError it is called point by point, as `scipy.integrate.qmc_quad`
        does. If it does not take a single point either, the first exception is the one to raise.
        """
        done = 0
        try:
            for answer in self._spread(self._call, pieces):
                yield answer
                done += 1
            return
        except (TypeError, ValueError, IndexError) as error:
            if self._call.one_by_one:
                raise
            self._try_one_point(pieces[done], error)
            reason = f"{type(error).__name__}: {error}"
        self._call.one_by_one = True
        self.diagnoses.add(diagnosis("point-by-point", shape=pieces[done].shape, reason=reason))
        yield from self._spread(self._call, pieces[done:])

    def _try_one_point(self, x: NDArray[Any], error: Exception) -> None:
        """Call func with the first point alone; raise `error`, which the points together raised, if that fails too."""
        kept = len(self.tape)
        self._call.one_by_one = True
        try:
            self._call(x[:, :1])
        except _UnusableValueError:
            raise
        except Exception as other:
            error.add_note(f"Called with the first point alone, func raised {type(other).__name__}: {other}")
            error.add_note("A point has the shape (d,), also for d = 1: write x[0] for its first coordinate")
            raise error from None
        finally:
            self._call.one_by_one = False
            del self.tape[kept:]


class _Call:
    """func on points of the caller's array library, in a worker process too."""

    def __init__(
        self,
        func: Callable[..., Any],
        args: tuple[Any, ...],
        kwargs: Mapping[str, Any],
        library: Library,
        tape: Tape,
        one_by_one: bool,
        remote: bool,
    ):
        self.func, self.args, self.kwargs, self.library, self._tape = func, args, kwargs, library, tape
        self.one_by_one, self.remote = one_by_one, remote

    def __call__(self, x: NDArray[Any]) -> Answer:
        try:
            if not self.one_by_one:
                shown = f"x of shape {x.shape}, the first point {x[:, 0].tolist()}"
                answer, leaves = self._numbers(self.library.array(x), shown)
                self._keep(leaves)
                return answer
            each = [
                self._numbers(point, f"x = {at.tolist()}")
                for point, at in zip(self.library.array(x.T), x.T, strict=True)
            ]
            points = [answer for answer, _ in each]
            if any(map(has_gradient, each[0][1])):
                self._keep(joined_points([leaves for _, leaves in each]))
            stacked = [np.stack(leaves, axis=-1) for leaves in zip(*(p[1] for p in points), strict=True)]
            return _one_structure(points), stacked, max(epsilon for _, _, epsilon in points)
        except StopIteration as error:  # which would silently end the map
            raise RuntimeError("func raised StopIteration") from error
        except Exception as error:
            if self.remote and not _survives_pickling(error):
                raise RuntimeError(f"func raised {type(error).__name__}: {error}") from None
            raise

    def _keep(self, leaves: list[Any]) -> None:
        """Put what func returned onto the tape, if any of it has a gradient."""
        if any(map(has_gradient, leaves)):
            if self.remote:
                raise _UnusableValueError("values of func lose their gradients in worker processes; leave out workers=")
            self._tape.append(leaves)

    def _numbers(self, x: Any, shown: str) -> tuple[Answer, list[Any]]:
        """func's values at x, and what it returned; an exception of func says where it was raised."""
        try:
            values = self.func(x, *self.args, **self.kwargs)
        except Exception as error:
            error.add_note(f"func was called with {shown}")
            raise
        branch, leaves = take_apart(values, single=self.one_by_one)
        numbers = [_as_numbers(leaf) for leaf in leaves]
        return (branch, [v for v, _ in numbers], max((epsilon for _, epsilon in numbers), default=0.0)), leaves


def _as_numbers(values: Any) -> tuple[NDArray[Any], float]:
    """Values of func as float64 or complex128, and the relative rounding error of their own dtype."""
    name = "values of func"
    try:
        given = to_numpy(values)
        if np.iscomplexobj(given):
            refuse_masks(name, given)
            numbers: NDArray[Any] = np.asarray(given, dtype=np.complex128)
        else:
            numbers = real_numbers(name, given)
    except ValueError as error:
        raise _UnusableValueError(str(error)) from None
    dtype = np.asarray(given).dtype
    return numbers, float(np.finfo(dtype if dtype.kind in "fc" else np.float64).eps)


def _cut(x: NDArray[Any], most: int) -> list[NDArray[Any]]:
    """Consecutive points (d, m), at most so many."""
    return [np.ascontiguousarray(x[:, i : i + most]) for i in range(0, x.shape[1], most)]


def _one_structure(answers: list[Answer]) -> Branch | None:
    """The structure that all have; ValueError where they differ."""
    first = answers[0][0]
    if any(branch != first for branch, _, _ in answers):
        raise _UnusableValueError("func must return the same structure at all points, got dicts or tuples that differ")
    return first


def _joined(answers: list[Answer]) -> Answer:
    """The answer for the points of all parts."""
    if len(answers) == 1:
        return answers[0]
    branch = _one_structure(answers)
    leaves = [np.concatenate(parts, axis=-1) for parts in zip(*(a[1] for a in answers), strict=True)]
    return branch, leaves, max(epsilon for _, _, epsilon in answers)


def _common(known: Form, new: Form) -> Form:
    """The form of the values so far, which those of another call must have; real ones may stand for complex ones."""
    if known.branch != new.branch:
        got = " after ".join(str(names_of(form.branch)) for form in (new, known))
        raise ValueError(f"func must return the same keys in each call, got {got}")
    same = known.shapes == new.shapes
    if not same or any(n and not k for k, n in zip(known.is_complex, new.is_complex, strict=True)):
        raise ValueError(
            "func must return values of the same shape and kind in each call, got "
            f"{new.shapes} after {known.shapes}{' (complex ones after real ones)' if same else ''}"
        )
    return known


def _survives_pickling(error: Exception) -> bool:
    """Whether an exception reaches the process that waits for it, rather than ending the pool."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return False
    return True
