"""Trees of boxes: they tile the box, and are small where the integrand varies."""

import numpy as np
import pytest

from voroquad.integrals.partition import Partition, grow


def ridge(y):
    return np.exp(-(((y[0] - y[1]) / 0.05) ** 2))


def tree(d, n=3000, f=ridge):
    y = np.random.default_rng(1).random((d, n))
    return y, grow(y, f(y)[None], np.full(n, 1 / n))


@pytest.mark.parametrize("d", [2, 3, 5])
def test_leaves_tile_the_box(d):
    y, partition = tree(d)
    assert len(partition) > 4
    assert partition.volumes.sum() == pytest.approx(1, abs=1e-15)
    assert partition.shares(0.25).sum() == pytest.approx(1, abs=1e-12)
    leaf = partition.leaf_of(y)
    assert (y >= partition.low[leaf].T).all()
    assert (y < partition.high[leaf].T).all()
    assert set(leaf.tolist()) == set(range(len(partition)))


def test_deviations_are_those_of_the_samples_in_each_leaf(monkeypatch):
    """Weighted, of two components in units of their mean sizes."""
    monkeypatch.setattr("voroquad.integrals.partition.OF_PARENT", 0)
    rng = np.random.default_rng(3)
    y, w = rng.random((2, 2000)), rng.uniform(0.5, 1.5, 2000)
    f = np.stack([ridge(y), 1e6 * ridge(y[::-1] ** 2)])
    partition = grow(y, f, w)
    leaf = partition.leaf_of(y)
    unit = (f * w).sum(axis=1) / w.sum()
    for k in range(len(partition)):
        at = leaf == k
        mean = np.average(f[:, at], weights=w[at], axis=1)
        variance = np.average((f[:, at] - mean[:, None]) ** 2, weights=w[at], axis=1) * at.sum() / (at.sum() - 1)
        assert partition.deviation[k] == pytest.approx(np.sqrt((variance / unit**2).sum()), rel=1e-9)


def test_leaves_whose_samples_are_alike_may_have_missed_something():
    """Far from the ridge all values are 0 but for rounding."""
    y, partition = tree(2)
    flat = np.bincount(partition.leaf_of(y), ridge(y), len(partition)) < 1e-9
    assert flat.any()
    assert (partition.deviation[flat] > 1e-6).all()
    assert partition.deviation[flat].max() < partition.deviation.max() / 5


def test_a_diagonal_ridge_is_found_although_no_single_split_shows_it():
    y, partition = tree(2)
    away = np.abs((partition.low + partition.high) @ [0.5, -0.5]) > 0.25
    assert partition.volumes[away].max() >= 1 / 64
    assert partition.volumes[~away].min() <= 1 / 512
    assert (partition.volumes * partition.deviation).sum() < 0.35 * ridge(y).std() / ridge(y).mean()


def test_nothing_to_split():
    assert len(tree(3, f=lambda y: np.ones(y.shape[1]))[1]) == 1
    assert len(tree(3, f=lambda y: np.zeros(y.shape[1]))[1]) == 1
    assert len(tree(2, n=8)[1]) == 1
    assert Partition.whole(3).leaf_of(np.full((3, 4), 0.5)).tolist() == [0] * 4
    noise = np.random.default_rng(5)
    assert len(tree(4, f=lambda y: noise.normal(size=y.shape[1]))[1]) < 30
