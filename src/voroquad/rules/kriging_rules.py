"""Unbiased rules by kriging: each group of samples corrects what the others predict.

With f̂^(−c) predicted from the samples of all groups but c, and μ_c the sum of the distributions of the samples of c,

    Î = 1/N Σ_c [ ∫ f̂^(−c) dμ_c + Σ_{i∈c} (f_i − f̂^(−c)(x_i)) ]

has the mean 1/N Σ_c ∫ f dμ_c = ∫ f, whatever the prediction. A group is a colour of strata, an independent
sample, or a replicate. As weights, w = 1/N (Σ_c v_c + B y), with v_c the integrals of the prediction from all
samples and y_c = B_cc^−1 (1 − v_c): docs/theory.md, (20) and (21).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.arrays import Array, Indices
from .._support.blas import one_blas_thread
from .groups import Groups
from .kriging import Kriging, Measures, Model, model
from .polynomials import Intervals

#: Largest number of samples in one prediction, whose cost grows with their cube. Further samples only correct it.
MOST = 2048

#: Period of the colours of independent strata that are too many for one prediction.
COLOURS_OF_MANY = 2

#: Samples per term of the drift for independent samples. With fewer, weights beside wide gaps would be huge.
INDEPENDENT_PER_TERM = 20

#: Largest number of covariances of sets that are predicted together.
TOGETHER = 2**18


@one_blas_thread
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
    if n == 1:  # no other sample predicts
        return np.ones((sets, 1)), values
    weights, residuals = np.full((sets, n), 1 / n), np.empty_like(values)
    members = predicting(strata)
    others = np.setdiff1d(np.arange(n), members)
    colour, axes = strata_in_colours(strata, period or (COLOURS_OF_MANY if len(others) else 0))
    group, assumed = colour[members], model(len(members), d)
    alone = ((s, Kriging(points[s, members], assumed, threads)) for s in range(sets))
    for one, kriging in alone if len(others) else _predictions(points, assumed, threads):
        f = values[one]
        left_out = kriging.leave_out(group, kriging.apply(f[..., members]))
        residuals[one][..., members] = left_out
        measures = kriging.over_boxes(axes)
        for c in np.unique(colour[others]):
            # Samples that predict nothing are subtracted from what their colour's prediction is integrated over
            known = f[..., members] - np.where(group == c, left_out, 0.0)
            for some in _pieces(others[colour[others] == c]):
                at = kriging.at_points(points[one][some])
                residuals[one][..., some] = f[..., some] - kriging.integrate(at, known)
                measures.take_away(c, at)
        integrals = kriging.integrals(measures)
        missing = 1 - integrals[..., group, np.arange(len(group))]
        y = kriging.leave_out(group, missing[..., None, :])
        weights[one][..., members] = (integrals.sum(axis=-2) + kriging.apply(y)[..., 0, :]) / n
    return weights, residuals


def predicting(strata: tuple[int, ...]) -> Indices:
    """The strata whose samples predict: all, or :data:`MOST` of them, those that a Halton sequence meets first.

    Examples
    --------
    >>> from voroquad.rules.kriging_rules import predicting
    >>> len(predicting((8, 8, 8))), len(predicting((16, 16, 16)))
    (512, 2048)
    """
    n = math.prod(strata)
    if n <= MOST:
        return np.arange(n)
    from scipy.stats import qmc

    met = qmc.Halton(len(strata), scramble=False).random(16 * MOST) * strata
    numbers = np.ravel_multi_index(tuple(met.astype(np.intp).T), strata)
    first = np.sort(np.unique(numbers, return_index=True)[1])[:MOST]
    return np.sort(numbers[first])


@lru_cache(maxsize=16)
def strata_in_colours(strata: tuple[int, ...], period: int) -> tuple[Indices, tuple[Intervals, ...]]:
    """The colour (n,) of each stratum, and the distributions of the samples, by colour.

    Colours are the indices modulo the period; without one, each stratum has its own.
    """
    parts = [period or k for k in strata]
    along = [np.arange(k) for k in strata]
    axes = tuple(Intervals(i / k, (i + 1) / k, i % q, q) for i, k, q in zip(along, strata, parts, strict=True))
    grid = np.meshgrid(*(axis.part for axis in axes), indexing="ij")
    colours = np.ravel_multi_index(tuple(part.ravel() for part in grid), parts)
    colours.flags.writeable = False  # it is remembered
    return colours, axes


@lru_cache(maxsize=16)
def colour_groups(strata: tuple[int, ...], period: int) -> Groups:
    """The strata of each colour."""
    colours, _ = strata_in_colours(strata, period)
    return Groups.of(colours, colours.max() + 1)


def _pieces(points: NDArray[Any]) -> list[NDArray[Any]]:
    """The points in parts, so that the covariances of a part with the samples fit in little memory."""
    return np.array_split(points, max(1, -(-len(points) // MOST)))


@one_blas_thread
def krige_independent(points: Array, threads: int) -> Array:
    """Leave-one-out of independent uniform samples (sets, n, d): weights (sets, n), each set's sum to 1."""
    sets, n, d = points.shape
    weights = np.ones((sets, n))
    if n == 1:
        return weights
    for batch, kriging in _predictions(points, model(n, d, INDEPENDENT_PER_TERM), threads):
        integral = kriging.integrals(kriging.over_boxes([_WHOLE_AXIS] * d))
        y = kriging.leave_out(np.arange(n), 1 - integral)
        weights[batch] = (integral + kriging.apply(y) / n)[:, 0]
    return weights


def _predictions(points: Array, assumed: Model, threads: int) -> Iterator[tuple[slice, Kriging]]:
    """Predictions from sets (sets, n, d), computed together for as many sets as fit in the processor's cache.

    Where the degree of the drift is lowered, each set is predicted by itself, so that no set depends on others.
    """
    sets, n, _ = points.shape
    size = max(1, TOGETHER // n**2)
    for first in range(0, sets, size):
        batch = slice(first, min(first + size, sets))
        kriging = Kriging(points[batch], assumed, threads)
        if not kriging.lowered:
            yield batch, kriging
            continue
        for s in range(batch.start, batch.stop):
            yield slice(s, s + 1), Kriging(points[s : s + 1], assumed, threads)


@one_blas_thread
def krige_replicates(points: Array, threads: int) -> Array:
    """Cross-fit of independent replicates (sets, n, d).

    Returns what the values of each replicate count in the estimate of each, (sets, sets, n), as
    :func:`voroquad.rules.cross_fit.replicate_shares` does. The prediction is from at most :data:`MOST` samples, the
    first of each replicate; the others only correct it.
    """
    sets, n, d = points.shape
    predicting, first = min(sets, MOST), min(n, max(1, MOST // sets))
    samples = points[:predicting, :first].reshape(-1, d)
    kriging = Kriging(samples, model(len(samples), d), threads)
    box = kriging.over_boxes([_WHOLE_AXIS] * d)
    rest = Measures(np.repeat(n * box.covariances, sets, axis=0), np.repeat(n * box.drift, sets, axis=0))
    for r, x in enumerate(points):
        for some in _pieces(x[first if r < predicting else 0 :]):
            rest.take_away(r, kriging.at_points(some))
    integrals = kriging.integrals(rest)
    group = np.repeat(np.arange(predicting), first)
    (y,) = kriging.leave_out(group, 1 - integrals[group, np.arange(len(group))][None])
    by_group = np.where(np.arange(predicting)[:, None] == group, y, 0.0)
    integrals[:predicting] += kriging.apply(by_group)
    shares = np.zeros((sets, sets, n))
    shares[np.arange(sets), np.arange(sets)] = 1 / n
    shares[:, :predicting, :first] = integrals.reshape(sets, predicting, first) / n
    # Summands of a constant all round alike: no rounding of the systems may be left in the sums of weights
    left = 1 - shares.sum(axis=(1, 2))
    shares[:, :predicting, :first] += left[:, None, None] / len(samples)
    return shares


#: The uniform distribution on [0, 1]
_WHOLE_AXIS = Intervals(np.zeros(1), np.ones(1), np.zeros(1, dtype=np.intp), 1)
