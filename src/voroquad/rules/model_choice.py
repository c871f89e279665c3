"""A model of the integrand for each group of samples, chosen by what it predicts of the other groups.

The candidates are kriging models and polynomials of several degrees, fitted to all samples. For a group c, each
candidate predicts some other groups e, one by one, from the samples of neither; that of least squared error predicts c
from all others and is corrected by the samples of c. No value of c enters choice or prediction, not even by rounding,
so there is no bias: docs/theory.md, (13) and (30). Each component of an integrand chooses for itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._support.arrays import Array, Indices
from .._support.blas import one_blas_thread
from .global_fits import GlobalFits, degrees
from .kriging import model, smooth_models
from .kriging_rules import colour_groups, strata_in_colours
from .tiled_kriging import Tile, TiledKriging, spread_out, tiles

#: Kriging is left where another model has less than this part of its squared error. What gains little may be luck.
HYSTERESIS = 0.5

#: About how many samples of other groups are to be predicted to choose for a group, and the most groups that are taken
#: for it on either side, in cyclic order.
SCORED, PARTNERS = 60, 4

#: The kriging models, the one for all kinds of integrands first.
KRIGING = ("kriging", *smooth_models(1))

#: Samples that tell kriging models apart.
SCREENED = 384

#: Part of the values that kriging with little noise is taken to miss at least: it rounds more than the other models,
#: which are to predict what all of them predict to rounding, such as constants.
ROUNDED = 3e-12

#: Components of an integrand that are computed together: more take more memory.
FIELDS_AT_ONCE = 64


class Candidates(Protocol):
    """Models that share their algebra."""

    names: tuple[str, ...]

    def squares(self, pairs: Indices, values: Array) -> Array:
        """What predictions without two groups miss of the values (fields, n) of their samples.

        Squared and added up over either group of pairs (pairs, 2): (models, fields, pairs, 2).
        """

    def residuals(self, which: int, groups: Indices, values: Array) -> Array:
        """What predictions by one of the models, each without one of some groups, miss of its values: (fields, n).

        For samples of other groups the entries are 0.
        """

    def weights(self, which: int, groups: Indices) -> Array:
        """What each sample counts in n times the parts of the estimate that belong to groups: (groups, n).

        By one of the models.
        """


@dataclass(frozen=True)
class Choice:
    """An estimate by chosen models: for each set and field, weights and residuals of its samples, models by group."""

    weights: Array  # (sets, fields, n)
    residuals: Array  # (sets, fields, n)
    names: tuple[str, ...]
    chosen: Indices  # (sets, fields, groups)


@one_blas_thread
def choose_in_strata(points: Array, strata: tuple[int, ...], period: int, values: Array, threads: int) -> Choice:
    """Leave-one-out with one sample per stratum, by a model for each colour and field.

    Parameters
    ----------
    points : ndarray, (sets, n, d)
        Sets, each in C order of its strata.
    strata : tuple of int
        Numbers of strata along each axis.
    period : int
        Of the colours; samples of different colours are independent.
    values : ndarray, (sets, fields, n)
        Of integrands, at the samples.
    threads : int
        Number of threads; the result does not depend on it.
    """
    n, d = points.shape[1:]
    group, axes = strata_in_colours(strata, period)
    groups = colour_groups(strata, period)
    tried = degrees(n, d)
    weights, residuals = np.empty_like(values), np.empty_like(values)
    chosen = np.empty((*values.shape[:2], len(groups.members)), dtype=np.intp)
    for s, x in enumerate(points):
        candidates: list[Candidates] = [*kriging_models(x, tiles(strata, period), n, threads)]
        if tried:
            candidates.append(GlobalFits(x, groups, axes, tried))
        screening = kriging_models(x, [spread_out(strata, period, SCREENED)], SCREENED, threads)
        for first in range(0, values.shape[1], FIELDS_AT_ONCE):
            some = slice(first, first + FIELDS_AT_ONCE)
            of_kriging = _in_question(screening, len(groups.members), values[s, some])
            of_fits = np.ones((len(tried), *of_kriging.shape[1:]), dtype=bool)
            found = _choose(candidates, np.concatenate([of_kriging, of_fits]), group, values[s, some])
            weights[s, some], residuals[s, some], chosen[s, some] = found
    return Choice(weights / n, residuals, (*KRIGING, *(f"degree {p}" for p in tried)), chosen)


def kriging_models(points: Array, parts: Sequence[Tile], density: int, threads: int) -> list[TiledKriging]:
    """What kriging may assume of the integrand, in the order of :data:`KRIGING`; fitted to parts of the strata.

    The density is the number of samples in the box if they were everywhere as close as in these parts.
    """
    assumed = (model(density, points.shape[1]), *smooth_models(density).values())
    return [TiledKriging(name, one, points, parts, threads) for name, one in zip(KRIGING, assumed, strict=True)]


def _in_question(screening: Sequence[TiledKriging], groups: int, values: Array) -> NDArray[np.bool_]:
    """Which kriging models (models, fields, groups) may predict values (fields, n), by field and group.

    All, where there are few samples. Else the one that is best, by the criterion of the final choice, on a part of the
    samples all over the box, whose cost is small.
    """
    found = np.ones((len(screening), len(values), groups), dtype=bool)
    if values.shape[1] <= SCREENED:
        return found
    pairs = partners(groups, SCREENED)
    judged = scores(np.concatenate([some.squares(pairs, values) for some in screening]), pairs, groups)
    found[:] = _least(judged) == np.arange(len(screening))[:, None, None]
    return found


def _choose(
    candidates: Sequence[Candidates], in_question: NDArray[np.bool_], group: Indices, values: Array
) -> tuple[Array, Array, Indices]:
    """Weights and residuals (fields, n), and models (fields, groups), of one set.

    Of the models of all candidates, those in question (models, fields, groups).
    """
    count = int(group.max()) + 1
    pairs = partners(count, len(group))
    judged = np.full(in_question.shape, np.inf)
    ends = np.cumsum([0, *(len(some.names) for some in candidates)])
    for first, end, some in zip(ends, ends[1:], candidates, strict=False):
        if in_question[first:end].any():
            judged[first:end] = scores(some.squares(pairs, values), pairs, count)
    smooth = judged[1 : len(KRIGING)]
    np.maximum(smooth, ROUNDED**2 * _squares_elsewhere(values, group, count), out=smooth)
    best = _least(np.where(in_question, judged, np.inf))
    weights, residuals = np.zeros_like(values), np.zeros_like(values)
    models = [(which, some) for some in candidates for which in range(len(some.names))]
    for number in np.unique(best).tolist():
        which, of = models[number]
        taken = best == number
        fields, groups = (np.flatnonzero(taken.any(axis=axis)) for axis in (1, 0))
        taken = taken[fields]
        weights[fields] += taken[:, groups] @ of.weights(which, groups)
        residuals[fields] += np.where(taken[:, group], of.residuals(which, groups, values[fields]), 0)
    return weights, residuals, best


def _squares_elsewhere(values: Array, group: Indices, count: int) -> Array:
    """Σ f² over the samples of all groups but one: (fields, groups).

    What a group's choice rests on must not know its values; a difference of sums would, by its rounding.
    """
    of_each = group == np.arange(count)[:, None]
    with np.errstate(over="ignore"):
        squares = np.square(values)
    by_group = np.where(of_each, squares[:, None], 0.0).sum(axis=-1)
    others: Array = np.where(np.eye(count, dtype=bool), 0.0, by_group[:, None]).sum(axis=-1)
    return others


def _least(judged: Array) -> Indices:
    """The model (fields, groups) of the least score (models, fields, groups); the first unless one is far better."""
    return np.argmin(np.concatenate([HYSTERESIS * judged[:1], judged[1:]]), axis=0)


def scores(squares: Array, pairs: Indices, count: int) -> Array:
    """Σ_e Σ_{i∈e} (f_i − f̂(x_i))², with f̂ from the samples of neither c nor e: (models, fields, groups c).

    From the squared errors (models, fields, pairs, 2) of pairs (c, e). What cannot be predicted scores infinity.
    """
    return _core.scores(np.ascontiguousarray(squares), pairs, count)


@lru_cache(maxsize=64)
def partners(count: int, samples: int) -> Indices:
    """The pairs (pairs, 2) of groups that are left out together: each judges the other.

    A group gets partners with about :data:`SCORED` samples in all: one, or the same number on either side in
    cyclic order. Of fewer than three groups none, as nothing would be left.

    Examples
    --------
    >>> from voroquad.rules.model_choice import partners
    >>> partners(9, 1024).tolist(), len(partners(9, 256)), len(partners(9, 128))
    ([[0, 1], [2, 3], [4, 5], [6, 7], [0, 8]], 9, 18)
    """
    if count < 3:
        return np.empty((0, 2), dtype=np.intp)
    wanted = round(SCORED * count / samples)
    if wanted <= 1:
        return np.array([((i, i + 1) if i + 1 < count else (0, i)) for i in range(0, count, 2)], dtype=np.intp)
    reach = min(PARTNERS, count // 2, -(-wanted // 2))
    pairs = {tuple(sorted((i, (i + step) % count))) for i in range(count) for step in range(1, reach + 1)}
    return np.array(sorted(pairs), dtype=np.intp)
