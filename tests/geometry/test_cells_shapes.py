"""Polygons, polyhedra and intervals of Voronoi cells."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import voroquad as vq


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


@pytest.mark.parametrize("rounding", [1e-16, 3e-16, 1e-15])
def test_polyhedra_of_a_rounded_lattice_have_no_edges_of_length_zero(rounding):
    """Eight cells meet in a place, which rounding makes several corners; some of them coincide."""
    lattice = (np.indices((4, 4, 4)).reshape(3, -1).T + 0.5) / 4
    points = lattice + rounding * np.random.default_rng(1).uniform(-1, 1, lattice.shape)
    for faces in vq.cells(points).polyhedra():
        for face in faces:
            assert len(face) >= 3
            assert (face != np.roll(face, 1, axis=0)).any(axis=1).all()


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
