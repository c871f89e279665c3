"""Voronoi cells against their definition, an independent implementation and exact identities."""

from __future__ import annotations

import itertools
import signal
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, Voronoi

import voroquad as vq


def mirrored_voronoi(points: np.ndarray) -> np.ndarray:
    """Cell measures by Qhull: points mirrored in all faces make the cells end there.

    A point on a face is its own image: half of its cell lies in the box, of one on an edge a quarter.
    """
    images = points
    for axis in range(points.shape[1]):
        mirrored = [images]
        for face in (0.0, 1.0):
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


@st.composite
def adversarial_sets(draw: st.DrawFn, min_d: int = 1, max_size: int = 40) -> np.ndarray:
    """Up to a few groups of points, each of a kind that breaks algorithms which hope for general position."""
    d = draw(st.integers(min_d, 3))
    groups = []
    for _ in range(draw(st.integers(1, 3))):
        rng = np.random.default_rng(draw(st.integers(0, 2**32)))
        n = draw(st.integers(1, max_size))
        kind = draw(
            st.sampled_from(["any", "uniform", "lattice", "flat", "diagonal", "border", "copies", "cluster", "sphere"])
        )
        x = rng.random((n, d))
        match kind:
            case "any":
                x = np.array(draw(st.lists(st.floats(0, 1), min_size=d, max_size=4 * d)))
                x = x[: x.size // d * d].reshape(-1, d)
            case "lattice":
                k = draw(st.integers(1, 16))
                x = rng.integers(0, k + 1, (n, d)) / k
            case "flat":
                x[:, rng.permutation(d)[: rng.integers(1, d + 1)]] = draw(st.floats(0, 1))
            case "diagonal":
                x = np.repeat(x[:, :1], d, axis=1)
            case "border":
                axes = rng.integers(0, d, n)
                x[np.arange(n), axes] = rng.integers(0, 2, n)
            case "copies":
                x = x[rng.integers(0, max(1, n // 4), n)]
            case "cluster":
                at = draw(st.sampled_from([0.0, 0.5, 1.0])) if draw(st.booleans()) else rng.random(d)
                x = np.clip(at + (x - 0.5) * 10.0 ** -draw(st.integers(0, 310)), 0, 1)
            case "sphere":
                u = rng.normal(size=(n, d))
                x = 0.5 + u / np.linalg.norm(u, axis=1, keepdims=True) * 10.0 ** -draw(st.integers(1, 16))
        groups.append(x)
    return np.concatenate(groups)


@given(adversarial_sets(), st.booleans())
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


@given(adversarial_sets(), st.booleans(), st.randoms(use_true_random=False))
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


@given(adversarial_sets(), st.booleans(), st.lists(st.floats(0, 1, exclude_max=True), min_size=3, max_size=3))
def test_one_more_point_only_shrinks_other_cells(points, periodic, extra):
    points = points % 1.0 if periodic else points
    before = vq.cells(points, periodic=periodic).measures
    after = vq.cells(np.vstack([points, extra[: points.shape[1]]]), periodic=periodic).measures[:-1]
    assert (after <= before + 1e-13).all()


@given(adversarial_sets(), st.lists(st.integers(0, 2**20), min_size=3, max_size=3))
def test_torus_cells_move_with_their_points(points, shift):
    points = np.floor(points * 2**20) / 2**20 % 1.0  # so that shifts are exact
    moved = (points + np.array(shift[: points.shape[1]]) / 2**20) % 1.0
    np.testing.assert_allclose(
        vq.cells(moved, periodic=True).measures, vq.cells(points, periodic=True).measures, rtol=0, atol=1e-13
    )


@given(adversarial_sets(max_size=12))
def test_torus_cells_are_the_middle_cells_of_tiled_copies(points):
    points = np.floor(points * 2**20) / 2**20 % 1.0
    d = points.shape[1]
    tiles = np.array(list(itertools.product(range(4), repeat=d)))  # 4: a power of two scales exactly
    tiled = ((points + tiles[:, None]) / 4).reshape(-1, d)
    measures = vq.cells(tiled).measures.reshape(4**d, -1) * 4**d
    inner = [i for i, tile in enumerate(tiles) if ((tile == 1) | (tile == 2)).all()]
    for i in inner:
        np.testing.assert_allclose(measures[i], vq.cells(points, periodic=True).measures, rtol=0, atol=1e-12)


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


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("periodic", [False, True])
def test_lattices_are_exact(d, periodic):
    k = {1: 1000, 2: 40, 3: 13}[d]
    np.testing.assert_allclose(vq.cells(lattice(k, d, centred=True), periodic=periodic).measures, k**-d, rtol=1e-12)
    if not periodic:  # with points on faces, edges and corners: half, quarter and eighth cells
        corners = lattice(k, d, centred=False)
        expected = np.prod(np.where((corners == 0) | (corners == 1), 0.5, 1.0) / k, axis=1)
        np.testing.assert_allclose(vq.cells(corners).measures, expected, rtol=1e-12)


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


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("periodic", [False, True])
def test_points_a_hair_apart_on_a_face(d, periodic):
    """Their bisectors are one line but for rounding: walking around the cell must not go round twice."""
    rng = np.random.default_rng(9)
    x = rng.integers(0, 8, (200, d)) / 8
    x[:60, 0] = 10.0 ** -rng.uniform(1, 300, 60)
    assert abs(vq.cells(x, periodic=periodic).measures.sum() - 1) <= 1e-12


@pytest.mark.parametrize("shape", [(30_000, 1), (30_000, 2), (10_000, 3), (50, 64, 1), (50, 64, 2), (50, 64, 3)])
@pytest.mark.parametrize("periodic", [False, True])
def test_bits_do_not_depend_on_threads(shape, periodic):
    points = np.random.default_rng(3).random(shape)
    one, two, four = (vq.cells(points, periodic=periodic, threads=t).measures for t in (1, 2, 4))
    assert one.tobytes() == two.tobytes() == four.tobytes()


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


def test_the_open_border_of_the_torus():
    with pytest.raises(ValueError, match=r"\[0, 1\)"):
        vq.cells([[0.5, 1.0]], periodic=True)


def test_cells_keep_their_own_points():
    points = np.random.default_rng(0).random((50, 2))
    kept = vq.cells(points)
    before = vq.cells(points.copy()).measures
    points[:] = np.nan
    np.testing.assert_array_equal(kept.measures, before)
