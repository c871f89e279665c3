"""Voronoi cells against independent implementations, on lattices and in boxes."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import pyvoro2
from scipy.spatial import ConvexHull, KDTree, Voronoi

import voroquad as vq


def mirrored_voronoi(points: np.ndarray, sides: np.ndarray | None = None) -> np.ndarray:
    """Cell measures by Qhull: points mirrored in all faces make the cells end there. The box begins at the origin.

    A point on a face is its own image: half of its cell lies in the box, of one on an edge a quarter.
    """
    images = points
    for axis in range(points.shape[1]):
        mirrored = [images]
        for face in (0.0, 1.0 if sides is None else sides[axis]):
            image = images[images[:, axis] != face]
            mirrored.append(image + 2 * (face - image[:, axis, None]) * np.eye(points.shape[1])[axis])
        images = np.concatenate(mirrored)
    diagram = Voronoi(images)
    regions = (diagram.regions[diagram.point_region[i]] for i in range(len(points)))
    volumes = np.array([ConvexHull(diagram.vertices[region]).volume for region in regions])
    return volumes / 2.0 ** ((points == 0) | (points == 1)).sum(axis=1)


def lattice(k: int, d: int, *, centred: bool) -> np.ndarray:
    """k^d cell centres, or (k + 1)^d corners of the cells."""
    ticks = (np.arange(k) + 0.5) / k if centred else np.arange(k + 1) / k
    return np.stack(np.meshgrid(*[ticks] * d, indexing="ij"), axis=-1).reshape(-1, d)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("n", [1, 2, 5, 60, 500])
def test_equals_qhull_on_random_points(d, n):
    points = np.random.default_rng(n).random((n, d))
    np.testing.assert_allclose(vq.cells(points).measures, mirrored_voronoi(points), rtol=0, atol=1e-12)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("kind", ["lattice", "line", "border", "near-faces", "jittered", "merged duplicates"])
def test_equals_qhull_on_special_points(d, kind):
    rng = np.random.default_rng(1)
    if kind == "lattice":
        points = lattice(6, d, centred=True)
    elif kind == "line":
        points = np.full((30, d), 0.3)
        points[:, 0] = rng.random(30)
    elif kind == "border":
        points = rng.random((60, d))
        points[np.arange(30), rng.integers(0, d, 30)] = rng.integers(0, 2, 30)
        points[:2] = [[0] * d, [1] * d]
    elif kind == "near-faces":
        points = rng.random((60, d))
        points[:30, 0] *= 1e-3
        points[30:, -1] = 1 - 1e-3 * points[30:, -1]
    elif kind == "jittered":
        points = lattice(6, d, centred=True) + rng.uniform(-0.5, 0.5, (6**d, d)) / 6
    else:
        points = rng.random((40, d))
        twice = np.concatenate([points, points[:15]])
        measures = vq.cells(twice).measures
        merged = measures[:40].copy()
        merged[:15] += measures[40:]
        np.testing.assert_allclose(merged, mirrored_voronoi(points), rtol=0, atol=1e-12)
        return
    np.testing.assert_allclose(vq.cells(points).measures, mirrored_voronoi(points), rtol=0, atol=1e-12)


@pytest.mark.parametrize("d", [2, 3])
def test_equals_qhull_on_clusters(d):
    rng = np.random.default_rng(2)
    points = np.concatenate([c + 1e-3 * rng.normal(size=(60, d)) for c in rng.uniform(0.2, 0.8, (5, d))])
    np.testing.assert_allclose(vq.cells(points).measures, mirrored_voronoi(points), rtol=0, atol=1e-9)


@pytest.mark.parametrize("kind", ["uniform", "cluster"])
@pytest.mark.parametrize("d", [2, 3])
def test_equals_voropp(d, kind):
    """voro++ by pyvoro2, which refuses points closer than 1e-5 and forgives itself some 1e-12."""
    points = np.random.default_rng(d).random((2000, d))
    if kind == "cluster":
        points[1000:] = 0.7 + 0.3 * points[1000:]
    unit = ((0.0, 1.0),) * d
    by_voropp = (
        pyvoro2.compute(points, domain=pyvoro2.Box(unit))
        if d == 3
        else pyvoro2.planar.compute(points, domain=pyvoro2.planar.Box(unit))
    )
    np.testing.assert_allclose(vq.cells(points).measures, by_voropp.cell_measures, rtol=0, atol=1e-12)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("periodic", [False, True])
def test_lattices_are_exact(d, periodic):
    k = {1: 1000, 2: 40, 3: 13}[d]
    np.testing.assert_allclose(vq.cells(lattice(k, d, centred=True), periodic=periodic).measures, k**-d, rtol=1e-12)
    if not periodic:  # with points on faces, edges and corners: half, quarter and eighth cells
        corners = lattice(k, d, centred=False)
        expected = np.prod(np.where((corners == 0) | (corners == 1), 0.5, 1.0) / k, axis=1)
        np.testing.assert_allclose(vq.cells(corners).measures, expected, rtol=1e-12)


def test_cells_of_a_box_that_is_no_cube_are_euclidean():
    """Scaled to the unit box the same points have other cells: 2.41 and 1.59 of 4."""
    points = np.array([[0.4, 0.1], [0.8, 0.9]])
    x, y = np.meshgrid((np.arange(2000) + 0.5) / 500, (np.arange(500) + 0.5) / 500, indexing="ij")
    nearest = (x - 0.4) ** 2 + (y - 0.1) ** 2 < (x - 0.8) ** 2 + (y - 0.9) ** 2
    cells = vq.cells(points, bounds=[(0, 4), (0, 1)])
    np.testing.assert_allclose(cells.measures, [4 * nearest.mean(), 4 - 4 * nearest.mean()], atol=2e-3)
    assert abs(vq.cells(points / [4, 1]).measures[0] * 4 - cells.measures[0]) > 0.5


BOXES = [[(0, 4), (0, 1)], [(-1, 3), (2, 2.5)], [(0, 7), (-1, 1), (1e6, 1e6 + 3)], [(-1e-3, 2e-3), (0, 0.01), (0, 1)]]


@pytest.mark.parametrize("bounds", BOXES)
@pytest.mark.parametrize("n", [2, 5, 60, 500])
def test_boxes_equal_qhull(bounds, n):
    low, high = np.array(bounds).T
    unit = np.random.default_rng(n).random((n, len(low)))
    measures = vq.cells(low + unit * (high - low), bounds=bounds).measures
    expected = mirrored_voronoi(unit * (high - low), high - low)
    np.testing.assert_allclose(measures, expected, rtol=0, atol=1e-9 * np.prod(high - low))


@pytest.mark.parametrize("periodic", [[True, False], [False, True], [True, True]])
def test_periodic_boxes_equal_voropp(periodic):
    bounds = [(-1.0, 3.0), (2.0, 3.5)]
    points = np.random.default_rng(3).random((400, 2)) * [4, 1.5] + [-1, 2]
    domain = pyvoro2.planar.RectangularCell(bounds, tuple(periodic))
    expected = pyvoro2.planar.compute(points, domain=domain).cell_measures
    np.testing.assert_allclose(vq.cells(points, bounds=bounds, periodic=periodic).measures, expected, atol=1e-11)


@pytest.mark.parametrize("periodic", list(itertools.product([False, True], repeat=3)))
def test_periodic_boxes_in_space_equal_voropp(periodic):
    bounds = [(-1.0, 3.0), (2.0, 3.5), (0.0, 1.0)]
    points = np.random.default_rng(3).random((300, 3)) * [4, 1.5, 1] + [-1, 2, 0]
    expected = pyvoro2.compute(points, domain=pyvoro2.OrthorhombicCell(bounds, periodic)).cell_measures
    np.testing.assert_allclose(vq.cells(points, bounds=bounds, periodic=periodic).measures, expected, atol=1e-11)


@pytest.mark.parametrize("bounds", [[(-3, 5)], *BOXES])
@pytest.mark.parametrize("periodic", [False, True])
def test_shapes_in_a_box_are_in_its_coordinates(bounds, periodic):
    low, high = np.array(bounds).T
    d, volume = len(low), np.prod(high - low)
    points = low + np.random.default_rng(4).random((50, d)) * (high - low)
    cells = vq.cells(points, bounds=bounds, periodic=periodic)
    if d == 1:
        ends = cells.intervals()
        sizes, corners = np.diff(ends)[:, 0], ends.reshape(-1, 1)
    elif d == 2:
        polygons = cells.polygons()
        sizes, corners = [ConvexHull(p).volume for p in polygons], np.concatenate(polygons)
    else:
        polyhedra = [np.concatenate(faces) for faces in cells.polyhedra()]
        sizes, corners = (
            [ConvexHull((p - low) / (high - low)).volume * volume for p in polyhedra],
            np.concatenate(polyhedra),
        )
    np.testing.assert_allclose(sizes, cells.measures, rtol=0, atol=1e-9 * volume)
    if not periodic:
        np.testing.assert_allclose(cells.measures @ cells.centroids / volume, (low + high) / 2, rtol=1e-12, atol=1e-15)
        np.testing.assert_array_equal(corners.min(axis=0), low)
        np.testing.assert_array_equal(corners.max(axis=0), high)
    np.testing.assert_array_equal(cells.bounds, bounds)
    assert cells.periodic is periodic


@pytest.mark.parametrize("d", [1, 2, 3])
def test_a_batch_in_a_box_equals_its_sets(d):
    bounds = [(-1, 3), (0, 2), (5, 6)][:d]
    low, high = np.array(bounds).T
    sets = low + np.random.default_rng(5).random((7, 20, d)) * (high - low)
    each = [vq.cells(s, bounds=bounds, periodic=[True] * d).measures for s in sets]
    np.testing.assert_array_equal(vq.cells(sets, bounds=bounds, periodic=True).measures, each)


@pytest.mark.parametrize("n", range(1, 20))
@pytest.mark.parametrize("d", [2, 3])
def test_batches_of_every_small_size(n, d):
    """Cells next to each other in an array, of every shape and number, do not disturb each other."""
    sets = np.random.default_rng(n).random((7, n, d))
    for points, measures in zip(sets, vq.cells(sets, threads=1).measures, strict=True):
        np.testing.assert_allclose(measures, mirrored_voronoi(points), rtol=0, atol=1e-12)


@pytest.mark.statistical
@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("periodic", [False, True])
def test_centroids_by_counting(d, periodic):
    """Means of the random points nearest to each site: normal errors, |z| > 5.5 once in 2.6e7 for each of 240."""
    rng = np.random.default_rng(d)
    points = rng.random((40, d))
    darts = rng.random((10**6, d))
    site = KDTree(points, boxsize=1 if periodic else None).query(darts)[1]
    offset = darts - points[site]
    offset -= np.round(offset) * periodic
    hits = np.bincount(site)[:, None]
    mean, square = (np.stack([np.bincount(site, o) for o in (offset**p).T], axis=1) / hits for p in (1, 2))
    error = np.sqrt((square - mean**2) / hits)
    assert np.abs((points + mean - vq.cells(points, periodic=periodic).centroids) / error).max() < 5.5
    assert np.abs(mean / error).max() > 20, "the sites themselves are told apart"


@pytest.mark.parametrize("d", [1, 2, 3])
def test_centroids_of_special_cells(d):
    k = 5
    points = lattice(k, d, centred=True)
    for periodic in (False, True):
        np.testing.assert_allclose(vq.cells(points, periodic=periodic).centroids, points, atol=1e-15)
    corners = lattice(k, d, centred=False)
    inward = 0.25 / k * ((corners == 0).astype(float) - (corners == 1))
    np.testing.assert_allclose(vq.cells(corners).centroids, corners + inward, atol=1e-15)
    twice = vq.cells(np.concatenate([points, points])).centroids
    np.testing.assert_allclose(twice, np.concatenate([points, points]), atol=1e-15)
