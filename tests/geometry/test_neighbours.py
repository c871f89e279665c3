"""Neighbours: small cases by hand, lattices, Qhull, and what must hold for any set."""

from __future__ import annotations

import numpy as np
import pytest
from any_points import any_set
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, Voronoi

import voroquad as vq


def entries(near: vq.Neighbours) -> list[tuple]:
    """(i, j, shift, measure, distance) of each entry."""
    return [
        (i, j, *shift, measure, distance)
        for i, j, shift, measure, distance in zip(
            near.rows.tolist(),
            near.indices.tolist(),
            near.shifts.tolist(),
            near.measures.tolist(),
            near.distances.tolist(),
            strict=True,
        )
    ]


def lattice(k: int, d: int) -> np.ndarray:
    ticks = (np.arange(k) + 0.5) / k
    return np.stack(np.meshgrid(*[ticks] * d, indexing="ij"), axis=-1).reshape(-1, d)


def test_on_a_line():
    near = vq.cells([0.75, 0.25, 0.5, 0.25]).neighbours()
    assert entries(near) == [(0, 2, 0, 1, 0.25), (1, 2, 0, 1, 0.25), (2, 0, 0, 1, 0.25), (2, 1, 0, 1, 0.25)]
    np.testing.assert_array_equal(near.border, [1, 1, 0, 0])
    np.testing.assert_array_equal(near.surfaces, [2, 2, 2, 0])
    np.testing.assert_array_equal(vq.cells([0.5]).neighbours().border, [2])


def test_on_a_circle():
    near = vq.cells([3.0, 1.0], bounds=(0, 4), periodic=True).neighbours()
    assert entries(near) == [(0, 1, 0, 1, 2), (0, 1, 1, 1, 2), (1, 0, -1, 1, 2), (1, 0, 0, 1, 2)]
    alone = vq.cells([1.0], bounds=(0, 4), periodic=True).neighbours()
    assert entries(alone) == [(0, 0, -1, 1, 4), (0, 0, 1, 1, 4)]
    assert not alone.border.any()


def test_of_three_points_in_a_box():
    near = vq.cells([[1, 1], [3, 0.5], [3, 1.5]], bounds=[(0, 4), (0, 2)]).neighbours()
    assert [near[i].tolist() for i in range(3)] == [[1, 2], [0, 2], [0, 1]]
    assert [near[-1].tolist(), len(near)] == [[0, 1], 3]
    with pytest.raises(IndexError, match="cell 3 of 3"):
        near[3]
    # The cells meet where y = 1 and (x - 1)² = (x - 3)² + 1/4; the first ends at y = 0 a quarter before
    corner = 33 / 16
    face = np.hypot(1, 1 / 4)
    np.testing.assert_allclose(near.distances, np.sqrt([4.25, 4.25, 4.25, 1, 4.25, 1]))
    np.testing.assert_allclose(near.measures, [face, face, face, 4 - corner, face, 4 - corner], rtol=1e-14)
    np.testing.assert_allclose(near.border.sum(), 12)


@pytest.mark.parametrize("d", [2, 3])
def test_of_one_point_on_the_torus_are_its_images(d):
    near = vq.cells([[0.3] * d], bounds=(0, 2), periodic=True).neighbours()
    assert sorted(near.shifts.tolist()) == sorted([*np.eye(d).tolist(), *(-np.eye(d)).tolist()])
    np.testing.assert_array_equal(near.indices, 0)
    np.testing.assert_allclose(near.measures, 2.0 ** (d - 1))
    np.testing.assert_allclose(near.distances, 2)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("k", [3, 8, 11])
def test_on_a_lattice_corners_do_not_count(d, periodic, k):
    near = vq.cells(lattice(k, d), periodic=periodic).neighbours()
    inner = 2 * d * k**d - (0 if periodic else 2 * d * k ** (d - 1))
    assert len(near.indices) == inner
    np.testing.assert_allclose(near.measures, k ** -(d - 1.0), rtol=1e-11)
    np.testing.assert_allclose(near.distances, 1 / k, rtol=1e-13)
    np.testing.assert_allclose(near.surfaces, 2 * d * k ** -(d - 1.0), rtol=1e-11)


def test_on_face_centred_cubes_four_edges_meet_in_corners():
    corners = lattice(4, 3) - 1 / 8
    points = np.concatenate([corners + shift for shift in np.array([[0, 0, 0], [0, 1, 1], [1, 0, 1], [1, 1, 0]]) / 8])
    near = vq.cells(points, periodic=True).neighbours()
    np.testing.assert_array_equal(np.diff(near.indptr), 12)
    np.testing.assert_allclose(near.distances, 2**0.5 / 8)


def mirrored_ridges(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> dict[tuple[int, int], float]:
    """Pairs of neighbours in a box and the measures of their faces, by Qhull on points mirrored in its faces."""
    images = [points]
    for axis in range(points.shape[1]):
        for face in (low[axis], high[axis]):
            image = points.copy()
            image[:, axis] = 2 * face - image[:, axis]
            images.append(image)
    diagram = Voronoi(np.concatenate(images))
    ridges = {}
    for (i, j), corners in zip(diagram.ridge_points.tolist(), diagram.ridge_vertices, strict=True):
        if max(i, j) >= len(points):
            continue
        face = diagram.vertices[corners]
        if points.shape[1] == 2:
            measure = np.linalg.norm(face[1] - face[0])
        else:
            basis = np.linalg.svd(face - face.mean(axis=0))[2][:2]
            measure = ConvexHull((face - face.mean(axis=0)) @ basis.T, qhull_options="QJ").volume
        ridges[min(i, j), max(i, j)] = measure
    return ridges


@given(d=st.integers(2, 3), n=st.integers(2, 60), seed=st.integers(0, 2**32))
def test_are_those_of_qhull(d, n, seed):
    rng = np.random.default_rng(seed)
    low = rng.normal(size=d)
    high = low + rng.uniform(0.5, 2, d)
    points = rng.uniform(low, high, (n, d))
    near = vq.cells(points, bounds=np.stack([low, high], axis=-1)).neighbours()
    ridges = mirrored_ridges(points, low, high)
    ours = {(i, j): m for i, j, *_, m, _ in entries(near) if i < j}
    for pair in ours.keys() | ridges.keys():
        assert abs(ours.get(pair, 0) - ridges.get(pair, 0)) < 1e-8
    np.testing.assert_allclose(near.distances, np.linalg.norm(points[near.rows] - points[near.indices], axis=1))


def polygons_surfaces(cells: vq.Cells) -> np.ndarray:
    if len(cells.bounds) == 2:
        return np.array([np.linalg.norm(p - np.roll(p, 1, axis=0), axis=1).sum() for p in cells.polygons()])
    areas = []
    for faces in cells.polyhedra():
        crosses = [np.cross(f[1:-1] - f[0], f[2:] - f[0]).sum(axis=0) for f in faces]
        areas.append(sum(np.linalg.norm(c) / 2 for c in crosses))
    return np.array(areas)


@given(points=any_set(), periodic=st.booleans())
def test_of_any_set_are_mutual_and_cover_the_surface(points, periodic):
    cells = vq.cells(points, periodic=periodic)
    near = cells.neighbours()
    there = entries(near)
    d = points.shape[1]
    back = [(j, i, *(-np.array(rest[:d])).tolist(), *rest[d:]) for i, j, *rest in there]
    assert sorted(there) == sorted(back)
    assert len({row[: 2 + d] for row in there}) == len(there)
    assert (near.measures > 0).all()
    assert (near.distances > 0).all()
    assert near.border.sum() == pytest.approx(0 if periodic else 2 * d, abs=1e-10)
    if d > 1 and not (near.distances < 1e-6).any():  # from afar a cluster's points look like one
        first = np.unique(cells.points, axis=0, return_index=True)[1]
        np.testing.assert_allclose(near.surfaces[first], polygons_surfaces(cells)[first], rtol=0, atol=1e-9)


@pytest.mark.parametrize("d", [2, 3])
def test_of_two_points_a_rounding_apart_cover_the_surface(d):
    points = np.random.default_rng(d).random((50, d))
    points[7] = np.nextafter(points[33], 1)
    cells = vq.cells(points)
    np.testing.assert_allclose(cells.neighbours().surfaces, polygons_surfaces(cells), rtol=1e-10)


@given(n=st.integers(1, 200), d=st.integers(2, 3), seed=st.integers(0, 2**32))
def test_on_the_torus_cones_over_the_faces_are_the_cell(n, d, seed):
    cells = vq.cells(np.random.default_rng(seed).random((n, d)), bounds=(0, 4), periodic=True)
    near = cells.neighbours()
    cones = np.bincount(near.rows, near.measures * near.distances / (2 * d), n)
    np.testing.assert_allclose(cones, cells.measures, rtol=1e-10)


@given(
    n=st.integers(1, 100),
    d=st.integers(2, 3),
    narrow=st.sampled_from([0.3, 0.1, 0.03, 0.02, 0.01, 0.003]),
    axis=st.integers(0, 2),
    low=st.sampled_from([0.0, 0.7, -1.0]),
    periodic=st.tuples(st.booleans(), st.booleans(), st.booleans()),
    seed=st.integers(0, 2**32),
)
@example(n=100, d=2, narrow=0.01, axis=0, low=0.0, periodic=(True, True, True), seed=1)
@example(n=100, d=2, narrow=0.01, axis=1, low=0.0, periodic=(False, True, True), seed=0)
def test_in_a_narrow_box_sites_are_their_own_neighbours(n, d, narrow, axis, low, periodic, seed):
    periodic = np.array(periodic[:d])
    sides = np.ones(d)
    sides[axis % d] = narrow
    points = low + np.random.default_rng(seed).random((n, d)) * sides
    cells = vq.cells(points, bounds=low + np.stack([0 * sides, sides], axis=-1), periodic=periodic.tolist())
    near = cells.neighbours()
    ends = 2 * sides.prod() / sides[~periodic]
    np.testing.assert_allclose(near.border.sum(), ends.sum(), rtol=1e-10)
    if periodic.all():
        cones = np.bincount(near.rows, near.measures * near.distances / (2 * d), n)
        np.testing.assert_allclose(cones, cells.measures, rtol=1e-10)


def test_do_not_depend_on_threads():
    points = np.random.default_rng(5).random((3000, 3))
    one, three = (vq.cells(points, threads=t).neighbours() for t in (1, 3))
    for name in ("indptr", "indices", "measures", "distances", "shifts", "border"):
        np.testing.assert_array_equal(getattr(one, name), getattr(three, name))


def test_need_one_set():
    with pytest.raises(ValueError, match="neighbours needs one set of points"):
        vq.cells(np.zeros((2, 5, 2))).neighbours()
