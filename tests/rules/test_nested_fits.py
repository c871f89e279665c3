"""Nested polynomials: their terms, least squares, and when the degree rises."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from voroquad import _core
from voroquad.rules.nested_fits import NestedFits, embedded, highest_degree, terms_of


def net(d: int, n: int, seed: int = 1) -> np.ndarray:
    keys = np.random.default_rng(seed).integers(0, 2**64, size=(d, 65), dtype=np.uint64)
    return _core.SobolNet(keys, n.bit_length() - 1).points(0, n)


def powers(d: int, degree: int) -> list[tuple[int, ...]]:
    """Of the terms in the order of the core: by stems, then by the power of the last coordinate."""
    stems = [(0,) * (d - 1)]
    found = {stems[0]: None}
    for _ in range(degree if d > 1 else 0):
        later = []
        for stem in stems:
            last = max((a for a in range(d - 1) if stem[a]), default=0)
            later += [(*stem[:a], stem[a] + 1, *stem[a + 1 :]) for a in range(last, d - 1)]
        stems = later
        found |= dict.fromkeys(stems)
    return [(*stem, k) for stem in found for k in range(degree - sum(stem) + 1)]


def products(x: np.ndarray, degree: int) -> np.ndarray:
    """The terms (terms, n) at points (d, n), from NumPy's Legendre polynomials."""
    basis = np.polynomial.Legendre.basis
    return np.array(
        [
            np.prod([math.sqrt(2 * k + 1) * basis(k)(2 * t - 1) for k, t in zip(p, x, strict=True)], axis=0)
            for p in powers(len(x), degree)
        ]
    )


CASES = [(1, 9), (2, 6), (3, 5), (4, 4), (7, 2), (20, 1)]


@pytest.mark.parametrize(("d", "degree"), CASES)
def test_every_term_of_the_degree_comes_once(d, degree):
    found = powers(d, degree)
    assert len(found) == len(terms_of(d, degree)) == math.comb(degree + d, d)
    if d <= 4:
        assert set(found) == {p for p in itertools.product(range(degree + 1), repeat=d) if sum(p) <= degree}


@pytest.mark.parametrize(("d", "degree"), CASES)
def test_means_of_the_terms_over_parts(d, degree):
    x = net(d, 128)
    means = terms_of(d, degree).means(x, 4, 1)
    exact = products(x, degree).reshape(-1, 4, 32).mean(axis=2).T
    np.testing.assert_allclose(means, exact, atol=1e-12)
    np.testing.assert_array_equal(terms_of(d, degree).means(x, 4, 3), means)


@pytest.mark.parametrize(("d", "degree"), CASES)
def test_fits_are_least_squares(d, degree):
    rng = np.random.default_rng(2)
    x, y = net(d, 1024), rng.random((2, 1024))
    c = np.zeros((2, len(terms_of(d, degree))))
    squares = terms_of(d, degree).fit(x, y, c, 1e-20, 60)
    phi = products(x, degree)
    exact = np.linalg.lstsq(phi.T, y.T, rcond=None)[0].T
    np.testing.assert_allclose(c, exact, atol=1e-9)
    np.testing.assert_allclose(squares, np.square(y - exact @ phi).mean(axis=1), rtol=1e-9)
    # So are those of a polynomial, where they are rounding
    c[:] = 0
    assert terms_of(d, degree).fit(x, exact @ phi, c, 1e-20, 60).max() < 1e-25
    np.testing.assert_allclose(c, exact, atol=1e-9)
    # From there nothing changes
    again = c.copy()
    terms_of(d, degree).fit(x, y, again, 1e-20, 60)
    np.testing.assert_allclose(again, c, atol=1e-12)


def test_tolerance_is_relative_to_the_noise():
    x = net(3, 2048)
    y = np.exp(x.sum(axis=0))[None] + 0.1 * np.random.default_rng(3).standard_normal((1, 2048))
    terms, phi = terms_of(3, 4), products(x, 4)
    exact = np.linalg.lstsq(phi.T, y.T, rcond=None)[0].T
    noise = 0.01 * len(terms) / 2048
    for tolerance in (1e-2, 1e-4):
        c = np.zeros((1, len(terms)))
        terms.fit(x, y, c, tolerance, 60)
        gradient = (y - c @ phi) @ phi.T / 2048
        assert 1e-3 * tolerance * noise < np.square(gradient).sum() < 1.5 * tolerance * noise
        assert np.square(c - exact).sum() < 3 * tolerance * noise


@pytest.mark.parametrize(("d", "degree", "to"), [(1, 3, 5), (3, 2, 4), (4, 3, 3), (6, 1, 2)])
def test_coefficients_of_a_higher_degree_are_the_same_polynomial(d, degree, to):
    x, rng = net(d, 64), np.random.default_rng(4)
    c = rng.random((2, len(terms_of(d, degree))))
    np.testing.assert_allclose(embedded(c, d, degree, to) @ products(x, to), c @ products(x, degree), atol=1e-11)


def test_highest_degree():
    assert [highest_degree(3, most) for most in (1, 3.9, 4, 10, 19.9, 20)] == [0, 0, 1, 2, 2, 3]


def fits_of(values: np.ndarray, x: np.ndarray, worth: np.ndarray, highest: int = 6) -> NestedFits:
    return NestedFits.of(
        lambda n: (x[:, : -(-n // 16) * 16], values[:, : -(-n // 16) * 16]), len(x), len(values), highest, worth
    )


def test_degrees_rise_while_they_pay():
    x = net(3, 2048)
    y = np.stack(
        [
            np.exp(x.sum(axis=0)),
            1.0 * (x.sum(axis=0) < 1.3),  # an edge
            x[0] ** 3 * x[1],  # exact of degree 4
            0 * x[0] + 3,
            np.cos(6 * x[0]),
        ]
    )
    worth = np.array([1e-6, 1e-3, 1e-6, 0, 1e-3])
    found = fits_of(y, x, worth)
    exact = found.degrees[2]  # one degree more where the first leaves more than rounding
    assert found.degrees.tolist() == [6, 0, exact, 1, 6]
    assert exact in (4, 5)
    assert sorted(found.coefficients) == [1, 2, 3, 4, 5, 6]
    for degree, c in found.coefficients.items():
        assert c.shape == (5, len(terms_of(3, degree)))
        assert c[2].any() == (degree <= exact)
    assert not found.coefficients[6][1].any()
    # A component is fitted as if it were alone, also where there are more than fit into one pass
    many = fits_of(np.concatenate([y, y]), x, np.concatenate([worth, worth]))
    alone = fits_of(y[:1], x, worth[:1])
    assert many.degrees.tolist() == 2 * found.degrees.tolist()
    for degree, c in alone.coefficients.items():
        np.testing.assert_array_equal(many.coefficients[degree][[0, 5]], np.repeat(c, 2, axis=0))


def test_residuals_are_those_of_other_samples():
    """What degree 6 is expected to leave is about what it leaves of samples that are not fitted."""
    x = net(2, 1024)
    y = np.random.default_rng(5).standard_normal((1, 1024))
    assert fits_of(y, x, np.array([0.9])).degrees.tolist() == [0]
    assert fits_of(y, x, np.array([1.3])).degrees.tolist() == [6]
