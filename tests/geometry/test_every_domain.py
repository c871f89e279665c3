"""What must hold for the cells of any points in every kind of domain.

A short run is part of the suite; HYPOTHESIS_PROFILE=long draws 20 000 sets for each test.
"""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest
from any_domains import KINDS, MAKE, Case, any_domain
from hypothesis import given

import voroquad as vq

OFFERED = tuple(kind for kind in KINDS if kind != "polygon" or importlib.util.find_spec("shapely"))


def cells_of(case: Case) -> vq.Cells:
    return vq.cells(case.points, **case.arguments)


@given(any_domain(OFFERED))
def test_measures_are_shares_of_the_domain(case):
    measures = cells_of(case).measures
    assert np.isfinite(measures).all()
    assert (measures >= 0).all()
    assert abs(measures.sum() - case.whole) <= 1e-12 * case.whole
    sites, site = np.unique(np.asarray(case.points, dtype=float), axis=0, return_inverse=True)
    least, most = np.full(len(sites), np.inf), np.zeros(len(sites))
    np.minimum.at(least, site.ravel(), measures)
    np.maximum.at(most, site.ravel(), measures)
    assert (least == most).all(), "points that coincide share equally"


@given(any_domain(OFFERED))
def test_one_and_two_points(case):
    """The first point, and the first two."""
    for n in (1, 2):
        few = Case(case.kind, case.points[:n], case.arguments, case.whole)
        assert cells_of(few).measures.sum() == pytest.approx(case.whole, rel=1e-12)


@given(any_domain(OFFERED))
def test_weights_are_the_measures(case):
    points = case.points if len(case.points) >= case.points.shape[1] else case.points[None]
    np.testing.assert_array_equal(vq.weights(points, **case.arguments).ravel(), cells_of(case).measures)


@given(any_domain(tuple(kind for kind in OFFERED if kind not in ("box", "lattice"))))
def test_places_are_in_the_cells_of_the_nearest_points(case):
    """By brute force; tests of the box and of lattices have their own, which know images."""
    if any(np.atleast_1d(case.arguments.get("periodic", False))):
        return
    cells = cells_of(case)
    places = (
        np.concatenate([case.points, (case.points + case.points[:1]) / 2]) if case.kind != "polygon" else case.points
    )
    found = cells.locate(places)
    distance = np.linalg.norm(cells.points - np.asarray(places, dtype=float)[:, None], axis=-1)
    size = np.abs(places).max() + case.whole ** (1 / places.shape[1])
    rounding = np.finfo(case.points.dtype).eps * size
    assert (distance[np.arange(len(places)), found] <= distance.min(axis=1) * (1 + 1e-12) + 32 * rounding).all()


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("kind", OFFERED)
def test_places_that_are_no_numbers_are_refused(kind, bad):
    case = some_case(kind)
    points = np.array(case.points, dtype=float)
    points[1, 0] = bad
    with pytest.raises(ValueError, match=r"points\[1\]") as error:
        vq.cells(points, **case.arguments)
    assert "\n" not in str(error.value)
    masked = np.ma.masked_array(case.points, np.arange(points.size).reshape(points.shape) == 1)
    with pytest.raises(ValueError, match="points must not be masked"):
        vq.cells(masked, **case.arguments)
    with pytest.raises(ValueError, match="points must hold at least one point"):
        vq.cells(points[:0], **case.arguments)


def some_case(kind: str) -> Case:
    """A few points of a domain of a kind."""
    d = 2 if kind == "polygon" else 3
    return MAKE[kind](np.random.default_rng(3).random((6, d)), np.random.default_rng(4))
