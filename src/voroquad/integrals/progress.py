"""How a call of :func:`voroquad.quad` is followed, and how it ends before its time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .diagnostics import IntegrationWarning, diagnosis
from .estimates import Estimate
from .evaluation import Function
from .result import QuadResult
from .watch import Watch

#: Batches that the points of an estimate are evaluated in where a call is followed and `batch` is left out.
BATCHES = 64

#: Characters of a value beside the bar.
WIDEST = 40


@dataclass(frozen=True)
class Progress:
    """What a callback of :func:`quad` gets.

    Attributes
    ----------
    n_evaluations : int
        Number of points func was evaluated at so far.
    most : int
        The most that there will be.
    integral, standard_error : float, complex, array, or dict or tuple of these; or None
        The estimate so far, as :class:`QuadResult` has them; None where there is none yet.

    Examples
    --------
    >>> import numpy as np, voroquad as vq
    >>> seen = []
    >>> r = vq.quad(lambda x: np.exp(x[0]), 0, 1, rng=7, callback=seen.append)
    >>> [p.n_evaluations for p in seen][:3], seen[-1].integral == r.integral
    ([16, 32, 48], True)
    """

    n_evaluations: int
    most: int
    integral: Any = None
    standard_error: Any = None


class IntegrationInterrupted(KeyboardInterrupt):
    """Raised when Ctrl-C ends :func:`quad`. It is a KeyboardInterrupt.

    Attributes
    ----------
    n_evaluations : int
        Number of points func was evaluated at.
    result : QuadResult or None
        The estimate from these, with the warning ``"stopped"``; None where there is none yet.
    """

    def __init__(self, n_evaluations: int, result: QuadResult | None):
        known = "nothing is known yet" if result is None else f"the estimate so far is {result}"
        super().__init__(f"after {n_evaluations} evaluations, {known}")
        self.n_evaluations, self.result = n_evaluations, result


class Stop(Exception):
    """A callback ends the call."""


def batches(batch: int | None, n_points: int, followed: bool) -> Callable[[int], int | None]:
    """What gives the most points of a call of func, None for any number, from the number of those to evaluate."""
    if batch is not None or not followed:
        return lambda n: batch
    return lambda n: math.ceil(max(n, n_points) / BATCHES)


@contextmanager
def following(
    watch: Watch[Estimate], function: Function, callback: Callable[[Progress], Any] | None, bar: bool, most: int
) -> Iterator[None]:
    """Tell a callback and a bar, where they are wanted, after each batch of evaluations."""

    def now() -> Progress:
        found = watch.known()
        if found is None:
            return Progress(watch.n_evaluations, most)
        assert function.form is not None
        mean, error = (function.form.assemble(x, function.library.number) for x in (found.mean, found.error))
        return Progress(watch.n_evaluations, most, mean, error)

    with _shown(most) if bar else nullcontext() as show:
        if show is not None:
            watch.listeners.append(lambda: show(now()))
        if callback is not None:
            watch.listeners.append(lambda: _tell(callback, now()))
        yield


def _tell(callback: Callable[[Progress], Any], progress: Progress) -> None:
    """Call back; StopIteration and True end the integration, as in `scipy.optimize`."""
    try:
        answer = callback(progress)
    except StopIteration:
        raise Stop from None
    if isinstance(answer, bool | np.bool_) and answer:  # not any number: a callback may be the write of a file
        raise Stop


@contextmanager
def _shown(most: int) -> Iterator[Callable[[Progress], None]]:
    """A bar on standard error."""
    from .._support.progress import progress_bar  # rich takes a while to import

    with progress_bar(most) as advance:
        shown = 0

        def show(progress: Progress) -> None:
            nonlocal shown
            known = progress.integral is not None
            text = str(QuadResult(progress.integral, progress.standard_error, 0)) if known else ""
            advance(" ".join(text.split())[:WIDEST], progress.n_evaluations - shown, most)
            shown = progress.n_evaluations

        yield show


def ended(compute: Callable[[], Estimate], watch: Watch[Estimate], function: Function) -> QuadResult:
    """The result of what `compute` returns, or of what is known where a callback or Ctrl-C ends it before."""
    try:
        found = compute()
        watch.finish(found)
        with suppress(Stop):
            watch.tell()
    except Stop:
        return _stopped(watch, function) or _unknown(watch, function)
    except KeyboardInterrupt as error:
        raise IntegrationInterrupted(watch.n_evaluations, _stopped(watch, function)) from error
    for warning in _kept(found.warnings, function):
        function.diagnoses.add(warning)
    return QuadResult.of(found, function)


def _stopped(watch: Watch[Estimate], function: Function) -> QuadResult | None:
    """The result of what is known; None if that is nothing."""
    found = watch.known()
    if found is None:
        return None
    result = QuadResult.of(replace(found, n=watch.n_evaluations), function)
    last = diagnosis("stopped", rests_on=found.n)
    return replace(result, warnings=(*result.warnings, *_kept(found.warnings, function), last))


def _unknown(watch: Watch[Estimate], function: Function) -> QuadResult:
    """Not a number."""
    assert function.form is not None
    rows = np.full(len(function.form.partners()), np.nan)
    result = QuadResult.of(Estimate(rows, rows, np.zeros_like(rows), watch.n_evaluations, math.inf), function)
    return replace(result, warnings=(*result.warnings, diagnosis("stopped", rests_on=0)))


def _kept(warnings: tuple[IntegrationWarning, ...], function: Function) -> Iterator[IntegrationWarning]:
    """The warnings of components, from those of rows. A complex number is 0 where both of its parts are."""
    assert function.form is not None
    of_row = function.form.components()
    for warning in warnings:
        details = dict(warning.details)
        if "component" in details:
            details["component"] = of_row[details["component"]]
        if "components" in details:
            rows = set(details["components"])
            others = {c for row, c in enumerate(of_row) if row not in rows} if warning.kind == "zero" else set()
            details["components"] = sorted({of_row[row] for row in rows} - others)
            if not details["components"]:
                continue
        if warning.kind == "zero":
            details["of"] = len(set(of_row))
        yield diagnosis(warning.kind, **details)
