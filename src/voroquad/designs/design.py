"""Designs: how the sets of a sampler are drawn, and which properties rules may rely on."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from .._support.arrays import Array
from . import multi_jittered, orthogonal, sequences
from .grids import corners, grid_shape, inside, largest_grid

#: Draws points (sets, n, d) of independent sets from (sets, n, d, rng).
Draw: TypeAlias = Callable[[int, int, int, np.random.Generator], Array]
#: The largest number of points, at most n, that a set can have in d dimensions, from (n, d).
LargestSize: TypeAlias = Callable[[int, int], int]


#: Those for which SciPy has directions of Sobol' sequences
DIMENSIONS_OF_SOBOL = 21_201


def _any_size(n: int, d: int) -> int:
    return n


def _fills_a_grid(n: int, d: int) -> int:
    return math.prod(largest_grid(n, d))


def _no_colours(d: int) -> int:
    return 0


@dataclass(frozen=True)
class Design:
    """Properties of the sets of a sampler.

    Attributes
    ----------
    name : str
        By which :func:`voroquad.sample` and :func:`voroquad.weights` know it.
    randomised : bool
        Each point is uniform in the unit box, and sets are independent of each other: plain means are unbiased.
    gridded : bool
        One point lies in each box of a near-cubic grid, a stratum.
    independent : bool
        The points of a set are independent; the bias function of their Voronoi cells is then known.
    period : callable
        Of the colours of strata, from d. Strata whose indices agree modulo the period along every axis have one
        colour, and only points of one colour depend on each other. 0: each stratum has a colour of its own.
    largest_size : callable
        The largest number of points, at most n, that a set can have in d dimensions, from (n, d). Raises
        ValueError where n is too small for any.
    most_dimensions : int or inf
        The largest dimension in which there are sets.
    """

    name: str
    randomised: bool = True
    gridded: bool = False
    independent: bool = False
    period: Callable[[int], int] = _no_colours
    largest_size: LargestSize = _any_size
    most_dimensions: float = math.inf

    def check_dimension(self, d: int) -> None:
        """Raise ValueError where there are no sets in d dimensions."""
        if d > self.most_dimensions:
            other = "sobol" if d <= DIMENSIONS_OF_SOBOL else "uniform"
            raise ValueError(
                f"{self.name!r} sets have at most d = {self.most_dimensions} dimensions, got d = {d}; use {other!r}"
            )

    @property
    def stratified(self) -> bool:
        """Whether each set has one random point in each stratum."""
        return self.gridded and self.randomised


def _uniform(sets: int, n: int, d: int, rng: np.random.Generator) -> Array:
    return rng.random((sets, n, d))


def _stratified(sets: int, n: int, d: int, rng: np.random.Generator) -> Array:
    strata = grid_shape(n, d)
    lower = corners(strata)
    points: Array = (lower + rng.random((sets, n, d))) / strata
    return inside(points, lower, strata)


def _regular(sets: int, n: int, d: int, rng: np.random.Generator) -> Array:
    strata = grid_shape(n, d)
    return np.broadcast_to((corners(strata) + 0.5) / strata, (sets, n, d)).copy()


UNIFORM = Design("uniform", independent=True)
STRATIFIED = Design("stratified", gridded=True, independent=True, largest_size=_fills_a_grid)
MULTI_JITTERED = Design("multi-jittered", gridded=True, period=multi_jittered.period, largest_size=_fills_a_grid)
REGULAR = Design("regular", randomised=False, gridded=True, largest_size=_fills_a_grid)
ORTHOGONAL = Design("orthogonal", largest_size=orthogonal.largest_size)

#: How :func:`voroquad.sample` draws each design. CONTRIBUTING.md says how to add one.
SAMPLERS: dict[Design, Draw] = {
    UNIFORM: _uniform,
    STRATIFIED: _stratified,
    MULTI_JITTERED: multi_jittered.points,
    REGULAR: _regular,
    Design("sobol", most_dimensions=DIMENSIONS_OF_SOBOL): sequences.sobol,
    Design("halton"): sequences.halton,
    Design("zero-two", most_dimensions=2): sequences.zero_two,
    ORTHOGONAL: orthogonal.points,
}

#: The designs that have a name in :func:`voroquad.sample`.
DESIGNS: dict[str, Design] = {design.name: design for design in SAMPLERS}

#: Designs of engines: SciPy's Latin hypercubes, and engines that the caller vouches for.
ENGINE_DESIGNS: dict[str, Design] = {name: Design(name) for name in ("latinhypercube", "engine")}


def design_of(name: str) -> Design:
    """The design of that name. An unknown name gives a design without any property."""
    return DESIGNS.get(name) or ENGINE_DESIGNS.get(name) or Design(name, randomised=False)
