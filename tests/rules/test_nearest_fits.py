"""Leave-one-out of independent samples at any order: exact for polynomials, unbiased for all."""

import math

import numpy as np
import pytest

import voroquad as vq
from voroquad.rules import nearest_fits as nearest_leave_one_out
from voroquad.rules.nearest_fits import leave_one_out


@pytest.mark.parametrize(
    ("n", "d", "order"), [(20, 1, 2), (60, 1, 4), (50, 2, 1), (300, 2, 4), (150, 3, 1), (400, 3, 3), (200, 5, 1)]
)
def test_polynomials_up_to_the_order_are_integrated_exactly(n, d, order):
    points = vq.sample("uniform", n, d, rng=3).points
    w = vq.weights(points, design="uniform", order=order, debias="leave-one-out")
    for powers in np.ndindex((order + 1,) * d):
        if sum(powers) <= order:
            exact = 1 / np.prod(np.array(powers) + 1.0)
            assert w @ np.prod(points ** np.array(powers), axis=1) == pytest.approx(exact, abs=1e-12)


@pytest.mark.parametrize(("n", "order"), [(1, 3), (2, 1), (3, 0), (4, 2), (9, 1)])
def test_few_samples_lower_the_order(n, order):
    w = leave_one_out(vq.sample("uniform", n, 2, rng=1).points, order, 1)
    assert w.sum() == pytest.approx(1, abs=1e-14)
    assert np.isfinite(w).all()


def by_definition(points, order, f):
    """Î with one reconstruction for each sample left out, each from scratch."""
    n, d = points.shape
    k = nearest_leave_one_out._neighbours(order, d)
    per_axis = math.floor(n ** (1 / d) + 1e-9)
    terms = [q for q in np.ndindex((order + 1,) * d) if sum(q) <= order]
    nodes, weights = np.polynomial.legendre.leggauss(order + 1)
    values, total = f(points), 0.0
    for i in range(n):
        others = np.delete(np.arange(n), i)
        for box in np.ndindex((per_axis,) * d):
            centre = (np.array(box) + 0.5) / per_axis
            near = others[np.argsort(np.linalg.norm(points[others] - centre, axis=1))]
            radius = np.linalg.norm(points[near[k]] - centre)
            local = (points[near[:k]] - centre) / radius
            root = np.maximum(1 - (local**2).sum(axis=1), 1e-3)
            design = np.stack([np.prod(local ** np.array(q), axis=1) for q in terms], axis=1)
            fit = np.linalg.lstsq(design * root[:, None], values[near[:k]] * root, rcond=None)[0]
            at = np.stack(np.meshgrid(*[nodes / 2 / per_axis / radius] * d, indexing="ij"), axis=-1).reshape(-1, d)
            mass = np.prod(np.stack(np.meshgrid(*[weights / 2] * d, indexing="ij"), axis=-1), axis=-1).ravel()
            basis = np.stack([np.prod(at ** np.array(q), axis=1) for q in terms], axis=1)
            total += mass @ basis @ fit / per_axis**d
            if tuple((points[i] * per_axis).astype(int)) == box:
                x = (points[i] - centre) / radius
                total -= np.array([np.prod(x ** np.array(q)) for q in terms]) @ fit
        total += values[i]
    return total / n


def test_the_weights_are_those_of_the_definition():
    points = vq.sample("uniform", 60, 2, rng=4).points
    w = leave_one_out(points, 1, threads=2)
    assert w @ np.exp(points.sum(axis=1)) == pytest.approx(
        by_definition(points, 1, lambda x: np.exp(x.sum(axis=1))), rel=1e-12
    )


# 8 checks at 5.5 standard errors: a correct program exceeds one of them once in 3e6 seeds. With so many
# sets a bias of 0.1 standard deviations of one estimate shows as |z| ≈ 5.6.
SETS = 3100


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("n", "d", "order"), [(16, 1, 1), (16, 2, 1), pytest.param(27, 3, 1, marks=pytest.mark.slow), (30, 4, 0)]
)
def test_unbiased(z_score, n, d, order):
    points = vq.sample("uniform", n, d, sets=SETS, rng=5).points
    w = vq.weights(points, design="uniform", order=order, debias="leave-one-out")
    near_the_border = (points[..., 0] < 0.06).astype(float)
    assert abs(z_score((w * near_the_border).sum(axis=1), 0.06)) < 5.5
    assert abs(z_score((w * np.exp(points[..., 0])).sum(axis=1), math.e - 1)) < 5.5


@pytest.mark.statistical
def test_a_fit_that_knows_its_sample_is_found_biased(z_score):
    points = vq.sample("uniform", 16, 2, sets=1500, rng=5).points
    voronoi = vq.weights(points, design="uniform")
    assert abs(z_score((voronoi * (points[..., 0] < 0.06)).sum(axis=1), 0.06)) > 6.5
