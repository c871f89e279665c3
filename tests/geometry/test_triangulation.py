"""The dual triangulation against Qhull, on lattices, and what holds for any set."""

from __future__ import annotations

import collections
import itertools

import numpy as np
import pytest
from any_points import any_set
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import Delaunay

import voroquad as vq


def corners_of(points: np.ndarray, dual: vq.Triangulation, period: float = 1.0) -> np.ndarray:
    return points[dual.simplices] + period * dual.shifts


def volumes(corners: np.ndarray) -> np.ndarray:
    d = corners.shape[-1]
    return np.linalg.det(corners[:, 1:] - corners[:, :1]) / (2 if d == 2 else 6)


def facets(dual: vq.Triangulation) -> collections.Counter:
    """How many simplices have each facet, on the torus as on the plane."""
    count: collections.Counter = collections.Counter()
    for simplex, shifts in zip(dual.simplices.tolist(), dual.shifts.tolist(), strict=True):
        images = list(zip(simplex, map(tuple, shifts), strict=True))
        for facet in itertools.combinations(sorted(images), len(simplex) - 1):
            first = facet[0][1]
            count[tuple((i, tuple(np.subtract(shift, first).tolist())) for i, shift in facet)] += 1
    return count


def circumcentres(corners: np.ndarray) -> np.ndarray:
    ways = corners[:, 1:] - corners[:, :1]
    return corners[:, 0] + np.linalg.solve(ways, 0.5 * (ways**2).sum(axis=-1)[..., None])[..., 0]


@given(d=st.integers(2, 3), n=st.integers(5, 80), seed=st.integers(0, 2**32))
def test_has_the_simplices_of_qhull_whose_centres_are_inside(d, n, seed):
    points = np.random.default_rng(seed).uniform(-1, 2, (n, d))
    dual = vq.cells(points, bounds=(-1, 2)).triangulation()
    theirs = Delaunay(points).simplices
    centres = circumcentres(points[theirs])
    depth = np.minimum(centres + 1, 2 - centres).min(axis=-1)
    inside = {tuple(sorted(s)) for s in theirs[depth > 1e-7].tolist()}
    perhaps = {tuple(sorted(s)) for s in theirs[depth > -1e-7].tolist()}
    ours = {tuple(sorted(s)) for s in dual.simplices.tolist()}
    assert len(ours) == len(dual)
    assert inside <= ours <= perhaps
    assert (volumes(points[dual.simplices]) > 0).all()


@given(d=st.integers(2, 3), n=st.integers(1, 80), seed=st.integers(0, 2**32))
def test_on_the_torus_fills_it(d, n, seed):
    points = np.random.default_rng(seed).uniform(0, 4, (n, d))
    dual = vq.cells(points, bounds=(0, 4), periodic=True).triangulation()
    assert volumes(corners_of(points, dual, 4)).sum() == pytest.approx(4**d, rel=1e-12)
    assert not dual.shifts[:, 0].any()


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("k", [3, 5])
def test_of_a_lattice_splits_each_cube_once(d, k, periodic):
    ticks = (np.arange(k) + 0.5) / k
    points = np.stack(np.meshgrid(*[ticks] * d, indexing="ij"), axis=-1).reshape(-1, d)
    points = points[np.random.default_rng(k).permutation(len(points))]
    dual = vq.cells(points, periodic=periodic).triangulation()
    filled = volumes(corners_of(points, dual))
    assert filled.sum() == pytest.approx(1 if periodic else (1 - 1 / k) ** d, rel=1e-12)
    assert filled.min() > 0.9 / k**d / (2 if d == 2 else 6)
    shared = collections.Counter(facets(dual).values())
    outer = 0 if periodic else (4 * (k - 1) if d == 2 else 12 * (k - 1) ** 2)
    assert shared[1] == outer
    assert set(shared) <= {1, 2}


def test_of_a_face_centred_lattice():
    ticks = (np.arange(3) + 0.25) / 3
    corners = np.stack(np.meshgrid(*[ticks] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    points = np.concatenate([corners + shift for shift in np.array([[0, 0, 0], [0, 1, 1], [1, 0, 1], [1, 1, 0]]) / 6])
    dual = vq.cells(points, periodic=True).triangulation()  # of tetrahedra, and octahedra in four pieces
    assert set(facets(dual).values()) == {2}
    np.testing.assert_allclose(volumes(corners_of(points, dual)).sum(), 1)
    assert len(dual) == len(points) * (2 + 4)


@given(points=any_set().filter(lambda x: x.shape[1] > 1), periodic=st.booleans())
def test_of_any_set_has_empty_spheres(points, periodic):
    cells = vq.cells(points, periodic=periodic)
    dual = cells.triangulation()
    assert dual.simplices.shape == (len(dual), points.shape[1] + 1)
    corners = corners_of(cells.points, dual)
    large = volumes(corners) > 1e-4
    if not large.any():
        return
    centres = circumcentres(corners[large])
    radii = np.linalg.norm(centres - corners[large, 0], axis=1)
    home = np.mod(centres, 1) if periodic else np.clip(centres, 0, 1)
    way = np.abs(home - cells.points[cells.locate(np.where(home == 1, 0, home) if periodic else home)])
    way = np.minimum(way, 1 - way) if periodic else way
    np.testing.assert_allclose(np.linalg.norm(way, axis=1), radii, atol=1e-6)


def test_needs_a_plane_or_space():
    with pytest.raises(ValueError, match="on a line neighbours"):
        vq.cells([0.5]).triangulation()
