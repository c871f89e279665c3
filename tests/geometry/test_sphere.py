import itertools

import numpy as np
import pytest
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

import voroquad as vq

CUBE = np.array(list(itertools.product([-1, 1], repeat=3))) / np.sqrt(3)
OCTAHEDRON = np.concatenate([np.eye(3), -np.eye(3)])


def uniform(*shape, rng):
    return vq.sphere_points(np.random.default_rng(rng).random((*shape, 2)))


def f(x):
    """Neither even nor symmetric about any axis, with a jump; its mean over the sphere is sinh(√3)/√3 + 0.35."""
    return np.exp(x.sum(axis=-1)) + (x[..., 2] > 0.3)


MEAN = np.sinh(np.sqrt(3)) / np.sqrt(3) + 0.35


# ---------------------------------------------------------------------- without bias


@pytest.mark.statistical
def test_uniform_points_are_weighed_without_bias(z_score):
    x = uniform(10_000, 6, rng=1)
    w = vq.sphere_weights(x)
    assert abs(z_score((w * f(x)).sum(axis=1), MEAN)) < 5.5
    assert abs(z_score((w * (x[..., 1] > 0.5)).sum(axis=1), 0.25)) < 5.5
    assert abs(z_score((w * x[..., 0]).sum(axis=1), 0)) < 5.5


@pytest.mark.statistical
def test_points_denser_at_a_pole_are_not(z_score):
    u = np.random.default_rng(1).random((3_000, 6, 2))
    u[..., 0] **= 2
    x = vq.sphere_points(u)
    assert abs(z_score((vq.sphere_weights(x) * f(x)).sum(axis=1), MEAN)) > 20


@pytest.mark.statistical
def test_a_random_rotation_makes_any_set_unbiased(z_score):
    x = vq.sphere_points(np.random.default_rng(2).random((7, 2)) ** 2)  # one set, denser at a pole
    w = vq.sphere_weights(x)
    turns = Rotation.random(20_000, rng=3).as_matrix()
    np.testing.assert_allclose(vq.sphere_weights(x @ turns[0].T), w, atol=1e-12)
    estimates = f(x @ np.swapaxes(turns, 1, 2)) @ w
    assert abs(z_score(estimates, MEAN)) < 5.5


@pytest.mark.statistical
def test_the_error_falls_faster_than_that_of_equal_weights():
    def errors(n):
        x = uniform(200, n, rng=n)
        error = np.exp(x.sum(axis=-1)) - (MEAN - 0.35)
        return np.mean((vq.sphere_weights(x) * error).sum(axis=1) ** 2), np.mean(error.mean(axis=1) ** 2)

    (few, few_equal), (many, many_equal) = errors(16), errors(256)
    assert few < few_equal / 2
    assert few / many > 6 * few_equal / many_equal  # O(1/N²) against O(1/N)


def test_square_to_sphere_keeps_areas():
    z = vq.sphere_points(vq.sample("regular", 900, 2).points)
    np.testing.assert_allclose(np.linalg.norm(z, axis=1), 1, rtol=1e-15)
    np.testing.assert_allclose(z.mean(axis=0), 0, atol=1e-15)
    np.testing.assert_allclose(z.T @ z / 900, np.eye(3) / 3, atol=1e-3)


# ---------------------------------------------------------------------- areas


def test_areas_by_counting():
    x = uniform(50, rng=5)
    n = 200_000
    share = np.bincount(KDTree(x).query(uniform(n, rng=6))[1], minlength=50) / n
    w = vq.sphere_weights(x)
    assert np.abs((share - w) / np.sqrt(w * (1 - w) / n)).max() < 5.5


@pytest.mark.parametrize("x", [CUBE, OCTAHEDRON, np.eye(3), -np.eye(3)[:1], [[0, 0, 1], [0, 0.6, 0.8]]])
def test_equal_cells(x):
    np.testing.assert_allclose(vq.sphere_weights(x), 1 / len(x), rtol=1e-14)


@pytest.mark.parametrize("z", [0.0, 0.6, 1e-3, 1 - 1e-9])
@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 100])
def test_points_of_a_circle_share_the_sphere_like_the_circle(n, z):
    u = np.random.default_rng(n).random(n) if z < 0.99 else np.arange(n) / n
    longitude = 2 * np.pi * u
    circle = np.stack([np.cos(longitude), np.sin(longitude)]) * np.sqrt(1 - z**2)
    x = np.stack([*circle, np.full(n, z)], axis=1) @ Rotation.random(rng=7).as_matrix()
    np.testing.assert_allclose(vq.sphere_weights(x), vq.cells(u, periodic=True).measures, atol=1e-8)


def test_nearly_a_circle():
    """SciPy's areas of a set that is all but flat go over into those of a flat one."""
    longitude = 2 * np.pi * np.random.default_rng(8).random(20)
    flat = np.stack([np.cos(longitude), np.sin(longitude), 0 * longitude], axis=1)
    bumpy = flat + np.random.default_rng(9).normal(size=(20, 1)) * [0, 0, 1e-8]
    np.testing.assert_allclose(vq.sphere_weights(bumpy), vq.sphere_weights(flat), atol=1e-5)


def test_copies_share_their_cell():
    x = uniform(20, rng=10)
    w = vq.sphere_weights(x)
    again = vq.sphere_weights(np.concatenate([x, x[:5], x[:1] * (1 + 1e-7), -x[:1] * -1.0]))
    np.testing.assert_allclose(again[5:20], w[5:], rtol=1e-9)
    np.testing.assert_allclose(again[[0, 20, 25, 26]], w[0] / 4, rtol=1e-9)
    np.testing.assert_allclose(again[[1, 21]], w[1] / 2, rtol=1e-9)
    assert vq.sphere_weights([[0, 0, 1]] * 7).tolist() == [1 / 7] * 7


@pytest.mark.parametrize("seed", range(200))
def test_any_points_have_shares_of_one(seed):
    """Caps, arcs and tight crowds, with copies."""
    rng = np.random.default_rng(seed)
    groups = []
    for _ in range(rng.integers(1, 4)):
        size, many = 10.0 ** -rng.integers(0, 18), rng.integers(1, 40)
        spread = rng.normal(size=(many, 3)) if rng.integers(2) else rng.normal(size=(many, 1)) * rng.normal(size=3)
        groups.append(uniform(1, rng=rng) + size * spread)
    x = np.concatenate([*groups, groups[0][:3]])
    w = vq.sphere_weights(x / np.linalg.norm(x, axis=1, keepdims=True))
    assert w.min() >= 0
    assert abs(w.sum() - 1) <= 1e-12


def test_poles_of_a_grid_of_longitudes_and_latitudes():
    latitude, longitude = np.meshgrid(np.linspace(0, 1, 9), np.arange(16) / 16, indexing="ij")
    w = vq.sphere_weights(vq.sphere_points(np.stack([latitude.ravel(), longitude.ravel()], axis=1))).reshape(9, 16)
    np.testing.assert_allclose(w, w[:, :1] * np.ones(16), rtol=1e-9)  # 16 copies of each pole among them
    np.testing.assert_allclose(w, w[::-1], rtol=1e-9)
    assert abs(w.sum() - 1) <= 1e-12


def test_a_batch_is_its_sets():
    x = uniform(3, 10, rng=11)
    np.testing.assert_array_equal(vq.sphere_weights(x), [vq.sphere_weights(one) for one in x])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: vq.sphere_weights([[0, 0, 1], [0, 0, 2]]),
            r"points\[1\] = \[0.0, 0.0, 2.0\] is not a unit vector; divide",
        ),
        (lambda: vq.sphere_weights([[[0, 0, 1]], [[0, np.nan, 1]]]), r"points\[\(1, 0\)\] .* is not a unit vector"),
        (lambda: vq.sphere_weights([[0, 1]]), r"points must have shape \(n, 3\)"),
        (lambda: vq.sphere_weights(np.zeros((0, 3))), "n ≥ 1"),
        (lambda: vq.sphere_points([[0.5, 1.5]]), r"u\[0\] = \[0.5, 1.5\] is not inside \[0, 1\]\^2"),
        (lambda: vq.sphere_points([0.5]), r"u must have shape \(n, 2\)"),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
