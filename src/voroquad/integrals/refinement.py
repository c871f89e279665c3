"""Tolerance mode: sets of growing size until the error is small enough."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from .._support.arrays import Array
from .diagnostics import Diagnoses, diagnosis
from .estimates import Estimate
from .kept import Trials
from .watch import Watch

#: Part of the tolerance that a set must meet to end the refinement, since the error of the next set may be larger.
SAFETY = 0.7

#: An error counts as rounding if rounding alone is at least this part of it.
MOSTLY = 0.7


@dataclass(frozen=True)
class Tolerance:
    """Half the width of the 95 % interval that is small enough: at most max(atol, rtol |I|)."""

    rtol: float
    atol: float

    def excess(self, estimate: Estimate) -> Array:
        """Half the interval over what is allowed, (fields,); infinite where one is not a number."""
        half = _half_interval(estimate)
        allowed = np.maximum(self.atol, self.rtol * np.abs(estimate.mean))
        ratio = np.divide(half, allowed, out=np.where(half == 0, 0.0, np.inf), where=allowed > 0)
        return np.nan_to_num(ratio, nan=np.inf, posinf=np.inf)


def tolerance(rtol: Any, atol: Any) -> Tolerance:
    """The tolerance that the arguments ask for; ValueError where one is no number of at least 0."""
    for name, value in (("rtol", rtol), ("atol", atol)):
        if not isinstance(value, int | float | np.integer | np.floating) or value is True or not 0 <= value < math.inf:
            raise ValueError(f"{name} must be a number of at least 0, got {value!r}")
    if rtol == 0 and atol == 0:
        raise ValueError("rtol and atol are both 0, which no error meets; give one, for example rtol=1e-6")
    return Tolerance(float(rtol), float(atol))


def refine(
    estimate: Callable[[int], Estimate],
    wanted: Tolerance,
    n: int,
    most: int,
    dimension: int,
    diagnoses: Diagnoses,
    watch: Watch[Estimate],
    rounds: Trials | None = None,
) -> Estimate:
    """Estimates from independent sets, larger and larger, until one meets the tolerance; then a last one.

    The set that ends the refinement was selected by its values, so its own estimate is biased. It only determines the
    size. Value and error come from one more set of that size, which is independent of all before and hence unbiased.
    All sets are counted in `n` of the result.

    Sets that do not resolve the integrand, such as those whose values are all 0, meet no tolerance. An integral that is
    not finite, or an error that is rounding, ends the refinement, since more points do not help.

    Parameters
    ----------
    estimate : callable
        Takes the largest number of evaluations, draws a fresh set.
    wanted : Tolerance
        What to meet.
    n : int
        Evaluations of the first set.
    most : int
        Evaluations of all sets together.
    dimension : int
        Rough integrands gain N^(−½−1/d) or so; that predicts the next size.
    diagnoses : Diagnoses
        Where to add warnings. The warning that an integral of 0 meets no rtol is added after two such sets.
    watch : Watch
        Gets the estimate of each round.
    rounds : Trials, optional
        Those that calls with other tolerances have made. Each is a trial here, the last of such a call too: it selects
        the size, and the estimate is that of a set which no call has seen. One that its call has not completed is
        passed over where it does not fit or the trials before it are enough.

    Raises
    ------
    ValueError
        The trials of other calls leave no room for a set of the first size; before any evaluation.
    """
    rounds = rounds or Trials()
    _check_room(rounds.planned(n, most), n, most)
    spent, zeros, first, done = 0, 0, n, False
    trials: list[Estimate] = []
    while True:
        size = rounds.of_others(0 if done else most - spent - first)
        if size is None:
            if done or 2 * n > most - spent:
                break
            rounds.begin(n, last=False)
        else:
            n = size
        trial = estimate(n)
        rounds.end(trial.n)
        trials.append(trial)
        watch.finish(trial)
        spent += trial.n
        excess = wanted.excess(trial)
        room = (most - spent) // 2
        open_ = excess > SAFETY
        met = trial.resolved and not open_.any()
        done = met or room <= n or not np.isfinite(trial.mean).all() or _only_rounding(trial, open_)
        if done:
            continue
        zeros = zeros + 1 if trial.resolved and _is_zero(wanted, trial) else 0
        if zeros == 2:
            diagnoses.add(diagnosis("give-atol"))
        worst = float(excess.max()) if trial.resolved else math.inf
        growth = float(np.clip((worst / 0.5) ** (1 / (0.5 + 1 / dimension)), 2, 16))
        n = min(math.ceil(n * growth), room)
    _check_room(spent, first, most)
    n = min(n, most - spent)
    rounds.begin(n, last=True)
    last = estimate(n)
    rounds.end(last.n)
    last = replace(last, n=spent + last.n, trials=(*trials, last))
    _judge(wanted, last, most, diagnoses)
    return last


def _check_room(spent: int, first: int, most: int) -> None:
    """Raise ValueError where rounds of other calls leave no room for a set of the first size."""
    if spent and most - spent < first:
        raise ValueError(
            f"max_evaluations must be at least {spent + first} with the {spent} evaluations of sets that other calls "
            f"began in the store, got {most}"
        )


def _judge(wanted: Tolerance, last: Estimate, most: int, diagnoses: Diagnoses) -> None:
    """Add the reasons why the last estimate does not meet the tolerance, if it does not."""
    excess = wanted.excess(last)
    if not np.isfinite(last.mean).all() or excess.max() <= 1:
        return
    if last.resolved and _is_zero(wanted, last):
        diagnoses.add(diagnosis("give-atol"))
    kind = "rounding" if _only_rounding(last, excess > 1) else "tolerance"
    times = float(f"{excess.max():.3g}")
    diagnoses.add(diagnosis(kind, times_too_wide=times, evaluations=last.n, of_at_most=most))


def _half_interval(estimate: Estimate) -> Array:
    """Half the width of the 95 % interval."""
    return float(stdtrit(estimate.degrees_of_freedom, 0.975)) * estimate.error


def _is_zero(wanted: Tolerance, estimate: Estimate) -> bool:
    """Whether a component that only rtol is asked of is 0 within its interval."""
    return wanted.atol == 0 and bool((np.abs(estimate.mean) <= _half_interval(estimate)).any())


def _only_rounding(estimate: Estimate, which: NDArray[np.bool_]) -> bool:
    """Whether the errors of these components are rounding, which more points do not reduce."""
    return bool((which & np.isfinite(estimate.error)).any()) and bool(
        (estimate.rounding >= MOSTLY * estimate.error)[which].all()
    )
