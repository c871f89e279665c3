"""What must hold for the cells of any points at all: drawn by Hypothesis from sets without general position.

A short run is part of the suite. The long one draws 20 000 sets for each test, 1.8·10⁵ in all:

    HYPOTHESIS_PROFILE=long python -m pytest tests/test_cells_any_points.py
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from any_points import any_set
from exact_cells import exact_measures
from hypothesis import example, given
from hypothesis import strategies as st

import voroquad as vq


def few(points: np.ndarray, most: tuple[int, int, int]) -> np.ndarray:
    """A few points of a set, by dimension: the exact measures take the d-th power of their number, d ≤ 3, for each."""
    return np.random.default_rng(0).permutation(points)[: most[points.shape[1] - 1]]


@given(any_set())
def test_the_exact_measures_are_shares_of_one(points):
    points = few(points, (10, 10, 5))
    assert exact_measures(points, periodic=False).sum() == pytest.approx(1, abs=1e-13)


@given(any_set())
def test_measures_are_those_of_exact_arithmetic(points):
    points = few(points, (50, 24, 7))
    np.testing.assert_allclose(vq.cells(points).measures, exact_measures(points, periodic=False), rtol=0, atol=1e-12)


@given(any_set())
@example(2.0**-53 * np.array([[1, 2**53 - 2], [1 / 4, 1 / 2], [7 / 8, 2**53 - 1]]))  # beside a seam
def test_torus_measures_are_those_of_exact_arithmetic(points):
    points = few(points % 1.0, (20, 5, 2))
    np.testing.assert_allclose(
        vq.cells(points, periodic=True).measures, exact_measures(points, periodic=True), rtol=0, atol=1e-12
    )


@st.composite
def any_box(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray, list[bool]]:
    """Points, bounds and periodic axes: boxes from slender to flat, from the origin, about it and far from it."""
    points = draw(any_set(max_size=30))
    n, d = points.shape
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    sides = 10.0 ** rng.integers(-3, 4, d) * np.where(rng.integers(2, size=d), 1, rng.random(d) + 0.1)
    kind = draw(st.sampled_from(["from the origin", "about the origin", "far"]))
    if kind == "about the origin":  # clusters at the origin keep their digits
        low, high = -sides, sides * rng.choice([1.0, 0.3], d)
        points = points * np.where(rng.integers(2, size=(n, d)), high, low)
        points[np.abs(points) < 1e-300 * sides.max()] = 0  # as docs/cells.md says
    else:
        low = sides * (rng.choice([-1, 1], d) * 10.0 ** rng.integers(0, 8, d)) if kind == "far" else 0 * sides
        high = low + sides
        points = low + points * sides
    periodic = rng.integers(2, size=d).astype(bool)
    top = np.where(periodic, np.nextafter(high, low), high)
    return np.clip(points, low, top), np.stack([low, high], axis=1), periodic.tolist()


@given(any_box())
def test_measures_in_any_box_are_those_of_exact_arithmetic(case):
    points, bounds, periodic = case
    points = few(points, (20, 8 if any(periodic) else 16, 3 if any(periodic) else 6))
    volume = np.prod(bounds[:, 1] - bounds[:, 0])
    np.testing.assert_allclose(
        vq.cells(points, bounds=bounds, periodic=periodic).measures,
        exact_measures(points, periodic, bounds),
        rtol=0,
        atol=1e-12 * volume,
    )


@given(any_box())
def test_measures_in_any_box_sum_to_its_volume(case):
    points, bounds, periodic = case
    cells = vq.cells(points, bounds=bounds, periodic=periodic)
    assert (cells.measures >= 0).all()
    assert cells.measures.sum() == pytest.approx(np.prod(bounds[:, 1] - bounds[:, 0]), rel=1e-12, abs=0)


@given(any_set(), st.booleans())
def test_measures_of_any_set_are_shares_of_one(points, periodic):
    points = points % 1.0 if periodic else points
    measures = vq.cells(points, periodic=periodic).measures
    assert np.isfinite(measures).all()
    assert (measures >= 0).all()
    assert abs(measures.sum() - 1) <= 1e-12
    _, site = np.unique(points, axis=0, return_inverse=True)
    order = np.argsort(site.ravel(), kind="stable")
    same = np.diff(site.ravel()[order]) == 0
    assert (np.diff(measures[order])[same] == 0).all(), "points that coincide share equally"


@given(any_set(), st.booleans())
def test_polygons_are_the_cells(points, periodic):
    points = np.resize(points, (len(points), 2)) % (1.0 if periodic else np.inf)
    shared = np.unique(points, axis=0, return_inverse=True, return_counts=True)
    cells = vq.cells(points, periodic=periodic)
    for i, (site, polygon) in enumerate(zip(points, cells.polygons(), strict=True)):
        corner = polygon - site
        after = np.roll(corner, -1, axis=0)
        cross = corner[:, 0] * after[:, 1] - corner[:, 1] * after[:, 0]
        assert (cross >= -1e-15).all(), "counter-clockwise around the site"
        assert 0.5 * cross.sum() / shared[2][shared[1].ravel()[i]] == pytest.approx(cells.measures[i], abs=1e-13)
        gaps = np.abs(polygon[:, None] - points)
        gaps = np.minimum(gaps % 1.0, 1 - gaps % 1.0) if periodic else gaps
        assert (np.linalg.norm(gaps, axis=2).min(axis=1) >= np.linalg.norm(corner, axis=1) - 1e-12).all()


@given(any_set(), st.booleans(), st.randoms(use_true_random=False))
def test_symmetries_of_the_box(points, periodic, random):
    points = points % 1.0 if periodic else points
    d = points.shape[1]
    axes = random.sample(range(d), d)
    image = points[:, axes].copy()
    exact = 1 - (1 - image) == image  # mirrored without rounding
    flip = exact.all(axis=0) & ((image > 0).all(axis=0) | (not periodic))
    image = np.where(flip, 1 - image, image)
    order = random.sample(range(len(points)), len(points))
    measures = vq.cells(points, periodic=periodic).measures
    np.testing.assert_allclose(vq.cells(image[order], periodic=periodic).measures, measures[order], rtol=0, atol=1e-13)


@given(any_set(), st.booleans(), st.lists(st.floats(0, 1, exclude_max=True), min_size=3, max_size=3))
def test_one_more_point_only_shrinks_other_cells(points, periodic, extra):
    points = points % 1.0 if periodic else points
    before = vq.cells(points, periodic=periodic).measures
    after = vq.cells(np.vstack([points, extra[: points.shape[1]]]), periodic=periodic).measures[:-1]
    assert (after <= before + 1e-13).all()


@given(any_set(), st.lists(st.integers(0, 2**20), min_size=3, max_size=3))
def test_torus_cells_move_with_their_points(points, shift):
    points = np.floor(points * 2**20) / 2**20 % 1.0  # so that shifts are exact
    moved = (points + np.array(shift[: points.shape[1]]) / 2**20) % 1.0
    np.testing.assert_allclose(
        vq.cells(moved, periodic=True).measures, vq.cells(points, periodic=True).measures, rtol=0, atol=1e-13
    )


@given(any_set(max_size=12))
def test_torus_cells_are_the_middle_cells_of_tiled_copies(points):
    points = np.floor(points * 2**20) / 2**20 % 1.0
    d = points.shape[1]
    tiles = np.array(list(itertools.product(range(4), repeat=d)))  # 4: a power of two scales exactly
    tiled = ((points + tiles[:, None]) / 4).reshape(-1, d)
    measures = vq.cells(tiled).measures.reshape(4**d, -1) * 4**d
    inner = [i for i, tile in enumerate(tiles) if ((tile == 1) | (tile == 2)).all()]
    for i in inner:
        np.testing.assert_allclose(measures[i], vq.cells(points, periodic=True).measures, rtol=0, atol=1e-12)
