"""Gaussian measures whose coordinates are turned."""

import math

import numpy as np
import pytest
import scipy.stats

import voroquad as vq
from voroquad.integrals.rotation import RotatedGaussian, directions


def normals(d, mean=0.0, sd=1.0):
    return vq.ProductMeasure(*[scipy.stats.norm(mean, sd)] * d)


def test_a_linear_function_has_its_slope_as_the_first_direction():
    z = np.random.default_rng(1).normal(size=(512, 8))
    slope = np.arange(8.0) - 3
    q = directions(z, (z @ slope)[None])
    np.testing.assert_allclose(q @ q.T, np.eye(8), atol=1e-12)
    np.testing.assert_allclose(abs(q[0] @ slope), np.linalg.norm(slope), rtol=1e-12)


def test_a_ridge_is_found_across_the_slope():
    z = np.random.default_rng(1).normal(size=(2000, 6))
    a, b = np.linalg.qr(np.random.default_rng(2).normal(size=(6, 2)))[0].T
    q = directions(z, (z @ a + 0.5 * (z @ b) ** 2)[None])
    assert abs(q[0] @ a) > 0.98
    assert abs(q[1] @ b) > 0.98


def test_several_fields_of_any_size_count_alike():
    z = np.random.default_rng(1).normal(size=(512, 5))
    q = directions(z, np.stack([z[:, 0] * 1e9, z[:, 1], np.ones(512), np.full(512, np.nan)]))
    assert np.linalg.norm(q[0, :2]) == pytest.approx(1, abs=0.05)
    np.testing.assert_array_equal(directions(z, np.ones((1, 512))), np.eye(5))


def test_rotated_coordinates_have_the_moments_of_the_measure():
    q = np.linalg.qr(np.random.default_rng(1).normal(size=(5, 5)))[0]
    mean, sd = np.arange(5.0), np.arange(1.0, 6)
    u = vq.sample("sobol", 2**14, 5, rng=1).points
    x, element = RotatedGaussian(mean, sd, q).pull_back(u.T)
    np.testing.assert_allclose(x.mean(axis=1), mean, atol=1e-2)
    np.testing.assert_allclose(np.cov(x), np.diag(sd**2), atol=0.1)
    assert (element == 1).all()


@pytest.mark.parametrize("kind", [scipy.stats.norm(1, 2), scipy.stats.Normal(mu=1.0, sigma=2.0)])
def test_normal_coordinates_of_both_kinds_are_turned(kind):
    """E max(Σ x − 8, 0) for Σ x of mean 8 and variance 32: a function of one direction. Mixed coordinates stay."""

    def f(x):
        return np.maximum(x.sum(axis=0) - 8, 0)

    points = []
    counted = vq.quad(
        lambda x: points.append(x.shape[1]) or f(x), measure=vq.ProductMeasure(*[kind] * 8), n_points=2048, rng=1
    )
    assert counted.n_evaluations == sum(points)
    mixed = vq.ProductMeasure(*[kind] * 7, scipy.stats.logistic(1, 2 * math.sqrt(3) / math.pi))
    turned = [vq.quad(f, measure=vq.ProductMeasure(*[kind] * 8), n_points=2048, rng=seed) for seed in range(6)]
    still = [vq.quad(f, measure=mixed, n_points=2048, method="plain", rng=seed) for seed in range(6)]
    exact = math.sqrt(32 / (2 * math.pi))
    assert turned[0].n_evaluations == 256 + 3 * 512
    assert turned[0].degrees_of_freedom == 2
    errors = [np.sqrt(np.mean([(r.integral - exact) ** 2 for r in some])) for some in (turned, still)]
    assert errors[0] < errors[1] / 2


def test_few_evaluations_leave_the_coordinates_as_they_are():
    seen = []
    vq.quad(lambda x: seen.append(x.shape[1]) or x[0], measure=normals(16), n_points=256, rng=1)
    assert seen == [256]
    vq.quad(lambda x: seen.append(x.shape[1]) or x[0], measure=normals(16), n_points=1024, rng=1)
    assert seen[1:] == [128, 768]
    vq.quad(lambda x: seen.append(x.shape[1]) or x[0], measure=normals(16), n_points=1024, n_estimates=3, rng=1)
    assert seen[3:] == [128, 3072]


def test_the_index_is_found_to_a_hundredth():
    """A kink along one direction: the slope of a regression is a tenth off, the single-index model is not."""
    z = np.random.default_rng(1).normal(size=(512, 16))
    slope = np.linalg.qr(np.random.default_rng(2).normal(size=(16, 1)))[0][:, 0]
    q = directions(z, np.maximum(z @ slope - 0.3, 0)[None])
    regression = np.linalg.lstsq(z, np.maximum(z @ slope - 0.3, 0), rcond=None)[0]
    off = [math.sqrt(1 - min(1, (v @ slope / np.linalg.norm(v)) ** 2)) for v in (q[0], regression)]
    assert off[0] < 0.01
    assert off[1] > 0.05


PROBABILITY = scipy.stats.norm.sf(1 / math.sqrt(5))


def two_fields(x):
    """The indicator of Σ x > 1 and a product of three."""
    return np.stack([1.0 * (x.sum(axis=0) > 1), x[0] * x[1] * x[2]])


def z_scores(found):
    """Of estimates (repetitions, 2) of the means of these in five dimensions."""
    found = np.asarray(found)
    return (found.mean(axis=0) - [PROBABILITY, 0]) / (found.std(axis=0, ddof=1) / math.sqrt(len(found)))


def fresh_means(scale=1.0, repetitions=1500):
    """Means of 40 samples in coordinates that a pilot of 20 chose; a scale other than 1 makes q no rotation."""
    found = []
    for seed in range(repetitions):
        rng = np.random.default_rng(seed)
        z = rng.normal(size=(20, 5))
        q = scale * directions(z, two_fields(z.T))
        x, _ = RotatedGaussian(np.zeros(5), np.ones(5), q).pull_back(rng.random((5, 40)))
        found.append(two_fields(x).mean(axis=1))
    return found


@pytest.mark.slow
@pytest.mark.statistical
def test_unbiased_whatever_the_pilot_found():
    """With directions a tenth too long, as slopes without a common length would be, z is large."""
    assert (abs(z_scores(fresh_means())) < 5).all()
    assert abs(z_scores(fresh_means(1.1))[0]) > 6


@pytest.mark.slow
@pytest.mark.statistical
def test_quad_is_unbiased_in_turned_coordinates():
    measure = normals(5)
    found = [
        vq.quad(two_fields, measure=measure, n_points=256, method="plain", rng=seed).integral for seed in range(1000)
    ]
    assert (abs(z_scores(found)) < 5).all()


@pytest.mark.parametrize("options", [{"method": "foo"}, {"sampler": "nosuch"}, {"debias": "exchange"}])
def test_wrong_arguments_are_found_before_the_pilot(options):
    with pytest.raises(ValueError, match=r"unknown (method|sampler)|no rule for .*'exchange'"):
        vq.quad(lambda x: pytest.fail("called"), measure=normals(5), n_points=1024, **options)
