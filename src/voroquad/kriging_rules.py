"""Unbiased rules by kriging: each group of samples corrects what the others predict.

With f̂^(−c) predicted from the samples of all groups but c, and μ_c the sum of the distributions of the samples of c,

    Î = 1/N Σ_c [ ∫ f̂^(−c) dμ_c + Σ_{i∈c} (f_i − f̂^(−c)(x_i)) ]

has the mean 1/N Σ_c ∫ f dμ_c = ∫ f, whatever the prediction. A group is a colour of strata, an independent
sample, or a replicate. As weights, w = 1/N (Σ_c v_c + B y), with v_c the integrals of the prediction from all
samples and y_c = B_cc^−1 (1 − v_c): docs/theory.md, (23) and (24).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from .kriging import Intervals, Kriging, Measures, model

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

#: Samples that one prediction takes at most; its cost grows with their cube.
MOST = 2048

#: Covariances of sets that are predicted together.
TOGETHER = 2**18

#: Larger grids are predicted window by window. By dimension: strata along an axis that a window corrects
#: at most, and by how many it reaches beyond them on either side.
WINDOWS = {1: (128, 16), 2: (16, 4), 3: (6, 1), 4: (2, 1)}


def covers(strata: tuple[int, ...]) -> bool:
    """Whether a grid can be predicted, in one window or in several."""
    return math.prod(strata) <= MOST or len(strata) in WINDOWS


@dataclass(frozen=True)
class Window:
    """A box of strata: their indices along each axis, and those of the strata that are corrected in it."""

    strata: tuple[int, ...]
    inside: Sequence[Indices]
    corrected: Sequence[Indices]

    def members(self) -> Indices:
        """The numbers of its strata, in C order."""
        return np.ravel_multi_index(np.ix_(*self.inside), self.strata).ravel()

    def to_correct(self) -> NDArray[np.bool_]:
        """Which of its strata are corrected."""
        chosen = [np.isin(inside, c) for inside, c in zip(self.inside, self.corrected, strict=True)]
        return np.asarray(reduce(np.logical_and.outer, chosen)).ravel()

    def box(self) -> tuple[Array, Array]:
        """Its lower and upper corner."""
        k = np.asarray(self.strata)
        return np.array([i[0] for i in self.inside]) / k, np.array([i[-1] + 1 for i in self.inside]) / k

    def groups(self, period: int) -> tuple[Indices, list[Intervals]]:
        """The colour of each of its strata, and the distributions of the samples to correct, by colour."""
        parts = [period or len(i) for i in self.inside]
        first = [0 if period else i[0] for i in self.inside]
        colour = [(i - low) % q for i, low, q in zip(self.inside, first, parts, strict=True)]
        axes = [
            Intervals(c / k, (c + 1) / k, (c - low) % q, q)
            for c, k, low, q in zip(self.corrected, self.strata, first, parts, strict=True)
        ]
        return np.ravel_multi_index(np.ix_(*colour), parts).ravel(), axes


def windows(strata: tuple[int, ...]) -> Iterator[Window]:
    """The windows of a grid; each stratum is corrected in one of them.

    Examples
    --------
    >>> from voroquad.kriging_rules import windows
    >>> len(list(windows((8, 8, 8)))), len(list(windows((18, 18, 18))))
    (1, 27)
    """
    whole = [np.arange(k) for k in strata]
    if math.prod(strata) <= MOST:
        yield Window(strata, whole, whole)
        return
    patch, margin = WINDOWS[len(strata)]
    width = [min(patch + 2 * margin, k) for k in strata]
    for corrected in itertools.product(*(np.array_split(axis, -(-len(axis) // patch)) for axis in whole)):
        low = [min(max(c[0] - margin, 0), k - w) for c, k, w in zip(corrected, strata, width, strict=True)]
        yield Window(strata, [np.arange(i, i + w) for i, w in zip(low, width, strict=True)], corrected)


def krige_strata(
    points: Array, strata: tuple[int, ...], period: int, values: Array, threads: int
) -> tuple[Array, Array]:
    """Leave-one-out with one sample per stratum.

    Parameters
    ----------
    points : ndarray, (sets, n, d)
        Sets, each in C order of its strata.
    strata : tuple of int
        Numbers of strata along each axis.
    period : int
        Of the colours of dependent samples; 0 where all are independent.
    values : ndarray, (sets, fields, n)
        Of integrands, at the samples.
    threads : int
        Number of threads; the result does not depend on it.

    Returns
    -------
    weights : ndarray, (sets, n)
        They sum to 1.
    residuals : ndarray, (sets, fields, n)
        What each sample corrects, f_i − f̂^(−c)(x_i).
    """
    sets, n, d = points.shape
    if n == 1:  # nothing to predict from
        return np.ones((sets, 1)), values
    weights, residuals = np.zeros((sets, n)), np.empty_like(values)
    for window in windows(strata):
        members, chosen = window.members(), window.to_correct()
        group, axes = window.groups(period)
        assumed = model(len(members), d, n ** (-1 / d))
        for batch in _batches(sets, len(members)):
            kriging = Kriging(points[batch][:, members], assumed, window.box(), threads)
            integrals = kriging.integrals(kriging.over_boxes(axes))
            missing = chosen - integrals[:, None, group, np.arange(len(group))]
            predicted = kriging.apply(values[batch][..., members])
            solved = kriging.leave_out(group, np.concatenate([missing, predicted], axis=1))
            weights[batch, members] += (integrals.sum(axis=1) + kriging.apply(solved[:, :1])[:, 0]) / n
            residuals[batch, :, members[chosen]] = solved[:, 1:, chosen]
    return weights, residuals


def krige_independent(points: Array, threads: int) -> Array:
    """Leave-one-out of independent uniform samples (sets, n, d): weights (sets, n), each set's sum to 1."""
    sets, n, d = points.shape
    weights = np.ones((sets, n))
    for batch in _batches(sets, n) if n > 1 else ():
        kriging = Kriging(points[batch], model(n, d), _unit_box(d), threads)
        integral = kriging.integrals(kriging.over_boxes([_WHOLE_AXIS] * d))
        y = kriging.leave_out(np.arange(n), 1 - integral)
        weights[batch] = (integral + kriging.apply(y) / n)[:, 0]
    return weights


def _batches(sets: int, n: int) -> Iterator[slice]:
    """Sets of n samples to predict together: as many as fill the cache."""
    size = max(1, TOGETHER // n**2)
    return (slice(first, first + size) for first in range(0, sets, size))


def krige_replicates(points: Array, threads: int) -> Array:
    """Cross-fit of independent replicates (sets, n, d).

    Returns what the values of each replicate count in the estimate of each, (sets, sets, n), as
    :func:`voroquad.cross_fit.fit_replicates` does. The prediction is from at most :data:`MOST` samples, the
    first of each replicate; the others only correct it.
    """
    sets, n, d = points.shape
    predicting, first = min(sets, MOST), min(n, max(1, MOST // sets))
    samples = points[:predicting, :first].reshape(-1, d)
    kriging = Kriging(samples, model(len(samples), d), _unit_box(d), threads)
    box = kriging.over_boxes([_WHOLE_AXIS] * d)
    at = [kriging.at_points(x[first if r < predicting else 0 :]) for r, x in enumerate(points)]
    rest = Measures(
        n * box.covariances - np.vstack([x.covariances for x in at]), n * box.drift - np.vstack([x.drift for x in at])
    )
    integrals = kriging.integrals(rest)
    group = np.repeat(np.arange(predicting), first)
    (y,) = kriging.leave_out(group, 1 - integrals[group, np.arange(len(group))][None])
    by_group = np.where(np.arange(predicting)[:, None] == group, y, 0.0)
    integrals[:predicting] += kriging.apply(by_group)
    shares = np.zeros((sets, sets, n))
    shares[np.arange(sets), np.arange(sets)] = 1 / n
    shares[:, :predicting, :first] = integrals.reshape(sets, predicting, first) / n
    return shares


def _unit_box(d: int) -> tuple[Array, Array]:
    return np.zeros(d), np.ones(d)


#: The uniform distribution on [0, 1]
_WHOLE_AXIS = Intervals(np.zeros(1), np.ones(1), np.zeros(1, dtype=np.intp), 1)
