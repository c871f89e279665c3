"""Nested polynomials: their terms, least squares, and what they predict."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from voroquad.rules.nested_fits import NormalEquations, Terms, fits, predicted, terms_of


@pytest.mark.parametrize(("d", "most"), [(1, 9), (2, 30), (4, 90), (7, 130)])
def test_families_hold_every_term_once(d, most):
    terms = Terms(d, most)
    powers = [tuple(p) for p in terms.powers]
    assert len(set(powers)) == len(powers)
    by_degree, by_cross = terms.families
    for family, measure in ((by_degree, sum), (by_cross, lambda p: math.prod(a + 1 for a in p))):
        assert len(family.order) <= most
        assert family.sizes[0] == 1
        assert family.sizes[-1] == len(family.order)
        chosen = [powers[i] for i in family.order]
        for size in family.sizes:
            level = max(map(measure, chosen[:size]))
            everything = itertools.product(range(min(level, most) + 1), repeat=d) if d <= 4 else []
            for p in everything:
                assert (p in chosen[:size]) == (measure(p) <= level)


def test_terms_are_products_of_orthonormal_polynomials():
    terms = Terms(3, 40)
    x = np.random.default_rng(1).random((50, 3))
    for power, row in zip(terms.powers, terms.at(x), strict=True):
        along = [
            math.sqrt(2 * p + 1) * np.polynomial.Legendre.basis(p)(2 * t - 1) for p, t in zip(power, x.T, strict=True)
        ]
        np.testing.assert_allclose(row, np.prod(along, axis=0), rtol=1e-12, atol=1e-12)


def test_each_candidate_is_the_least_squares_fit_of_its_terms():
    rng = np.random.default_rng(2)
    terms, x, y = terms_of(3, 25), rng.random((400, 3)), rng.random((2, 400))
    coefficients = fits(NormalEquations.of(terms, x, y), terms)
    candidates = [family.order[:size] for family in terms.families for size in family.sizes]
    assert len(coefficients) == len(candidates)
    for c, kept in zip(coefficients, candidates, strict=True):
        exact = np.linalg.lstsq(terms.at(x)[kept].T, y.T, rcond=None)[0]
        np.testing.assert_allclose(c[kept], exact, rtol=1e-6, atol=1e-8)
        assert np.count_nonzero(c.any(axis=1)) == len(kept)
    np.testing.assert_allclose(predicted(terms, coefficients[3], x), coefficients[3].T @ terms.at(x), rtol=1e-12)


def test_moments_of_parts_add_up():
    rng = np.random.default_rng(3)
    terms, x, y = terms_of(2, 10), rng.random((10_000, 2)), rng.random((1, 10_000))
    whole, first, rest = (
        NormalEquations.of(terms, x[s], y[:, s]) for s in (slice(None), slice(3000), slice(3000, None))
    )
    for both in (first + rest, whole):
        np.testing.assert_allclose(np.triu(both.gram), np.triu(terms.at(x) @ terms.at(x).T), rtol=1e-10, atol=1e-9)
        np.testing.assert_allclose(both.product, terms.at(x) @ y.T, rtol=1e-10, atol=1e-9)
        assert both.n == 10_000
    np.testing.assert_allclose((whole - first).product, rest.product, rtol=1e-9, atol=1e-9)
