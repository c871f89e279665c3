"""Errors of fits: of one set by residuals, of several by their spread."""

import math
from functools import partial

import numpy as np
import pytest

from voroquad.rules.error_bars import of_corrections
from voroquad.rules.fit import ChosenFit, CrossFit, Fit, ResidualFit

RNG = np.random.default_rng(1)
VALUES = RNG.random((3, 2, 5))  # sets, fields, samples


def test_estimates_are_weighted_sums_of_each_set():
    fit = Fit(RNG.random((3, 5)))
    means, rounding = fit.estimates(VALUES)
    np.testing.assert_allclose(means, np.einsum("sn,sfn->sf", fit.weights, VALUES), rtol=1e-14)
    np.testing.assert_allclose(rounding, 2 * np.finfo(float).eps * means, rtol=1e-14)  # all terms are positive


def test_the_spread_of_sets_is_the_error_of_their_mean():
    means = RNG.random((4, 2))
    error, degrees = Fit(np.ones((4, 1))).standard_error(means)
    np.testing.assert_allclose(error, np.sqrt(np.square(means - means.mean(axis=0)).sum(axis=0) / 3 / 4))
    assert degrees == 3
    assert np.isnan(Fit(np.ones((1, 1))).standard_error(means[:1])[0]).all()


def test_one_set_tells_its_error_by_residuals():
    residuals = RNG.standard_normal((1, 2, 5))
    fit = ResidualFit(np.full((1, 5), 0.2), residuals, partial(of_corrections, scale=0.5))
    error, degrees = fit.standard_error(np.zeros((1, 2)))
    np.testing.assert_allclose(error, 0.5 * np.linalg.norm(residuals[0] / 5, axis=1))
    assert degrees == of_corrections(residuals[0]).degrees_of_freedom.min() < 5
    assert fit.deviations(np.zeros((1, 2))) is not None


def test_several_sets_of_strata_have_the_error_of_their_spread():
    means = RNG.random((3, 2))
    fit = ResidualFit(np.full((3, 5), 0.2), np.zeros((3, 2, 5)), of_corrections)
    np.testing.assert_array_equal(fit.standard_error(means)[0], Fit(fit.weights).standard_error(means)[0])
    np.testing.assert_array_equal(fit.deviations(means), (means - means.mean(axis=0)).T)


def test_chosen_fits_have_weights_of_each_field():
    weights = RNG.standard_normal((3, 2, 5))
    fit = ChosenFit(weights, np.zeros((3, 2, 5)), of_corrections, ("a", "b"))
    means, _ = fit.estimates(VALUES)
    np.testing.assert_allclose(means, np.einsum("sfn,sfn->sf", weights, VALUES))


def test_cross_fit_sums_over_all_replicates():
    shares = RNG.standard_normal((3, 3, 5))
    fit = CrossFit(shares.sum(axis=0), shares, 1.3)
    means, _ = fit.estimates(VALUES)
    np.testing.assert_allclose(means, np.einsum("rsn,sfn->rf", shares, VALUES))
    np.testing.assert_allclose(means.sum(axis=0), Fit(fit.weights).estimates(VALUES)[0].sum(axis=0))
    assert fit.standard_error(means)[0] == pytest.approx(1.3 * means.std(axis=0, ddof=1) / math.sqrt(3))


def test_powers_widen_the_interval_of_replicates_unless_their_spread_is_far_smaller():
    shares = RNG.standard_normal((3, 3, 5))
    means = CrossFit(shares.sum(axis=0), shares, 1.3).estimates(VALUES)[0]
    error = 1.3 * means.std(axis=0, ddof=1) / math.sqrt(3)
    fit = CrossFit(shares.sum(axis=0), shares, 1.3, np.array([9.0, 11.0]) * error)
    found, freedom = fit.standard_error(means)
    assert freedom == 2
    np.testing.assert_allclose(found, [9 * error[0] * 1.959964 / 4.302653, error[1]], rtol=1e-6)
    less = CrossFit(shares.sum(axis=0), shares, 1.3, error)
    np.testing.assert_array_equal(less.standard_error(means)[0], error)
