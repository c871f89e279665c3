"""Global fits: what is left out by one factorisation is what fits from scratch miss."""

import math

import numpy as np
import pytest

import voroquad as vq
from voroquad import _core
from voroquad.designs.multi_jittered import period
from voroquad.rules.global_fits import SAMPLES_PER_TERM, GlobalFits, degrees
from voroquad.rules.groups import Groups
from voroquad.rules.kriging_rules import strata_in_colours
from voroquad.rules.polynomials import at_points, over_boxes, powers_up_to


@pytest.mark.parametrize("d", [2, 3, 4])
@pytest.mark.parametrize("n", [9, 16, 49, 128, 500, 2048])
def test_degrees_are_the_highest_with_so_many_samples_per_term(n, d):
    found = degrees(n, d)
    expected = set()
    for share in SAMPLES_PER_TERM:
        expected.add(max(p for p in range(60) if p == 0 or math.comb(p + d, d) <= n / share))
    assert found == tuple(sorted(expected - {0}))


@pytest.fixture(params=[((7, 8), (2, 3, 5)), ((4, 4, 5), (1, 3)), ((3, 3, 2, 3), (1, 2))], ids=["d=2", "d=3", "d=4"])
def case(request):
    strata, tried = request.param
    samples = vq.sample("multi-jittered", math.prod(strata), len(strata), rng=3)
    group, axes = strata_in_colours(samples.strata, period(len(strata)))
    f = np.stack([np.exp(samples.points.sum(axis=1)), np.sin(9 * samples.points[:, 0])])
    return samples.points, group, axes, tried, f


def from_scratch(points, known, f, degree):
    """Coefficients (fields, terms)."""
    terms = at_points(points, powers_up_to(degree, points.shape[1]))
    return np.linalg.lstsq(terms[known], f[:, known].T, rcond=None)[0].T, terms


def fits_of(points, group, axes, tried):
    return GlobalFits(points, Groups.of(group, group.max() + 1), axes, tried)


@pytest.mark.parametrize("left_out", [(0, 1), (2, 5)])
def test_squares_are_those_of_fits_from_scratch(case, left_out):
    points, group, axes, tried, f = case
    out = np.isin(group, left_out)
    pairs = np.array([[1, 2], left_out])
    found = fits_of(points, group, axes, tried).squares(pairs, f)
    assert found.shape == (len(tried), 2, 2, 2)
    for squares, degree in zip(found[:, :, 1], tried, strict=True):
        coefficients, terms = from_scratch(points, ~out, f, degree)
        missed = np.square(f - coefficients @ terms.T)
        expected = np.stack([missed[:, group == g].sum(axis=1) for g in left_out], axis=1)
        np.testing.assert_allclose(squares, expected, rtol=1e-8, atol=1e-20)


def test_residuals_are_those_of_fits_from_scratch(case):
    points, group, axes, tried, f = case
    fits = fits_of(points, group, axes, tried)
    for which, degree in enumerate(tried):
        residuals = fits.residuals(which, np.array([1, 0]), f)
        assert (residuals[:, group > 1] == 0).all()
        for c in (0, 1):
            out = group == c
            coefficients, terms = from_scratch(points, ~out, f, degree)
            np.testing.assert_allclose(residuals[:, out], f[:, out] - coefficients @ terms[out].T, atol=1e-10)


def test_weights_are_the_integral_and_the_corrections(case):
    points, group, axes, tried, f = case
    fits = fits_of(points, group, axes, tried)
    groups = np.array([2, 0])
    for which, degree in enumerate(tried):
        for c, weights in zip(groups, fits.weights(which, groups), strict=True):
            out = group == c
            coefficients, terms = from_scratch(points, ~out, f, degree)
            integrals = over_boxes(axes, powers_up_to(degree, points.shape[1]))[c]
            expected = coefficients @ integrals + (f[:, out] - coefficients @ terms[out].T).sum(axis=1)
            np.testing.assert_allclose(f @ weights, expected, atol=1e-10)


def test_a_polynomial_that_the_others_do_not_determine_is_no_candidate():
    """Of 12 samples, 4 are left: enough for degree 1, in the plane, and not for degree 2."""
    samples = vq.sample("stratified", 12, 2, rng=1)
    _, axes = strata_in_colours(samples.strata, 2)
    group = np.where(np.arange(12) < 8, np.arange(12) % 2, 2)
    f = np.exp(samples.points.sum(axis=1))[None]
    squares = fits_of(samples.points, group, axes, (1, 2)).squares(np.array([[0, 1], [0, 2]]), f)
    coefficients, terms = from_scratch(samples.points, group == 2, f, 1)
    missed = np.square(f - coefficients @ terms.T)[0]
    np.testing.assert_allclose(squares[0, 0, 0], [missed[group == 0].sum(), missed[group == 1].sum()], atol=1e-10)
    assert (squares[1, 0] == np.inf).all()
    assert np.isfinite(squares[0]).all()


def test_terms_that_are_singular_to_rounding_are_orthonormalised_all_the_same():
    """On a tiny square high powers are all but alike: the Cholesky factor of their products does not exist."""
    samples = vq.sample("multi-jittered", 64, 2, rng=1)
    points = 0.5 + 1e-3 * samples.points
    group, axes = strata_in_colours(samples.strata, 3)
    f = np.exp(points.sum(axis=1))[None]
    fits = fits_of(points, group, axes, (1, 4))
    linear, quartic = (abs(fits.residuals(which, np.arange(9), f)).max() for which in range(2))
    assert quartic < 1e-3 * linear


def test_where_the_others_do_not_determine_a_polynomial_nothing_is_predicted():
    """Of 12 samples 3 are left: fewer than the 6 terms of degree 2."""
    samples = vq.sample("stratified", 12, 2, rng=1)
    _, axes = strata_in_colours(samples.strata, 2)
    group = np.where(np.arange(12) < 9, 0, 1)
    f = np.exp(samples.points.sum(axis=1))[None]
    fits = fits_of(samples.points, group, axes, (2,))
    np.testing.assert_array_equal(fits.residuals(0, np.array([0]), f)[:, group == 0], f[:, group == 0])
    np.testing.assert_array_equal(fits.weights(0, np.array([0]))[0], 1.0 * (group == 0))


def test_what_is_not_determined_is_refused():
    groups = Groups.of(np.arange(64) % 4, 4)
    fits = _core.GlobalFits(groups.in_core, np.zeros((64, 3)), np.zeros((64, 3)), [3])
    values = np.ones((1, 64))
    assert not fits.independent
    for call in (
        lambda: fits.squares(np.array([[0, 1]]), values),
        lambda: fits.residuals(0, np.array([0]), values),
        lambda: fits.weights(0, np.array([0])),
    ):
        with pytest.raises(ValueError, match="do not determine all terms"):
            call()
