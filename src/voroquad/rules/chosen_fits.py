"""Leave-one-out with one sample per stratum, by models that the values of the integrand choose, and the error of a
single set."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from .._support.arrays import Array, Indices
from ..designs import multi_jittered
from ..designs.grids import grid_shape
from ..designs.sampling import SampleSet, SetKind
from .error_bars import ErrorBar, in_box, on_line
from .fit import ChosenFit
from .kriging_rules import MOST, strata_in_colours
from .line_fits import FEWEST, choose_on_line
from .method import Method
from .model_choice import choose_in_strata

#: Most strata on a line for which orders are chosen; it takes some 30 µs for each.
MOST_ON_LINE = 2**15

#: Highest dimension for which models are chosen: above, colours are too small.
HIGHEST_DIMENSION = 4


def chooses(kind: SetKind) -> bool:
    """Whether models are chosen for sets of a kind.

    Examples
    --------
    >>> import voroquad as vq
    >>> from voroquad.rules.chosen_fits import chooses
    >>> [chooses(vq.sample(design, n, 2).kind) for design, n in (("multi-jittered", 64), ("stratified", 64))]
    [True, False]
    """
    if kind.design != "multi-jittered" or kind.d > HIGHEST_DIMENSION:
        return False
    if kind.d == 1:
        return FEWEST <= kind.n <= MOST_ON_LINE
    return kind.n <= MOST and min(grid_shape(kind.n, kind.d)) >= multi_jittered.period(kind.d)


def fit_by_choice(samples: SampleSet, method: Method, threads: int, values: Array | None = None) -> ChosenFit:
    """The fit of multi-jittered sets to values (sets, fields, n).

    Raises ValueError without values, which choose the models.
    """
    if values is None:
        raise ValueError("values: the integrand's values choose the model, so there are no weights without them")
    assert samples.strata is not None
    return _on_line(samples, values) if samples.d == 1 else _by_colour(samples, samples.strata, threads, values)


def _on_line(samples: SampleSet, values: Array) -> ChosenFit:
    """By orders for each stratum."""
    points = samples.batch[..., 0]
    choice = choose_on_line(points, values)
    bar = partial(_bar_on_line, points[0], values[0], choice.around[0], choice.reference[0])
    orders = np.unique(choice.orders)
    chosen = told([f"order {p}" for p in orders], np.searchsorted(orders, choice.orders), "strata")
    return ChosenFit(choice.weights, choice.residuals, bar, chosen)


def _bar_on_line(points: Array, values: Array, around: Array, reference: Array, residuals: Array) -> ErrorBar:
    return on_line(points, values, residuals, around, reference)


def _by_colour(samples: SampleSet, strata: tuple[int, ...], threads: int, values: Array) -> ChosenFit:
    """By models for each colour."""
    period = multi_jittered.period(samples.d)
    choice = choose_in_strata(samples.batch, strata, period, values, threads)
    colours, _ = strata_in_colours(strata, period)
    bar = partial(in_box, samples.batch[0], strata, colours, values[0])
    return ChosenFit(choice.weights, choice.residuals, bar, told(choice.names, choice.chosen, "colours"))


def told(names: Sequence[str], chosen: Indices, parts: str) -> tuple[str, ...]:
    """What was chosen (sets, fields, parts), by field, the most frequent first.

    Examples
    --------
    >>> import numpy as np
    >>> from voroquad.rules.chosen_fits import told
    >>> told(["kriging", "degree 3"], np.array([[[1, 0, 1], [1, 1, 1]]]), "colours")
    ('degree 3 in 2 of 3 colours, kriging in 1', 'degree 3')
    """
    fields = np.moveaxis(chosen, 1, 0)
    return tuple(counted(names, np.bincount(field.ravel(), minlength=len(names)).tolist(), parts) for field in fields)


def counted(names: Sequence[str], counts: Sequence[int], parts: str) -> str:
    """The names that count, the most frequent first.

    Examples
    --------
    >>> from voroquad.rules.chosen_fits import counted
    >>> counted(["kriging", "degree 2", "degree 3"], [1, 0, 2], "colours")
    'degree 3 in 2 of 3 colours, kriging in 1'
    """
    first, *others = sorted((-count, k) for k, count in enumerate(counts) if count)
    if not others:
        return names[first[1]]
    rest = "".join(f", {names[k]} in {-count}" for count, k in others)
    return f"{names[first[1]]} in {-first[0]} of {sum(counts)} {parts}{rest}"
