"""Global fits: what is left out by one factorisation is what fits from scratch miss."""

import math

import numpy as np
import pytest

import voroquad as vq
from voroquad.designs.multi_jittered import period
from voroquad.rules.global_fits import SAMPLES_PER_TERM, GlobalFits, degrees
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


@pytest.mark.parametrize("left_out", [(0,), (0, 1), (2, 5)])
def test_residuals_are_those_of_fits_from_scratch(case, left_out):
    points, group, axes, tried, f = case
    out = np.isin(group, left_out)
    found = GlobalFits(points, group, axes, tried).left_out(left_out, f)
    for residuals, degree in zip(found, tried, strict=True):
        coefficients, terms = from_scratch(points, ~out, f, degree)
        np.testing.assert_allclose(residuals, f[:, out] - coefficients @ terms[out].T, atol=1e-10)


def test_values_of_another_integrand_are_not_mistaken_for_those_before(case):
    points, group, axes, tried, f = case
    fits = GlobalFits(points, group, axes, tried)
    fits.left_out((0,), f)
    np.testing.assert_allclose(fits.left_out((1,), 2 * f), 2 * fits.left_out((1,), f), rtol=1e-12)


def test_weights_are_the_integral_and_the_corrections(case):
    points, group, axes, tried, f = case
    fits = GlobalFits(points, group, axes, tried)
    for c in np.unique(group):
        out = group == c
        for weights, degree in zip(fits.weights(c), tried, strict=True):
            coefficients, terms = from_scratch(points, ~out, f, degree)
            integrals = over_boxes(axes, powers_up_to(degree, points.shape[1]))[c]
            expected = coefficients @ integrals + (f[:, out] - coefficients @ terms[out].T).sum(axis=1)
            np.testing.assert_allclose(f @ weights, expected, atol=1e-10)


def test_a_polynomial_that_the_others_do_not_determine_is_no_candidate():
    """Of 12 samples, 4 are left: enough for degree 1, in the plane, and not for degree 2."""
    samples = vq.sample("stratified", 12, 2, rng=1)
    group, axes = strata_in_colours(samples.strata, 2)
    group = np.where(np.arange(12) < 8, 0, 1)
    f = np.exp(samples.points.sum(axis=1))[None]
    found = GlobalFits(samples.points, group, axes, (1, 2)).left_out((0,), f)
    coefficients, terms = from_scratch(samples.points, group == 1, f, 1)
    np.testing.assert_allclose(found[0], f[:, :8] - coefficients @ terms[:8].T, atol=1e-10)
    assert (found[1] == np.inf).all()
