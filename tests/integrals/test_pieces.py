"""Sums over parts: their shares, what joins them, their errors."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import voroquad as vq
from voroquad.integrals.estimates import Estimate
from voroquad.integrals.library import Library
from voroquad.integrals.pieces import FEWEST, Chain, Part, join, proportional, total
from voroquad.integrals.regions import Box


def box(a, b):
    return Box(a, b, Library.of(0, 1))


@given(st.lists(st.floats(0.001, 1), min_size=1, max_size=20), st.integers(1, 500))
def test_counts_are_proportional_and_sum_to_n(shares, n):
    counts = proportional(shares, n)
    assert sum(counts) == n
    assert (abs(counts - n * np.array(shares) / sum(shares)) < 1 + 1e-9).all()


@given(st.lists(st.floats(0.001, 1), min_size=1, max_size=40), st.integers(1, 500))
def test_joined_parts_have_enough_samples_and_the_same_shares(shares, n):
    whole = sum(shares)
    parts = [Part(box(k, k + 1), share / whole) for k, share in enumerate(shares)]
    joined = join(parts, n)
    assert sum(p.share for p in joined) == pytest.approx(1)
    assert len(joined) == 1 or all(p.share * n >= FEWEST for p in joined)
    regions = [r for p in joined for r in (p.region.regions if isinstance(p.region, Chain) else [p.region])]
    assert regions == [p.region for p in parts]


def test_a_chain_maps_as_its_pieces_do():
    chain = Chain([Part(box([0, 0], [1, 1]), 0.1), Part(box([5, 5], [7, 6]), 0.3)])
    x, element = chain.pull_back(np.array([[0.0, 0.125, 0.25, 0.625, 0.99], [0.5, 0.25, 0.5, 0.5, 1.0]]))
    np.testing.assert_allclose(x[0], [0, 0.5, 5, 6, 7 - 2 / 75], atol=1e-15)
    np.testing.assert_allclose(x[1], [0.5, 0.25, 5.5, 5.5, 6])
    np.testing.assert_allclose(element, [4, 4, 8 / 3, 8 / 3, 8 / 3])


def estimate(mean, error, rounding, freedom=math.inf, deviations=None):
    arrays = (np.array(x, dtype=float) for x in (mean, error, rounding))
    return Estimate(*arrays, 10, freedom, deviations=deviations)


def test_means_and_variances_add():
    found = total([estimate([1, 2], [3, 0], [0, 0]), estimate([10, 20], [4, 1], [1, 0.5])])
    np.testing.assert_allclose(found.mean, [11, 22])
    np.testing.assert_allclose(found.error, [5, 1])
    np.testing.assert_allclose(found.rounding, [1, 0.5])
    assert found.n == 20
    assert found.degrees_of_freedom == math.inf


def test_degrees_of_freedom_are_those_of_welch():
    one = estimate([0], [3], [0], 3)
    assert total([one, one]).degrees_of_freedom == pytest.approx(6)
    assert total([one, estimate([0], [4], [0])]).degrees_of_freedom == pytest.approx(3 * 25**2 / 81)
    assert total([one, estimate([0], [1e-9], [0], 1)]).degrees_of_freedom == pytest.approx(3)


def test_parts_are_independent_in_the_covariance():
    """Of each part by itself as of the part, and the sum of both."""
    polygon = vq.Polygon([[0, 0], [2, 0], [2, 1], [1, 1], [1, 3], [0, 3]])

    def f(x):
        return np.stack([np.exp(x[0]), np.sin(3 * x[1]), x[0] * x[1] ** 3])

    c = np.array([1.0, -2.0, 0.5])
    r, direct = (vq.quad(g, polygon, order="kriging", rng=1) for g in (f, lambda x: c @ f(x)))  # by the same weights
    assert r.linear(c).standard_error == pytest.approx(direct.standard_error, rel=1e-6)
    np.testing.assert_allclose(np.diag(r.covariance), r.standard_error**2)


def test_pieces_that_are_0_are_no_reason_to_warn_unless_all_are():
    polygon = vq.Polygon([[0, 0], [2, 0], [2, 1], [1, 1], [1, 3], [0, 3]])
    assert vq.quad(lambda x: np.maximum(x[1] - 1, 0), polygon, rng=1).success
    with pytest.warns(vq.IntegrationWarning, match="func is 0 at every point"):
        vq.quad(lambda x: 0 * x[0], polygon, rng=1)


def test_many_pieces_share_few_samples():
    angles = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    polygon = vq.Polygon(np.stack([np.cos(angles), np.sin(angles)]).T)
    r = vq.quad(lambda x: x[0] ** 2, polygon, n_points=256, rng=1)
    assert 128 < r.n_evaluations <= 256
    assert abs(r.integral - np.pi / 4) < 5 * r.standard_error + 1e-3


def test_tolerances_are_met_over_pieces():
    polygon = vq.Polygon([[0, 0], [2, 0], [2, 1], [1, 1], [1, 3], [0, 3]])
    r = vq.quad(lambda x: np.exp(x[0] + np.sin(3 * x[1])), polygon, n_points=64, rtol=1e-6, rng=1)
    assert r.success
    assert r.standard_error < 1e-6 * r.integral
