"""Estimates from leaves of a partition."""

import math

import numpy as np
import pytest

from voroquad.integrals.evaluation import Function
from voroquad.integrals.integrand import Integrand
from voroquad.integrals.leaves import LeafEstimator, counts, draw
from voroquad.integrals.library import Library
from voroquad.integrals.partition import Partition, grow
from voroquad.integrals.regions import Box


def ridge(x):
    return np.exp(-(((x[0] - x[1]) / 0.05) ** 2))


def partition(d):
    y = np.random.default_rng(1).random((d, 2000))
    return grow(y, ridge(y)[None], np.full(2000, 1 / 2000))


def estimator(f, d, seed, of=None):
    box = Box([0] * d, [1] * d, Library.of(0, 1))
    integrand = Integrand(Function(f, Library.of(0, 1)), box)
    return LeafEstimator(integrand, of or partition(d), np.random.default_rng(seed), 1)


@pytest.mark.parametrize(("n", "d"), [(5600, 2), (5600, 4), (700, 4), (5600, 6), (90, 8)])
def test_counts_fill_the_budget_in_proportion(n, d):
    shares = np.random.default_rng(1).dirichlet(np.full(40, 0.5))
    found = counts(shares, n, d)
    assert found.min() >= 2
    assert 0.8 * n <= found.sum() <= n
    many = found > 50
    assert np.ptp(np.log(found[many] / shares[many])) < 1.0 if many.any() else n < 100


def test_samples_lie_in_their_leaves():
    tree = partition(3)
    groups = draw(tree, 1000, 0.25, np.random.default_rng(2))
    for group in groups:
        leaf = tree.leaf_of(group.places(tree).T)
        np.testing.assert_array_equal(leaf, np.repeat(group.leaves, group.samples.n))
    assert sorted(np.concatenate([g.leaves for g in groups]).tolist()) == list(range(len(tree)))


def test_constants_are_exact_and_several_components_alike():
    r = estimator(lambda x: np.stack([np.ones(x.shape[1]), 1e9 * ridge(x), ridge(x)]), 4, 1)(1000)
    assert r.mean[0] == pytest.approx(1, abs=1e-14)
    assert r.error[0] < 1e-14
    assert r.mean[1] == pytest.approx(1e9 * r.mean[2], rel=1e-12)
    assert r.error[1] == pytest.approx(1e9 * r.error[2], rel=1e-9)
    assert r.n <= 1000


def test_leaves_gain_where_the_integrand_is():
    """A ridge of 1/20 of the square: half of the samples by volume alone, and one leaf alone, have larger errors."""
    errors = {name: estimator(ridge, 4, 1, of)(2000).error[0] for name, of in
              (("tree", None), ("whole", Partition.whole(4)))}  # fmt: skip
    assert errors["tree"] < 0.7 * errors["whole"]


def test_what_the_samples_do_not_show_is_said():
    def kinds(f):
        return {w.kind for w in estimator(f, 2, 1)(300).warnings}

    assert kinds(lambda x: 0 * x[0]) == {"zero"}
    assert kinds(lambda x: np.exp(-1e5 * np.square(x - 0.5).sum(axis=0))) & {"few-samples", "zero"}
    assert kinds(lambda x: 1 + x[0]) == set()


@pytest.mark.statistical
def test_unbiased_given_the_partition():
    """A ridge and a jump. The control is the mean of all samples, whatever their leaves' volumes."""
    tree = partition(2)
    t = np.linspace(-1, 1, 200_001)
    exact = np.trapezoid((1 - abs(t)) * np.exp(-((t / 0.05) ** 2)), t)
    found, control = [], []
    for seed in range(500):
        r = estimator(lambda x: np.stack([ridge(x), x.sum(axis=0) < 0.7]), 2, seed, tree)(150)
        found.append(r.mean)
        groups = draw(tree, 150, 0.25, np.random.default_rng(seed))
        control.append(np.mean(np.concatenate([ridge(g.places(tree).T) for g in groups])))
    z = (np.mean(found, axis=0) - [exact, 0.245]) / (np.std(found, axis=0, ddof=1) / math.sqrt(500))
    assert (abs(z) < 4.6).all()
    assert abs(np.mean(control) - exact) / (np.std(control, ddof=1) / math.sqrt(500)) > 6
