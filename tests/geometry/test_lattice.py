"""Cells on triclinic lattices: Qhull with repeated points, voro++, and what holds for any set."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import pyvoro2
from any_points import any_set
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, Voronoi

import voroquad as vq
from voroquad.geometry.lattice import Lattice


def random_lattice(rng: np.random.Generator, d: int) -> np.ndarray:
    """Rows of any shape, then sheared and in no order."""
    while True:
        vectors = rng.normal(size=(d, d))
        if abs(np.linalg.det(vectors)) > 0.1 * np.prod(np.linalg.norm(vectors, axis=1)):
            return vectors


def sheared(rng: np.random.Generator, vectors: np.ndarray) -> np.ndarray:
    """Other vectors of the same lattice."""
    d = len(vectors)
    steps = np.eye(d, dtype=int)
    for _ in range(3):
        i, k = rng.permutation(d)[:2]
        steps[i] += rng.integers(-4, 5) * steps[k]
    return steps @ vectors


def repeated_measures(points: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    shifts = np.array(sorted(itertools.product(range(-3, 4), repeat=len(vectors)), key=np.linalg.norm))
    diagram = Voronoi(np.concatenate([points + shift @ vectors for shift in shifts]))
    regions = (diagram.regions[diagram.point_region[i]] for i in range(len(points)))
    return np.array([ConvexHull(diagram.vertices[region]).volume for region in regions])


#: Examples of tests that take long for each
FEWER = settings(max_examples=settings.default.max_examples // 3)


@FEWER
@given(d=st.integers(2, 3), n=st.integers(1, 12), seed=st.integers(0, 2**32))
def test_equals_qhull_on_repeated_points(d, n, seed):
    rng = np.random.default_rng(seed)
    vectors = Lattice(random_lattice(rng, d)).reduced
    points = rng.random((n, d)) @ vectors
    theirs = repeated_measures(points, vectors)
    anywhere = points + rng.integers(-3, 4, (n, d)) @ vectors
    ours = vq.cells(anywhere, cell=sheared(rng, vectors))
    np.testing.assert_allclose(ours.measures, theirs, rtol=0, atol=1e-10 * theirs.sum())


@pytest.mark.parametrize("n", [1, 3, 500])
def test_equals_voro_pp(n):
    rng = np.random.default_rng(n)
    vectors = Lattice(random_lattice(rng, 3)).reduced
    vectors[0] *= np.sign(np.linalg.det(vectors))  # right-handed, as voro++ has it
    points = rng.random((n, 3)) @ vectors
    theirs = pyvoro2.compute(points, domain=pyvoro2.PeriodicCell(vectors.tolist())).cell_measures
    ours = vq.cells(points, cell=sheared(rng, vectors)).measures
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-10 * np.sum(theirs))


@pytest.mark.parametrize("n", [20, 1000])
def test_equals_freud(n):
    """Which takes single precision: of places and vectors that are whole multiples of 2⁻¹⁰."""
    freud = pytest.importorskip("freud")
    rng = np.random.default_rng(n)
    box = freud.box.Box(Lx=8, Ly=6, Lz=5, xy=0.25, xz=-0.5, yz=0.125)
    vectors = box.to_matrix().T
    np.testing.assert_array_equal(vectors, [(8, 0, 0), (1.5, 6, 0), (-2.5, 0.625, 5)])
    periods = rng.integers(-(2**6), 2**6, (n, 3)) / 2**7  # of the cell about the origin
    points = periods @ vectors
    np.testing.assert_array_equal(points, points.astype(np.float32))
    theirs = freud.locality.Voronoi().compute((box, points)).volumes
    assert len(np.unique(points, axis=0)) == n, "freud knows no points that coincide"
    np.testing.assert_allclose(vq.cells(points, cell=vectors).measures, theirs, rtol=0, atol=1e-10 * box.volume)


@given(points=any_set(max_size=15).filter(lambda x: x.shape[1] > 1), seed=st.integers(0, 2**32))
def test_of_any_set_fill_the_cell(points, seed):
    rng = np.random.default_rng(seed)
    d = points.shape[1]
    vectors = sheared(rng, random_lattice(rng, d))
    volume = abs(np.linalg.det(vectors))
    cells = vq.cells(points @ vectors, cell=vectors)
    assert (cells.measures >= 0).all()
    assert cells.measures.sum() == pytest.approx(volume, rel=1e-12)
    assert cells.centroids.shape == points.shape


@FEWER
@given(d=st.integers(2, 3), n=st.integers(1, 30), seed=st.integers(0, 2**32))
def test_neighbours_and_triangulation(d, n, seed):
    rng = np.random.default_rng(seed)
    vectors = sheared(rng, random_lattice(rng, d))
    cells = vq.cells(rng.random((n, d)) @ vectors, cell=vectors)
    near = cells.neighbours()
    way = cells.points[near.indices] + near.shifts @ vectors - cells.points[near.rows]
    size = np.abs(vectors).max()
    np.testing.assert_allclose(np.linalg.norm(way, axis=1), near.distances, rtol=0, atol=1e-11 * size)
    cones = np.bincount(near.rows, near.measures * near.distances / (2 * d), n)
    np.testing.assert_allclose(cones, cells.measures, rtol=1e-9)
    there = list(zip(near.rows, near.indices, map(tuple, near.shifts), near.measures, near.distances, strict=True))
    back = [(j, i, tuple(-k for k in shift), m, s) for i, j, shift, m, s in there]
    assert sorted(there) == sorted(back) == there
    dual = cells.triangulation()
    corners = cells.points[dual.simplices] + dual.shifts @ vectors
    filled = np.linalg.det(corners[:, 1:] - corners[:, :1]) / (2 if d == 2 else 6)
    assert filled.sum() == pytest.approx(abs(np.linalg.det(vectors)), rel=1e-9)
    assert filled.min() > 0


@pytest.mark.parametrize("seed", [0, 5, 7, 10])
def test_cells_of_a_cluster_reach_far_beyond_their_neighbours(seed):
    """Images at twice the radius of a cell still cut it; without them the cells would be too large together."""
    rng = np.random.default_rng(seed)
    points = rng.random((1, 2))[rng.integers(0, 1, 100)] + 0.1 * rng.normal(size=(100, 2))
    assert vq.cells(points, cell=np.eye(2)).measures.sum() == pytest.approx(1, rel=1e-12)


def test_on_a_cube_equals_the_torus():
    points = np.random.default_rng(4).random((300, 3))
    lattice, torus = vq.cells(points, cell=np.eye(3)), vq.cells(points, periodic=True)
    np.testing.assert_allclose(lattice.measures, torus.measures, rtol=1e-12)
    np.testing.assert_allclose(lattice.centroids, torus.centroids, atol=1e-12)
    for name in ("indptr", "indices", "shifts"):
        np.testing.assert_array_equal(getattr(lattice.neighbours(), name), getattr(torus.neighbours(), name))
    assert [len(faces) for faces in lattice.polyhedra()] == [len(faces) for faces in torus.polyhedra()]
    np.testing.assert_array_equal(lattice.locate(points + 5), np.arange(300))


def test_hexagons():
    cells = vq.cells([[0.2, 0.7]], cell=[(1, 0), (7.5, 3**0.5 / 2)])
    polygon = cells.polygon(0)
    np.testing.assert_allclose(np.linalg.norm(polygon - cells.points[0], axis=1), 3**-0.5)
    assert len(polygon) == 6
    assert cells.periodic is True
    np.testing.assert_allclose(cells.neighbours().distances, 1)
    np.testing.assert_array_equal(cells.lattice, [(1, 0), (7.5, 3**0.5 / 2)])


def test_locates_across_seams_and_takes_the_first_of_equals():
    cells = vq.cells([[0.25, 0.25], [0.75, 0.25]], cell=[(1, 0), (3, 1)])
    np.testing.assert_array_equal(cells.locate([[0.95, 0.3], [0.5, 0.25], [1.0, 0.25], [-7.7, 12.2]]), [1, 0, 0, 0])


def test_on_a_line_is_a_circle():
    np.testing.assert_allclose(vq.cells([0.5, 6.0], cell=[[-4.0]]).measures, [2, 2])


@pytest.mark.parametrize("period", [2.0, -2.0])
def test_on_a_line_shifts_are_in_periods_of_the_vector(period):
    points = np.array([0.1, -0.5, 3.0])
    cells = vq.cells(points, cell=[[period]])
    near = cells.neighbours()
    home = cells.points[:, 0]
    way = home[near.indices] + near.shifts[:, 0] * period - home[near.rows]
    np.testing.assert_allclose(np.abs(way), near.distances)
    entries = list(zip(near.rows, near.indices, near.shifts[:, 0], strict=True))
    assert entries == sorted(entries)
    np.testing.assert_array_equal(cells.lattice, [[period]])
    np.testing.assert_array_equal(cells.locate(points - 6), [0, 1, 2])
    assert vq.cells(points.reshape(3, 1, 1), cell=[[period]]).measures.tolist() == [[2.0]] * 3


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("far", [1e17, -1e300, np.inf, np.nan])
def test_refuses_points_without_digits(d, far):
    points = np.full((3, d), 0.25)
    points[1, 0] = far
    what = r"\[1\] .*is more than 4.4e\+12 periods" if np.isfinite(far) else r"\[1\] is not finite; drop it"
    with pytest.raises(ValueError, match="points" + what):
        vq.cells(points, cell=np.eye(d))
    with pytest.raises(ValueError, match="x" + what):
        vq.cells(points[:1], cell=np.eye(d)).locate(points)
    with pytest.raises(ValueError, match=r"points\[\(0, 1\)\]"):
        vq.cells(points[None], cell=np.eye(d))


def test_distant_points_keep_their_digits():
    points = np.array([[0.25, 0.5], [0.75, 0.5]])
    away = points + np.array([2.0**42 - 1, 0])
    np.testing.assert_array_equal(vq.cells(away, cell=np.eye(2)).points, points)
    single = (points + np.array([2.0**13 - 1, 0])).astype(np.float32)
    np.testing.assert_array_equal(vq.cells(single, cell=np.eye(2)).points, points)
    with pytest.raises(ValueError, match=r"points\[0\] .*8.19e\+03 periods"):
        vq.cells(single + np.float32(2), cell=np.eye(2))


@pytest.mark.parametrize("d", [2, 3])
def test_of_batches_are_the_measures(d):
    """To the last bit: points are wrapped once."""
    rng = np.random.default_rng(1)
    for _ in range(12):
        vectors = sheared(rng, random_lattice(rng, d))
        batch = rng.choice([0.0, 0.1, 0.25, 1 / 3, 0.5], (12, 2, d)) @ vectors
        measures = vq.cells(batch, cell=vectors).measures
        np.testing.assert_array_equal(measures, [vq.cells(points, cell=vectors).measures for points in batch])


@given(d=st.integers(2, 3), seed=st.integers(0, 2**32))
def test_vectors_are_reduced(d, seed):
    rng = np.random.default_rng(seed)
    lattice = Lattice(sheared(rng, random_lattice(rng, d)))
    assert abs(round(np.linalg.det(lattice.steps))) == 1
    lengths = np.linalg.norm(lattice.reduced, axis=1)
    assert (np.diff(lengths) >= 0).all()
    for counts in itertools.product((-1, 0, 1), repeat=d):  # Minkowski's conditions
        last = max((k for k in range(d) if counts[k]), default=None)
        if last is not None:
            assert np.linalg.norm(counts @ lattice.reduced) >= lengths[last] * (1 - 1e-9)


@pytest.mark.parametrize(
    ("cell", "message"),
    [
        (np.eye(3), "cell has 3 lattice vectors, the points have d = 2"),
        ([[1, 0], [2, 0]], "the rows must be finite vectors, not all in one line or plane"),
        ([[1, 0], [0, np.inf]], "the rows must be finite vectors"),
        ([1, 2], r"cell has shape \(2,\); give d = 1, 2 or 3 lattice vectors"),
        ([[1, 0], [0, 1e-6]], "for boxes take bounds= and periodic=True"),
    ],
)
def test_refuses(cell, message):
    with pytest.raises(ValueError, match=message):
        vq.cells([[0.2, 0.2]], cell=cell)


def test_refuses_what_has_no_sides():
    with pytest.raises(ValueError, match="cells of a lattice have no bounds"):
        _ = vq.cells([[0.2, 0.2]], cell=np.eye(2)).bounds
    with pytest.raises(ValueError, match="cell= says where cells end; leave out periodic="):
        vq.cells([[0.2, 0.2]], cell=np.eye(2), periodic=[True, False])
    with pytest.raises(ValueError, match=r"points\[1\] is not finite"):
        vq.cells([[0.2, 0.2], [np.nan, 0]], cell=np.eye(2))
