"""Voronoi cells against an independent implementation, on lattices and on uneven sets, and how arrays go in and out."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest
import pyvoro2
from cpu_time import cpu_time
from scipy.spatial import ConvexHull, KDTree, Voronoi

import voroquad as vq
from voroquad import _core


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


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("n", [1, 2, 3, 10, 10**3, 10**5, pytest.param(10**6, marks=pytest.mark.slow)])
def test_measures_sum_to_one(d, periodic, n):
    measures = vq.cells(np.random.default_rng(n).random((n, d)), periodic=periodic).measures
    assert (measures > 0).all()
    assert abs(measures.sum() - 1) <= 1e-12


def clustered(kind: str, n: int, d: int) -> np.ndarray:
    rng = np.random.default_rng(7)
    if kind == "gaussian":
        return 0.5 + 1e-4 * rng.normal(size=(n, d))
    if kind == "cantor":
        return (2 * rng.integers(0, 2, (n, d, 30)) / 3.0 ** np.arange(1, 31)).sum(axis=-1)
    points = rng.random((n, d))
    if kind == "line":
        points[:, 1:] = 0.3
    elif kind == "plane":
        points[:, 0] = 0.3
    elif kind == "one place":
        points[:] = points[0]
    elif kind == "octaves":
        points = 2.0 ** -rng.integers(0, 1000, (n, d)).astype(float)
    return points


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("kind", ["gaussian", "cantor", "line", "plane", "one place", "octaves"])
def test_no_density_is_too_uneven(kind, d):
    measures = vq.cells(clustered(kind, 4000 if kind == "octaves" else 20_000, d)).measures
    assert (measures >= 0).all()
    assert abs(measures.sum() - 1) <= 1e-12


@pytest.mark.parametrize(("d", "free"), [(2, 1), (3, 1), (3, 2)])
@pytest.mark.parametrize("size", [1e-8, 1e-12])
def test_narrow_lines_and_planes_take_no_longer(d, free, size):
    """All their points are as far from a far vertex, to the last digit."""
    points = np.full((8000, d), 0.5)
    points[:, :free] = 0.3 + size * (np.random.default_rng(11).random((8000, free)) - 0.5)
    cells = vq.cells(points, periodic=True, threads=1)
    with cpu_time() as seconds:
        measures = cells.measures
    assert seconds() < 1.5  # 0.2, or more than 3 where each vertex meets all points
    assert abs(measures.sum() - 1) <= 1e-12


@pytest.mark.parametrize("k", [3, 7, 8, 9, 31, 63, 64, 65, 500, 2000])
@pytest.mark.parametrize("radius", [0.2, 1e-9])
def test_a_cell_with_any_number_of_edges(k, radius):
    angle = 2 * np.pi * (np.arange(k) + 0.1) / k
    around = 0.5 + radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    rest = np.random.default_rng(k).random((100, 2))
    points = np.vstack(
        [around[: k // 2], [[0.5, 0.5]], around[k // 2 :], rest[(np.abs(rest - 0.5) > 0.45).any(axis=1)]]
    )
    middle = vq.cells(points).measures[k // 2]
    assert middle == pytest.approx(k * np.tan(np.pi / k) * radius**2 / 4, rel=1e-12 if radius == 0.2 else 1e-5)


@pytest.mark.parametrize("n", range(1, 20))
@pytest.mark.parametrize("d", [2, 3])
def test_batches_of_every_small_size(n, d):
    """Cells next to each other in an array, of every shape and number, do not disturb each other."""
    sets = np.random.default_rng(n).random((7, n, d))
    for points, measures in zip(sets, vq.cells(sets, threads=1).measures, strict=True):
        np.testing.assert_allclose(measures, mirrored_voronoi(points), rtol=0, atol=1e-12)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("periodic", [False, True])
def test_points_a_hair_apart_on_a_face(d, periodic):
    """Their bisectors are one line but for rounding: walking around the cell must not go round twice."""
    rng = np.random.default_rng(9)
    x = rng.integers(0, 8, (200, d)) / 8
    x[:60, 0] = 10.0 ** -rng.uniform(1, 300, 60)
    assert abs(vq.cells(x, periodic=periodic).measures.sum() - 1) <= 1e-12


@pytest.mark.parametrize("d", [2, 3])
def test_clusters_about_a_seam(d):
    """Their points are a hair apart and nearly 1: turns must not take the digits of what is between them."""
    rng = np.random.default_rng(10)
    x = (rng.random((500, 12, d)) - 0.5) * 10.0 ** -rng.integers(15, 19, (500, 1, 1))
    x = np.where(x < 0, np.minimum(1 + x, 1 - 2.0**-53), x)
    assert np.abs(vq.cells(x, periodic=True).measures.sum(axis=1) - 1).max() <= 1e-12


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("place", [[0, 0.3, 0.2], [0.004, 0.004, 0.004], [0.5, 0.5, 0.5], [0, 0, 0]])
@pytest.mark.parametrize("size", [1e-14, 3e-17, 1e-90])
def test_polyhedra_do_not_fray(place, size, periodic):
    """A cluster's bisectors with a far site are one plane but for rounding: corners must not multiply."""
    rng = np.random.default_rng(3)
    cluster = place + size * rng.random((200, 3))
    points = np.concatenate([cluster, cluster * [1, 0, 0] + [0, *place[1:]], rng.random((100, 3))])
    cells = vq.cells(points, periodic=periodic)
    assert abs(cells.measures.sum() - 1) <= 1e-12
    if not periodic:
        np.testing.assert_allclose(cells.measures @ cells.centroids, 0.5, atol=1e-12)
    assert max(sum(map(len, faces)) for faces in cells.polyhedra()) <= 6 * len(points)  # Euler


@pytest.mark.parametrize("shape", [(30_000, 1), (30_000, 2), (10_000, 3), (50, 64, 1), (50, 64, 2), (50, 64, 3)])
@pytest.mark.parametrize("periodic", [False, True])
def test_bits_do_not_depend_on_threads(shape, periodic):
    points = np.random.default_rng(3).random(shape)
    one, two, four = (vq.cells(points, periodic=periodic, threads=t).measures for t in (1, 2, 4))
    assert one.tobytes() == two.tobytes() == four.tobytes()


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("kind", ["cantor", "octaves"])
def test_bits_of_cells_beside_gaps_do_not_depend_on_threads(kind, d):
    """What bounded one cell from afar is tried first for the next."""
    points = clustered(kind, 8000, d)
    one, *others = (vq.cells(points, threads=t).measures.tobytes() for t in (1, 2, 3, 4, 4, 4))
    assert set(others) == {one}


@pytest.mark.parametrize("d", [1, 2, 3])
def test_batch_equals_its_sets(d):
    sets = np.random.default_rng(4).random((20, 33, d))
    np.testing.assert_array_equal(vq.cells(sets).measures, [vq.cells(s).measures for s in sets])


@pytest.mark.parametrize("d", [1, 2, 3])
def test_any_strides(d):
    wide = np.asfortranarray(np.random.default_rng(5).random((2 * d, 400, 8)))
    for view in (wide[::2].T, wide[::-2, 5:300:3].T, wide.T[..., :d].astype(">f8")):
        np.testing.assert_array_equal(vq.cells(view).measures, vq.cells(np.array(view, order="C")).measures)


def test_interrupt_ends_a_long_call():
    points = np.random.default_rng(8).random((1_000_000, 3))
    timer = threading.Timer(0.3, signal.raise_signal, [signal.SIGINT])
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        vq.cells(points, threads=2).measures  # noqa: B018


@pytest.mark.parametrize(("shape", "what"), [((2, 500_000, 3), "measures"), ((2_000_000, 2), "polygons")])
def test_interrupt_ends_sets_and_polygons_early(shape, what):
    points = np.random.default_rng(8).random(shape)
    cells = vq.cells(points, threads=1)
    timer = threading.Timer(0.1, signal.raise_signal, [signal.SIGINT])
    timer.start()
    with cpu_time() as seconds, pytest.raises(KeyboardInterrupt):
        cells.polygons() if what == "polygons" else cells.measures
    assert seconds() < 0.6  # all of it takes seconds


@pytest.mark.parametrize("as_given", [np.asarray, memoryview])
def test_later_changes_of_what_was_given_are_not_seen(as_given):
    points = np.random.default_rng(12).random((1000, 2))
    cells = vq.cells(as_given(points))
    points[::2] = np.nan
    assert abs(cells.measures.sum() - 1) <= 1e-12


def test_masked_points_are_refused():
    with pytest.raises(ValueError, match="must not be masked"):
        vq.cells(np.ma.array([[0.5, 0.5], [0.2, 0.3]], mask=[[0, 0], [1, 1]]))


def test_polygons_have_the_measures_as_areas():
    points = np.random.default_rng(6).random((300, 2))
    for periodic in (False, True):
        cells = vq.cells(points, periodic=periodic)
        for site, polygon, area in zip(points, cells.polygons(), cells.measures, strict=True):
            after = np.roll(polygon, -1, axis=0)
            cross = polygon[:, 0] * after[:, 1] - polygon[:, 1] * after[:, 0]
            assert 0.5 * cross.sum() == pytest.approx(area, abs=1e-14)  # positive: counter-clockwise
            to_corners = np.linalg.norm(polygon - site, axis=1)
            others = np.linalg.norm(
                (polygon[:, None] - points + 0.5 * periodic) % (1 if periodic else np.inf) - 0.5 * periodic, axis=2
            )
            assert (others.min(axis=1) >= to_corners - 1e-12).all()


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


def test_polyhedra_have_the_measures_as_volumes():
    points = np.random.default_rng(6).random((60, 3))
    points[:5, 0] = 0  # on a face
    for periodic in (False, True):
        cells = vq.cells(points, periodic=periodic)
        for site, faces, volume in zip(points, cells.polyhedra(), cells.measures, strict=True):
            cones = 0.0
            for face in faces:
                first, *rest = face - site
                cones += sum(first @ np.cross(a, b) for a, b in itertools.pairwise(rest)) / 6  # positive: outward
            assert cones == pytest.approx(volume, abs=1e-14)
            corners = np.concatenate(faces)
            assert ConvexHull(corners).volume == pytest.approx(volume, abs=1e-14)
            assert len(np.unique(corners, axis=0)) - len(corners) // 2 + len(faces) == 2  # Euler: V − E + F
            gaps = np.abs(corners[:, None] - points)
            gaps = np.minimum(gaps % 1.0, 1 - gaps % 1.0) if periodic else gaps
            nearest = np.linalg.norm(gaps, axis=2).min(axis=1)
            assert (nearest >= np.linalg.norm(corners - site, axis=1) - 1e-12).all()


def test_what_is_of_one_set_or_of_one_dimension_says_so():
    batch, plane = np.full((2, 3, 2), 0.5), np.full((3, 2), 0.5)
    for what in ("polygons", "centroids"):
        with pytest.raises(ValueError, match=f"{what} needs one set"):
            value = getattr(vq.cells(batch), what)
            value()
    for what in ("intervals", "polyhedra"):
        with pytest.raises(ValueError, match=f"{what} needs one set"):
            getattr(vq.cells(plane), what)()


def test_intervals_end_halfway():
    ends = vq.cells([0.5, 0.1, 0.9, 0.5]).intervals()
    np.testing.assert_allclose(ends, [[0.3, 0.7], [0, 0.3], [0.7, 1], [0.3, 0.7]], atol=1e-15)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([[0.5, np.nan]], "points"),
        ([[0.5, 1.5]], "points"),
        ([[0.5] * 4], "d = 4"),
        (np.empty((0, 2)), "at least one point"),
        ("abc", "array of numbers"),
    ],
)
def test_bad_points_are_named(points, message):
    with pytest.raises(ValueError, match=message):
        vq.cells(points)


def seam(lo: float, hi: float, dtype: type) -> float:
    """What np.mod makes of a number just below the lower end, or its rounding to the type."""
    return float(dtype(lo + np.mod(-1e-17 * (hi - lo), hi - lo)))


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("bounds", [(0, 1), (0, 2 * np.pi), (0.1, 0.8), (-0.3, 0.1), (1e6, 1e6 + 0.7)])
def test_the_upper_end_of_a_periodic_axis_is_its_lower_end(bounds, dtype):
    lo, hi = bounds
    x = np.array([[lo, lo], [seam(lo, hi, dtype), (lo + hi) / 2], [(lo + hi) / 2, seam(lo, hi, dtype)]], dtype)
    w = vq.cells(x, bounds=bounds, periodic=True).measures
    at_the_end = np.clip(x.astype(float), lo, hi)
    at_the_end[at_the_end == hi] = lo
    np.testing.assert_allclose(w, vq.cells(at_the_end, bounds=bounds, periodic=True).measures, rtol=1e-5)
    assert w.sum() == pytest.approx((hi - lo) ** 2, rel=1e-12)


@pytest.mark.parametrize("x", [1.5, -1e-3, np.inf, np.nan])
def test_other_points_outside_a_periodic_axis_are_refused(x):
    with pytest.raises(ValueError, match=r"is not inside \[0, 1\]\^1; give the box as bounds=.* or wrap"):
        vq.cells([0.5, x], periodic=True)


def test_wrapped_points_coincide_with_those_at_the_lower_end():
    x = np.array([0.99999999, 0.5, 0.0], dtype=np.float32)  # the first is 1
    np.testing.assert_array_equal(vq.cells(x, periodic=True).measures, [0.25, 0.5, 0.25])
    x = np.array([[np.mod(-1e-17, 1), 0.5], [0.5, 0.5]])
    assert x[0, 0] == 1
    np.testing.assert_array_equal(vq.cells(x, periodic=[True, False]).measures, [0.5, 0.5])


def test_single_precision_is_put_on_the_face_that_it_is_rounded_from():
    x = np.array([0.1, 0.05], np.float32)
    assert float(x[0]) > 0.1
    np.testing.assert_allclose(vq.cells(x, bounds=(0, 0.1)).measures, [0.025, 0.075], rtol=1e-6)
    with pytest.raises(ValueError, match=r"points\[0\] .* give the box as bounds"):
        vq.cells(x.astype(float), bounds=(0, 0.1))


def test_cells_keep_their_own_points():
    points = np.random.default_rng(0).random((50, 2))
    kept = vq.cells(points)
    before = vq.cells(points.copy()).measures
    points[:] = np.nan
    np.testing.assert_array_equal(kept.measures, before)


NEAR_TWINS = """
0x1.90d0c28ffb13cp-1 0x1.90d0c28ffb16p-1 0x1.b15cac356851dp-1 0x1.3333333333375p-2
0x1.33333333333bfp-2 0x1.b15cac35684e4p-1 0x1.9999999999658p-4 0x1p-1
0x1.3333333333328p-2 0x1.b15cac356856bp-1 0x1.fffffffffffffp-2 0x1.9999999999de4p-4
0x1.00007ab3dff93p-1 0x1.000026b1b1a56p-1 0x1p-1 0x1p-1
"""


def test_a_neighbour_far_nearer_than_two_near_twins():
    """As seen from the last point, the twins' inverses differ by less than the way there is rounded by."""
    points = np.array([float.fromhex(x) for x in NEAR_TWINS.split()]).reshape(-1, 2)
    for periodic in (False, True):
        assert abs(vq.cells(points, periodic=periodic).measures.sum() - 1) < 1e-12


@pytest.mark.parametrize("d", [2, 3])
def test_the_smallest_differences(d):
    """Products of a denormal difference with half the box round to nothing; it bounds cells all the same."""
    height = [0, 1e-323, 2.8e-306, 2e-280, 1.5e-269, 1.2e-268, 8e-233, 1.8e-189, 9e-187, 4e-149, 2e-122, 9e-69]
    line = np.full((len(height), d), 0.5)
    line[:, -1] = height
    crowd = np.vstack([np.full((4, d), 0.5), line, np.repeat(line[:1], 14, axis=0)])  # more than one leaf
    for points in (line, crowd):
        for periodic in (False, True):
            assert abs(vq.cells(points, periodic=periodic).measures.sum() - 1) < 1e-12


def test_octaves_in_space():
    """Cells of many vertices, of which a plane cuts off several pieces at a time."""
    points = 2.0 ** -np.random.default_rng(0).integers(1, 300, (1000, 3))
    for periodic in (False, True):
        assert abs(vq.cells(points, periodic=periodic).measures.sum() - 1) < 1e-12


NEARLY_ON_A_SPHERE = """
0x1.0003eea209b03p-1 0x1.0002452e0811ap-1 0x1.00029f16b1202p-1
0x1p-1 0x1p-1 0x1.fff583a53b948p-2
0x1.fffd60e94ede3p-2 0x1.0002452e08131p-1 0x1.00048a5c10263p-1
0x1.0002452e080c2p-1 0x1.0003eea209a6bp-1 0x1.00029f16b119cp-1
0x1p-1 0x1p-1 0x1.fff583a53b79ap-2
0x1p-1 0x1.00029f16b11fcp-1 0x1.00048a5c1022ap-1
0x1.fff822bbec99fp-2 0x1.0002452e08135p-1 0x1.fffac1d29dbbfp-2
0x1.0002452e080a5p-1 0x1.0003eea209a38p-1 0x1.00029f16b117bp-1
0x1.fffb75a3efe06p-2 0x1.0003eea209adp-1 0x1.fffac1d29dc4p-2
0x1.0002452e08113p-1 0x1.fff822bbeca12p-2 0x1.00029f16b11fap-1
0x1.fffb75a3efe87p-2 0x1.fffd60e94ee6ap-2 0x1.fff6eb47dfd0ep-2
0x1p-1 0x1p-1 0x1.fff583a53b851p-2
0x1.0002452e08129p-1 0x1.0003eea209b1cp-1 0x1.00029f16b1213p-1
0x1p-1 0x1p-1 0x1p-1
"""


def test_far_sites_clip_once():
    """Rounding leaves corners of the first cell beyond planes that have clipped it, which then clip in turn."""
    points = np.array([float.fromhex(x) for x in NEARLY_ON_A_SPHERE.split()]).reshape(-1, 3)
    for periodic in (False, True):
        assert abs(vq.cells(points, periodic=periodic).measures.sum() - 1) < 1e-12


def test_complex_points_are_refused():
    with pytest.raises(ValueError, match="points must be real, got complex numbers"):
        vq.cells([[0.2 + 0.3j, 0.5]])


@pytest.mark.parametrize("d", [1, 2, 3])
def test_every_version_of_the_core_gives_the_same_bits(d):
    program = """
import sys, numpy as np, voroquad as vq
x = np.random.default_rng(3).random((3000, int(sys.argv[1])))
x[:500] *= 1e-3
print(vq.cells(x).measures.tobytes().hex())
for seed in range(200):  # many sites that are equally near to a corner: octaves along a few rays
    rng = np.random.default_rng(seed)
    angle, height, octave = np.pi / 6 * rng.integers(0, 12, 26), rng.integers(-1, 2, 26), rng.integers(0, 60, 26)
    rays = 0.5 + 0.49 * (2.0**-octave * [np.cos(angle), np.sin(angle), height]).T[:, : x.shape[1]]
    for periodic in (False, True):
        print(vq.cells(rays, periodic=periodic).measures.tobytes().hex())
"""
    levels = _core.processor_levels()
    outputs = [
        subprocess.run(
            [sys.executable, "-c", program, str(d)],
            env={**os.environ, "VOROQUAD_PROCESSOR": level},
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        for level in levels
    ]
    assert len(set(outputs)) == 1


def test_an_unknown_version_of_the_core_is_refused():
    asked = {**os.environ, "VOROQUAD_PROCESSOR": "v9"}
    program = "import voroquad; voroquad.cells([[0.5]])"
    failed = subprocess.run([sys.executable, "-c", program], env=asked, capture_output=True, text=True)
    assert failed.returncode != 0
    assert "VOROQUAD_PROCESSOR is 'v9'; this processor has " in failed.stderr
