"""Weights in domains other than a box: on a torus or lattice, in polygons, polytopes, balls and cylinders."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._support.arrays import Array
from .._support.checks import one_of, point_array, refuse_transposed
from ..designs.design import DESIGNS
from ..designs.sampling import SampleSet, as_sample_set
from ..geometry.bounds import Bounds, Periodic
from ..geometry.cells import cells
from ..geometry.lattice import Lattice
from ..geometry.probes import probed_measures
from .method import ORDER_ZERO, read_order

#: Dimensions in which cells are cut, and measures exact.
CUT = range(1, 4)


@dataclass(frozen=True, eq=False)
class Place:
    """The domain of points: what :func:`voroquad.weights` was given of `bounds`, `periodic`, `domain` and `cell`."""

    bounds: ArrayLike | None
    periodic: Periodic
    domain: Any
    cell: ArrayLike | None

    @property
    def is_box(self) -> bool:
        """Whether it is the unit box or another one, without periodic axes."""
        axes = np.asarray(self.periodic)
        return self.domain is None and self.cell is None and axes.dtype == np.bool_ and not axes.any()

    @cached_property
    def has_border(self) -> bool:
        """Whether cells are cut off anywhere."""
        return self.domain is not None or (self.cell is None and not np.all(np.asarray(self.periodic)))

    def __str__(self) -> str:
        if self.cell is not None:
            return "on a lattice (cell=)"
        if self.domain is not None:
            return "in a domain (domain=)"
        return "in a box with some periodic axes" if self.has_border else "on a torus (periodic=True)"


def weights_in(
    samples: SampleSet | ArrayLike, place: Place, order: int | str, debias: str, design: str | None, threads: int
) -> Array:
    """Weights (n,) or (sets, n) of points of a domain that is not a plain box; see :func:`voroquad.weights`."""
    points = _bare_points(samples, place)
    if isinstance(samples, SampleSet):
        design = as_sample_set(samples, design).design
    elif design is not None:
        one_of("design", design, DESIGNS)
    d = point_array(points).shape[-1]
    _refuse_without_rule(place, order, debias, design, d)
    if not isinstance(samples, SampleSet):
        refuse_transposed(points, name="samples")
    if d not in CUT:
        if place.domain is not None or place.cell is not None:
            raise ValueError(f"domain= and cell= need points with d = 1 to 3, got d = {d}; a box may have any d")
        return probed_in_box(points, Bounds(d, place.bounds, place.periodic), threads)
    found = cells(
        points, bounds=place.bounds, periodic=place.periodic, domain=place.domain, cell=place.cell, threads=threads
    )
    if design is not None and not place.has_border and not isinstance(samples, SampleSet):
        as_sample_set(_periods(points, place), design)  # one point in each stratum, for a design that has strata
    return found.measures


def _bare_points(samples: SampleSet | ArrayLike, place: Place) -> ArrayLike:
    if not isinstance(samples, SampleSet):
        return samples
    if place.cell is not None:
        remedy = f"map them, x = samples.points @ cell, and pass x with design={samples.design!r}"
    elif place.domain is not None:
        remedy = "pass bare points of the domain"
    elif place.bounds is not None:
        remedy = (
            f"map them, x = low + (high - low) * samples.points, and pass x with design={samples.design!r}, "
            "or leave out bounds="
        )
    else:
        return samples.points
    raise ValueError(f"the points of a {samples!r} are of the unit box; {remedy}")


def _refuse_without_rule(place: Place, order: int | str, debias: str, design: str | None, d: int) -> None:
    """Raise ValueError unless the measures of cells are the weights that `order` and `debias` name."""
    methods = read_order(order) or ORDER_ZERO
    unbiased = not place.has_border and d in CUT and (design == "uniform" or (design == "stratified" and d == 1))
    if methods == ORDER_ZERO and (debias == "none" or (debias == "auto" and unbiased)):
        return
    there_is = "debias='none' with order 0"
    if place.has_border:
        there_is += " (biased near the border); for unbiased rules use a box, bounds= alone, or quad, which maps boxes"
    else:
        there_is += ", any design; debias='auto' with order 0, d = 1 to 3, design uniform, or d = 1, design stratified"
        there_is += " (the same weights, unbiased without a correction since nothing ends there)"
    raise ValueError(
        f"no rule {place} for order={order!r}, debias={debias!r}, design {design or 'unknown'!r}, d = {d}; "
        f"there is: {there_is}"
    )


def _periods(points: ArrayLike, place: Place) -> Array:
    """Points of a torus or lattice as those of [0, 1)^d."""
    array = point_array(points)
    if place.cell is None:
        return Bounds(array.shape[-1], place.bounds, place.periodic).to_unit(points)
    periods = np.linalg.solve(Lattice(place.cell).vectors.T, array[..., None])[..., 0]
    return np.clip(periods - np.floor(periods), 0.0, np.nextafter(1.0, 0.0))


def probed_in_box(points: ArrayLike, box: Bounds, threads: int) -> Array:
    """Measures of cells in a box of any dimension, each axis periodic or not, counted by probes."""
    return box.volume * probed_measures(box.to_core(points), threads, *box.in_core)
