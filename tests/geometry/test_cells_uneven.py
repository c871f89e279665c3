"""Voronoi cells of sets that break careless algorithms: clusters, gaps, planes that are one but for rounding."""

from __future__ import annotations

import numpy as np
import pytest
from cpu_time import cpu_time

import voroquad as vq


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


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("kind", ["cantor", "octaves"])
def test_bits_of_cells_beside_gaps_do_not_depend_on_threads(kind, d):
    """What bounded one cell from afar is tried first for the next."""
    points = clustered(kind, 5000, d)
    one, *others = (vq.cells(points, threads=t).measures.tobytes() for t in (1, 3, 4))
    assert set(others) == {one}


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


@pytest.mark.parametrize("others", range(1, 8))
@pytest.mark.parametrize("corner", [(0, 0), (0, 1), (1, 0)])
def test_any_two_of_few_points_may_coincide(others, corner):
    """A dozen in one bucket of a grid, which are not split further but compared with each other.

    The curve ends in one of the corners.
    """
    rng = np.random.default_rng(others)
    near, far = 0.1 + 1e-3 * rng.random((12, 2)), 0.5 + 0.5 * rng.random((others, 2))
    for i in range(12):
        for j in range(i + 1, 12):
            points = np.abs(corner - np.concatenate([near, far]))
            points[j] = points[i]
            measures = vq.cells(points).measures
            assert measures[i] == measures[j]
            np.testing.assert_allclose(2 * measures[i], vq.cells(np.delete(points, j, axis=0)).measures[i], rtol=1e-9)
