"""Legendre polynomials: orthonormal over the box, complete in each total degree, integrated exactly."""

import itertools
import math

import numpy as np
import pytest

from voroquad import _core
from voroquad.rules.polynomials import Intervals, at_points, over_boxes, powers_up_to


def gauss(low, high, nodes):
    """Nodes (m,) and weights of the mean over an interval."""
    t, w = np.polynomial.legendre.leggauss(nodes)
    return low + (high - low) * (t + 1) / 2, w / 2


@pytest.mark.parametrize(("degree", "d"), [(0, 2), (7, 1), (5, 2), (3, 3), (2, 4)])
def test_all_products_up_to_a_total_degree_in_ascending_order(degree, d):
    powers = powers_up_to(degree, d)
    assert len(powers) == math.comb(degree + d, d) == len(np.unique(powers, axis=0))
    totals = powers.sum(axis=1)
    assert totals.max() == degree
    assert (np.diff(totals) >= 0).all()
    for lower in range(degree):
        np.testing.assert_array_equal(powers_up_to(lower, d), powers[: math.comb(lower + d, d)])


@pytest.mark.parametrize(("degree", "d"), [(9, 1), (6, 2), (4, 3)])
def test_they_are_orthonormal(degree, d):
    t, w = gauss(0, 1, degree + 1)
    points = np.array(list(itertools.product(t, repeat=d)))
    weights = np.prod(list(itertools.product(w, repeat=d)), axis=1)
    terms = at_points(points, powers_up_to(degree, d))
    np.testing.assert_allclose(terms.T @ (weights[:, None] * terms), np.eye(terms.shape[1]), atol=1e-12)
    assert (terms[points.argmax()] > 0).any()


def test_the_parts_of_the_axes_are_integrated_exactly():
    """Part 1 of the first axis is two intervals, whose means are added."""
    low, high, part = np.array([0, 0.3, 0.5]), np.array([0.3, 0.5, 1]), np.array([1, 0, 1])
    axes = [Intervals(low, high, part, 2), Intervals(low[:2], high[:2], np.array([0, 1]), 2)]
    powers = powers_up_to(5, 2)
    integrals = over_boxes(axes, powers)
    for (p, q), found in zip(itertools.product(range(2), repeat=2), integrals, strict=True):
        expected = 0
        for i, j in itertools.product(np.flatnonzero(part == p), [q]):
            (x, wx), (y, wy) = gauss(low[i], high[i], 4), gauss(low[j], high[j], 4)
            grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
            expected = expected + np.einsum("i,j,ijt->t", wx, wy, at_points(grid, powers))
        np.testing.assert_allclose(found, expected, atol=1e-13)


@pytest.mark.parametrize(
    ("powers", "message"),
    [([[1]], "a degree for each coordinate"), ([[0, -1]], "degrees must be"), ([[0, 65536]], "degrees must be")],
)
def test_degrees_that_mean_nothing_are_an_error_of_the_core(powers, message):
    with pytest.raises(ValueError, match=message):
        _core.legendre_products(np.zeros((3, 2)), np.array(powers))
