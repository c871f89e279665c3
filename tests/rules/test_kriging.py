"""Kriging: the prediction, its integrals, and all that groups left out change."""

import math

import numpy as np
import pytest

from voroquad.rules.covariances import GAUSSIAN, MATERN_7, MATERN_9
from voroquad.rules.kriging import Kriging, Model, model
from voroquad.rules.polynomials import Intervals


def matern(x, y, length):
    s = math.sqrt(7) / length * abs(x[:, None, :] - y[None, :, :])
    return np.prod((1 + s + 0.4 * s**2 + s**3 / 15) * np.exp(-s), axis=-1)


def matern_9(x, y, length):
    s = 3 / length * abs(x[:, None, :] - y[None, :, :])
    return np.prod((1 + s + 3 / 7 * s**2 + 2 / 21 * s**3 + s**4 / 105) * np.exp(-s), axis=-1)


def gaussian(x, y, length):
    return np.exp(-np.square(x[:, None, :] - y[None, :, :]).sum(axis=-1) / (2 * length**2))


def monomials(points):
    """1, x_a and x_a x_b: any basis of degree 2 will do."""
    d = points.shape[1]
    columns = [np.ones(len(points)), *points.T]
    columns += [points[:, a] * points[:, b] for a in range(d) for b in range(a, d)]
    return np.stack(columns, axis=-1)


def predicted(samples, values, at, length, noise, covariance=matern):
    """Universal kriging from its textbook system."""
    n, terms = len(samples), monomials(samples)
    system = np.zeros((n + terms.shape[1],) * 2)
    system[:n, :n] = covariance(samples, samples, length) + noise * np.eye(n)
    system[:n, n:], system[n:, :n] = terms, terms.T
    solution = np.linalg.solve(system, np.append(values, np.zeros(terms.shape[1])))
    return covariance(at, samples, length) @ solution[:n] + monomials(at) @ solution[n:]


@pytest.fixture
def samples():
    return np.random.default_rng(1).random((60, 3))


COVARIANCES = pytest.mark.parametrize(
    ("covariance", "reference"),
    [(MATERN_7, matern), (MATERN_9, matern_9), (GAUSSIAN, gaussian)],
    ids=["matern-7", "matern-9", "gaussian"],
)


def krige(samples, degree=2, noise=1e-3, covariance=MATERN_7):
    return Kriging(samples, Model(degree, 0.5, noise, covariance))


@COVARIANCES
def test_covariances_of_the_core(samples, covariance, reference):
    at = np.random.default_rng(2).random((7, 3))
    np.testing.assert_allclose(covariance.matrix(samples, 0.3, 2), reference(samples, samples, 0.3), rtol=1e-13)
    np.testing.assert_allclose(covariance.between(at, samples, 0.3, 2), reference(at, samples, 0.3), rtol=1e-13)


@pytest.mark.parametrize("d", [16, 17, 100, 400, 1000])
def test_covariances_of_many_axes_neither_overflow_nor_vanish_too_early(d):
    x = np.random.default_rng(1).random((2, d))
    s = math.sqrt(7) / 0.5 * np.abs(x[0] - x[1])
    logarithm = float(np.sum(np.log1p(s + 2 / 5 * s**2 + s**3 / 15) - s))
    between = MATERN_7.between(x[:1], x[1:], 0.5, 1)[0, 0]
    assert MATERN_7.matrix(x, 0.5, 1)[0, 1] == between
    assert between == pytest.approx(math.exp(logarithm), rel=1e-11)


@COVARIANCES
def test_the_integral_of_the_prediction(samples, covariance, reference):
    values = np.exp(samples @ [1.0, -2.0, 0.5])
    low, high, part = np.array([0.0, 0.5, 0.75]), np.array([0.5, 0.75, 1.0]), np.array([1, 0, 1])
    kriging = krige(samples, covariance=covariance)
    integrals = kriging.integrals(kriging.over_boxes([Intervals(low, high, part, 2)] * 3))
    nodes, weights = np.polynomial.legendre.leggauss(10)
    x = ((low + high)[:, None] + (high - low)[:, None] * nodes) / 2  # (interval, node), each interval of mass 1
    for measure, parts in enumerate(np.ndindex(2, 2, 2)):
        axes = [x[part == p].ravel() for p in parts]
        mass = [np.tile(weights / 2, (part == p).sum()) for p in parts]
        at = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        shares = np.prod(np.stack(np.meshgrid(*mass, indexing="ij"), axis=-1), axis=-1).ravel()
        exact = shares @ predicted(samples, values, at, 0.5, 1e-3, reference)
        assert integrals[measure] @ values == pytest.approx(exact, rel=1e-7)


def test_masses_at_points(samples):
    values, at = np.cos(4 * samples.sum(axis=1)), np.random.default_rng(2).random((5, 3))
    kriging = krige(samples)
    masses = kriging.at_points(at)
    there = predicted(samples, values, at, 0.5, 1e-3)
    np.testing.assert_allclose(kriging.integrals(masses) @ values, there, rtol=1e-9)
    np.testing.assert_allclose(kriging.integrate(masses, np.stack([values, 2 * values])), [there, 2 * there], rtol=1e-9)
    twice = kriging.at_points(at)
    twice.take_away(2, masses)
    np.testing.assert_allclose(kriging.integrate(twice, values[None])[0, 2], there[2] - there.sum(), rtol=1e-9)


@pytest.mark.parametrize("sizes", [[1] * 60, [20, 20, 20], [7, 1, 30, 1, 21]])
def test_leaving_groups_out_is_predicting_from_the_rest(samples, sizes):
    values = np.cos(4 * samples.sum(axis=1))
    group = np.random.default_rng(3).permutation(np.repeat(np.arange(len(sizes)), sizes))
    kriging = krige(samples)
    (missed,) = kriging.leave_out(group, kriging.apply(values[None]))
    for g in range(len(sizes)):
        own = group == g
        rest = predicted(samples[~own], values[~own], samples[own], 0.5, 1e-3)
        np.testing.assert_allclose(missed[own], values[own] - rest, atol=1e-9)


def test_predictions_reproduce_the_drift(samples):
    kriging = krige(samples, noise=1e-9)
    polynomials = monomials(samples).T
    assert abs(kriging.apply(polynomials)).max() < 1e-5  # of 1 / noise
    weights = kriging.integrals(kriging.over_boxes([Intervals(np.zeros(1), np.ones(1), np.zeros(1, int), 1)] * 3))
    exact = [1] + [1 / 2] * 3 + [1 / 3 if a == b else 1 / 4 for a in range(3) for b in range(a, 3)]
    np.testing.assert_allclose(weights @ polynomials.T, [exact], atol=1e-12)


def test_samples_that_do_not_determine_the_drift_lower_its_degree():
    line = np.linspace(0.1, 0.9, 40)[:, None] * np.ones(2)
    for points in (line, np.full((40, 2), 0.3)):
        kriging = krige(points)
        (y,) = kriging.leave_out(np.arange(40), np.ones((1, 40)))
        assert np.isfinite(y).all()
        assert np.isfinite(kriging.apply(np.ones((1, 40)))).all()


def test_the_model_assumes_what_the_samples_can_resolve():
    assert [model(n, 3).degree for n in (1, 47, 48, 120, 10_000)] == [0, 0, 1, 2, 9]
    # So much of the process lies between samples an eighth apart; more is assumed, and most in the plane
    assert model(512, 3) == Model(4, 0.5, pytest.approx(3 * 0.25**7))
    assert model(64, 2).noise == pytest.approx(12 * 0.25**7)
    far, near = model(16, 2), model(10_000, 2)
    assert (far.length, near.length) == (0.5, pytest.approx(0.05))
    assert near.noise == pytest.approx(12 / 5**7)  # the same for all that have five spacings to a length
    assert near.noise < far.noise
