"""Which cell a place is in, and cells one by one."""

from __future__ import annotations

import pickle
from collections.abc import Sequence

import numpy as np
import pytest
from any_points import any_set
from hypothesis import given
from hypothesis import strategies as st

import voroquad as vq


@given(points=any_set(), periodic=st.booleans(), seed=st.integers(0, 2**32))
def test_locates_the_nearest_point(points, periodic, seed):
    rng = np.random.default_rng(seed)
    n, d = points.shape
    places = np.concatenate([rng.random((20, d)), points[rng.integers(0, n, 20)], rng.integers(0, 5, (20, d)) / 4])
    cells = vq.cells(points, periodic=periodic)
    found = cells.locate(places)
    way = np.abs(cells.points - (np.mod(places, 1) if periodic else places)[:, None])
    way = np.minimum(way, 1 - way) if periodic else way
    distance = np.linalg.norm(way, axis=-1)
    assert (distance[np.arange(60), found] <= distance.min(axis=1) * (1 + 1e-12) + 1e-15).all()
    first = [np.flatnonzero((cells.points == cells.points[i]).all(axis=-1))[0] for i in found]
    np.testing.assert_array_equal(found, first)  # of points that coincide


def test_of_points_that_are_equally_near_takes_the_first():
    points = np.array([[0.75, 0.75], [0.25, 0.75], [0.25, 0.25], [0.75, 0.25]])
    places = [[0.5, 0.5], [0.5, 0.1], [0.1, 0.5], [0, 0]]
    np.testing.assert_array_equal(vq.cells(points).locate(places), [0, 2, 1, 2])
    np.testing.assert_array_equal(vq.cells(points, periodic=True).locate(places), [0, 2, 1, 0])


def test_takes_one_place_or_many():
    line = vq.cells([1.0, 3.0], bounds=(0, 4))
    assert line.locate(0.5).shape == ()
    assert line.locate(0.5) == 0
    np.testing.assert_array_equal(line.locate([3, 2, 1]), [1, 0, 0])
    np.testing.assert_array_equal(line.locate([[3], [2]]), [1, 0])
    plane = vq.cells([[1.0, 1.0], [3.0, 1.0]], bounds=(0, 4), periodic=[True, False])
    assert plane.locate([3.9, 4]).shape == ()
    np.testing.assert_array_equal(plane.locate(np.float32([[4, 0]])), [0])
    with pytest.raises(ValueError, match=r"x must have shape \(m, 2\) or \(2,\), got \(3,\)"):
        plane.locate([1, 2, 3])
    with pytest.raises(ValueError, match=r"x\[0\] = \[0.0, 5.0\] is not inside"):
        plane.locate([0, 5])


def test_scans_as_the_measures_say():
    points = np.random.default_rng(3).random((30, 3))
    cells = vq.cells(points, periodic=[True, False, True])
    places = np.random.default_rng(4).random((200_000, 3))
    share = np.bincount(cells.locate(places), minlength=30) / len(places)
    spread = np.sqrt(cells.measures * (1 - cells.measures) / len(places))
    assert (np.abs(share - cells.measures) < 5.5 * spread).all()


def test_polygons_are_a_sequence_of_views_of_flat_arrays():
    cells = vq.cells(np.random.default_rng(7).random((20, 2)))
    polygons = cells.polygons()
    assert isinstance(polygons, Sequence)
    assert len(polygons) == len(list(polygons)) == 20
    assert polygons.offsets[-1] == len(polygons.coordinates)
    for i, polygon in enumerate(polygons):
        np.testing.assert_array_equal(polygon, cells.polygon(i))
        np.testing.assert_array_equal(polygon, polygons.coordinates[polygons.offsets[i] : polygons.offsets[i + 1]])
        assert np.shares_memory(polygon, polygons.coordinates)
    np.testing.assert_array_equal(cells.polygon(-1), polygons[19])
    backwards = polygons[:3:-5]
    assert isinstance(backwards, list)
    for polygon, i in zip(backwards, (19, 14, 9, 4), strict=True):
        np.testing.assert_array_equal(polygon, polygons[i])
    with pytest.raises(IndexError, match="cell 20 of 20"):
        cells.polygon(20)


def test_polyhedra_are_a_sequence_of_views_of_flat_arrays():
    cells = vq.cells(np.random.default_rng(8).random((20, 3)), bounds=(0, 2))
    polyhedra = cells.polyhedra()
    assert isinstance(polyhedra, Sequence)
    assert len(polyhedra) == len(list(polyhedra)) == 20
    for i, faces in enumerate(polyhedra):
        assert len(faces) == len(polyhedra[i]) == polyhedra.offsets[i + 1] - polyhedra.offsets[i]
        for ours, theirs in zip(faces, cells.polyhedron(i), strict=True):
            np.testing.assert_array_equal(ours, theirs)
            assert np.shares_memory(ours, polyhedra.coordinates)
    assert polyhedra.face_offsets[-1] == len(polyhedra.coordinates)
    for faces, i in zip(polyhedra[-2:], (18, 19), strict=True):
        np.testing.assert_array_equal(np.concatenate(faces), np.concatenate(polyhedra[i]))
    with pytest.raises(IndexError, match="cell -21 of 20"):
        cells.polyhedron(-21)


def shapes_of(d):
    cells = vq.cells(np.random.default_rng(9).random((6, d)))
    return cells.polygons() if d == 2 else cells.polyhedra()


@pytest.mark.parametrize("d", [2, 3])
def test_shapes_can_be_taken_by_number(d):
    shapes = shapes_of(d)
    for cells in ([4, -1, 0, 4], np.array([4, 5, 0, 4], np.uint8)):
        taken = shapes.take(cells)
        assert len(taken) == 4
        for ours, theirs in zip(taken, [shapes[i] for i in (4, 5, 0, 4)], strict=True):
            for a, b in zip(ours, theirs, strict=True):
                np.testing.assert_array_equal(a, b)
    assert len(shapes.take([])) == 0
    for wrong, cell in (([0, 6], 6), ([-7], -7)):
        with pytest.raises(IndexError, match=f"cell {cell} of 6"):
            shapes.take(wrong)
    for wrong in (3, [0.5], np.ones(6, bool), [[0, 1]]):
        with pytest.raises(TypeError, match=r"cells must be whole numbers \(m,\), got .*; of a mask np.flatnonzero"):
            shapes.take(wrong)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("copied", [False, True])
def test_shapes_cannot_be_written_to(d, copied):
    shapes = pickle.loads(pickle.dumps(shapes_of(d))) if copied else shapes_of(d)
    np.testing.assert_array_equal(shapes.coordinates, shapes_of(d).coordinates)
    corners = shapes[1] if d == 2 else shapes[1][0]
    for array in (shapes.coordinates, shapes.offsets, corners, corners[0]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


@pytest.mark.parametrize("d", [2, 3])
def test_shapes_do_not_look_for_a_cell(d):
    shapes = shapes_of(d)
    for look in (lambda: shapes[0] in shapes, lambda: shapes.index(shapes[0]), lambda: shapes.count(shapes[0])):
        with pytest.raises(TypeError, match="cannot look for a cell, as cells are arrays; compare their arrays by"):
            look()
    assert shapes == shapes
    assert shapes != list(shapes)


def test_points_are_those_given():
    np.testing.assert_array_equal(vq.cells([[1.0, 7.0]], bounds=(1, 7), periodic=[False, True]).points, [[1.0, 1.0]])


@pytest.mark.parametrize("cells", [vq.cells([[0.2, 0.5], [0.7, 0.1]]), vq.cells([[0.2, 0.5]], cell=[[1, 0], [0.3, 1]])])
def test_no_places_are_in_no_cells(cells):
    found = cells.locate(np.empty((0, 2)))
    assert (found.shape, found.dtype) == ((0,), np.int64)
    assert vq.cells([0.5, 0.7]).locate([]).shape == (0,)
