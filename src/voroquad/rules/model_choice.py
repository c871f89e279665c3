"""A model of the integrand for each group of samples, chosen by what it predicts of the other groups.

The candidates are kriging and polynomials of several degrees, fitted to all samples. For a group c, each candidate
predicts some other groups e, one by one, from the samples of neither; that of least squared error predicts c from all
others and is corrected by the samples of c. Choice and prediction know nothing of c, so the estimate is unbiased:
docs/theory.md, (13) and (30). Each component of an integrand chooses for itself.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np

from .._support.arrays import Array, Indices
from .._support.blas import one_blas_thread
from .global_fits import GlobalFits, degrees
from .kriging_rules import colour_groups, strata_in_colours
from .tiled_kriging import TiledKriging

#: Kriging is left where another model has less than this part of its squared error. What gains little may be luck.
HYSTERESIS = 0.5

#: About how many samples of other groups are to be predicted to choose for a group, and the most groups that are taken
#: for it on either side, in cyclic order.
SCORED, PARTNERS = 60, 4

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
        candidates: list[Candidates] = [TiledKriging(x, strata, period, threads)]
        if tried:
            candidates.append(GlobalFits(x, groups, axes, tried))
        for first in range(0, values.shape[1], FIELDS_AT_ONCE):
            some = slice(first, first + FIELDS_AT_ONCE)
            weights[s, some], residuals[s, some], chosen[s, some] = _choose(candidates, group, values[s, some])
    names = tuple(itertools.chain.from_iterable(some.names for some in candidates))
    return Choice(weights / n, residuals, names, chosen)


def _choose(candidates: Sequence[Candidates], group: Indices, values: Array) -> tuple[Array, Array, Indices]:
    """Weights and residuals (fields, n), and models (fields, groups), of one set."""
    pairs = partners(int(group.max()) + 1, len(group))
    judged = scores(np.concatenate([some.squares(pairs, values) for some in candidates]), pairs, group.max() + 1)
    judged[0] *= HYSTERESIS
    best = np.argmin(judged, axis=0)
    weights, residuals = np.zeros_like(values), np.zeros_like(values)
    models = itertools.chain.from_iterable(enumerate([some] * len(some.names)) for some in candidates)
    for model, (which, of) in enumerate(models):
        taken = best == model
        fields, groups = (np.flatnonzero(taken.any(axis=axis)) for axis in (1, 0))
        if len(fields):
            taken = taken[fields]
            weights[fields] += taken[:, groups] @ of.weights(which, groups)
            residuals[fields] += np.where(taken[:, group], of.residuals(which, groups, values[fields]), 0)
    return weights, residuals, best


def scores(squares: Array, pairs: Indices, count: int) -> Array:
    """Σ_e Σ_{i∈e} (f_i − f̂(x_i))², with f̂ from the samples of neither c nor e: (models, fields, groups c).

    From the squared errors (models, fields, pairs, 2) of pairs (c, e). What cannot be predicted scores infinity.
    """
    judged = np.zeros((count, *squares.shape[:2]))
    for (c, e), of_c, of_e in zip(pairs.tolist(), *np.moveaxis(squares, (3, 2), (0, 1)), strict=True):
        judged[c] += of_e
        judged[e] += of_c
    judged[np.isnan(judged)] = np.inf
    return np.moveaxis(judged, 0, -1)


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
