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
from typing import Protocol

import numpy as np

from .._support.arrays import Array, Indices
from .._support.blas import one_blas_thread
from .global_fits import GlobalFits, degrees
from .kriging import Kriging, model
from .kriging_rules import strata_in_colours
from .polynomials import Intervals

#: Kriging is left where another model has less than this part of its squared error. What gains little may be luck.
HYSTERESIS = 0.5

#: How many samples of other groups are to be predicted to choose for a group, and the most groups that are taken for
#: it on either side, in cyclic order.
SCORED, PARTNERS = 60, 4


class Candidates(Protocol):
    """Models that share their algebra."""

    names: tuple[str, ...]

    def left_out(self, groups: tuple[int, ...], values: Array) -> Array:
        """What predictions without these groups miss of their values (fields, n), (models, fields, samples)."""

    def weights(self, group: int) -> Array:
        """What each sample counts (models, n) in n times the part of the estimate that belongs to a group."""


@dataclass(frozen=True)
class Choice:
    """An estimate by chosen models: for each set and field, weights and residuals of its samples, models by group."""

    weights: Array  # (sets, fields, n)
    residuals: Array  # (sets, fields, n)
    names: tuple[str, ...]
    chosen: Indices  # (sets, fields, groups)


class KrigingCandidate:
    """Kriging as the only one of its kind."""

    names: tuple[str, ...] = ("kriging",)

    def __init__(self, points: Array, group: Indices, axes: Sequence[Intervals], threads: int):
        n, d = points.shape
        self._kriging, self._group = Kriging(points, model(n, d), threads), group
        self._integrals = self._kriging.integrals(self._kriging.over_boxes(axes))
        self._values, self._applied = np.empty((0, n)), np.empty((0, n))

    def left_out(self, groups: tuple[int, ...], values: Array) -> Array:
        """B_uu^−1 (B f)_u."""
        if values is not self._values:
            self._values, self._applied = values, self._kriging.apply(values)
        (out,) = np.nonzero(np.isin(self._group, groups))
        return np.linalg.solve(self._kriging.blocks(out[None])[0], self._applied[:, out].T).T[None]

    def weights(self, group: int) -> Array:
        """v + B y with y_c = B_cc^−1 (1 − v_c)."""
        (out,) = np.nonzero(self._group == group)
        v = self._integrals[group]
        y = np.zeros((1, len(v)))
        y[0, out] = np.linalg.solve(self._kriging.blocks(out[None])[0], 1 - v[out])
        return v + self._kriging.apply(y)


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
    tried = degrees(n, d)
    found = []
    for x, f in zip(points, values, strict=True):
        candidates: list[Candidates] = [KrigingCandidate(x, group, axes, threads)]
        if tried:
            candidates.append(GlobalFits(x, group, axes, tried))
        names = tuple(itertools.chain.from_iterable(some.names for some in candidates))
        found.append(_choose(candidates, group, f))
    weights, residuals, chosen = (np.stack(x) for x in zip(*found, strict=True))
    return Choice(weights / n, residuals, names, chosen)


def _choose(candidates: Sequence[Candidates], group: Indices, values: Array) -> tuple[Array, Array, Indices]:
    """Weights and residuals (fields, n), and models (fields, groups), of one set."""
    groups = np.unique(group)
    squares = scores(candidates, groups, group, values)
    squares[0] *= HYSTERESIS
    best = np.argmin(squares, axis=0)
    weights, residuals = np.zeros_like(values), np.empty_like(values)
    for c in groups:
        alone = np.concatenate([some.left_out((c,), values) for some in candidates])
        counts = np.concatenate([some.weights(c) for some in candidates])
        weights += counts[best[:, c]]
        residuals[:, group == c] = alone[best[:, c], np.arange(len(values))]
    return weights, residuals, best


def scores(candidates: Sequence[Candidates], groups: Indices, group: Indices, values: Array) -> Array:
    """Σ_e Σ_{i∈e} (f_i − f̂(x_i))², with f̂ from the samples of neither c nor e: (models, fields, groups c).

    What cannot be predicted scores infinity.
    """
    models = sum(len(some.names) for some in candidates)
    squares = np.zeros((models, len(values), group.max() + 1))
    for c, e in partners(groups, len(group)):
        members = group[np.isin(group, (c, e))]
        missed = np.square(np.concatenate([some.left_out((c, e), values) for some in candidates]))
        squares[..., c] += missed[..., members == e].sum(axis=-1)
        squares[..., e] += missed[..., members == c].sum(axis=-1)
    squares[np.isnan(squares)] = np.inf
    return squares


def partners(groups: Indices, samples: int) -> list[tuple[int, int]]:
    """The pairs of groups that are left out together: each with so many on either side as make :data:`SCORED` samples.

    Of fewer than three groups none, as nothing would be left.
    """
    count = len(groups)
    if count < 3:
        return []
    reach = min(PARTNERS, count // 2, -(-SCORED * count // (2 * samples)))
    pairs = {frozenset((i, (i + step) % count)) for i in range(count) for step in range(1, reach + 1)}
    return sorted((int(groups[min(pair)]), int(groups[max(pair)])) for pair in pairs)
