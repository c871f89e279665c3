"""Polynomials from the nodes of a Gauss grid."""

from __future__ import annotations

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from voroquad.rules import gauss_grid
from voroquad.rules.gauss_grid import grid_coefficients, grid_points, nodes_of_an_axis, term_powers
from voroquad.rules.nested_fits import embedded, terms_of, truncated
from voroquad.rules.polynomials import at_points


@pytest.mark.parametrize(("d", "degree"), [(1, 4), (2, 5), (3, 4), (5, 3)])
def test_powers_are_those_of_the_terms_of_the_core(d, degree):
    x = np.random.default_rng(1).random((d, 32))
    found = terms_of(d, degree).means(x, 2, 1)
    exact = at_points(x.T, term_powers(d, degree)).reshape(2, 16, -1).mean(axis=1)
    np.testing.assert_allclose(found, exact, atol=1e-13)


@pytest.mark.parametrize("d", [1, 2, 4])
def test_polynomials_are_found_and_what_is_left_is_their_square(d):
    side, rng = 5, np.random.default_rng(2)
    powers = term_powers(d, 4)
    c = rng.standard_normal((2, len(powers)))
    values = c @ at_points(grid_points(side, d, 0, side**d), powers).T
    found, left = grid_coefficients(values, side, d, 4)
    np.testing.assert_allclose(found, c, atol=1e-12)
    np.testing.assert_allclose(left, 0, atol=1e-24)
    lower, left = grid_coefficients(values, side, d, 2)
    np.testing.assert_allclose(lower, truncated(c, d, 4, 2), atol=1e-12)
    np.testing.assert_allclose(left, np.square(c[:, powers.sum(axis=1) > 2]).sum(axis=1), rtol=1e-12)
    # Terms that the grid does not tell from others are 0
    higher, _ = grid_coefficients(values, side, d, 6)
    np.testing.assert_allclose(higher, embedded(c, d, 4, 6), atol=1e-12)


def test_nodes_come_in_parts():
    whole = grid_points(4, 3, 0, 64)
    np.testing.assert_array_equal(np.concatenate([grid_points(4, 3, b, b + 16) for b in range(0, 64, 16)]), whole)
    assert whole.min() > 0
    assert whole.max() < 1
    np.testing.assert_allclose(whole[:4, :2], np.full((4, 2), whole[0, 0]))


def test_sizes():
    assert [nodes_of_an_axis(10**9, d) for d in (3, 4, 5, 6)] == [0, 12, 8, 0]
    assert [nodes_of_an_axis(n, 4) for n in (4 * 6**4 - 1, 4 * 6**4)] == [0, 6]
    # An odd number would have a node at the centre of the box
    assert [nodes_of_an_axis(n, 4) for n in (4 * 7**4, 4 * 8**4 - 1, 4 * 8**4)] == [6, 6, 8]


def test_threads_of_blas_change_no_bit(monkeypatch):
    """The sums are on one thread. On more, some of the kernels of OpenBLAS give other bits for these sizes."""
    side, d, inside = 13, 4, []
    legendre = gauss_grid.legendre

    def recorded(*arguments):
        inside.extend(library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas")
        return legendre(*arguments)

    monkeypatch.setattr(gauss_grid, "legendre", recorded)
    x = grid_points(side, d, 0, side**d)
    values = np.exp(np.outer(np.arange(1, 6), x.sum(axis=1)) / 4)
    found = []
    for threads in (1, 4):
        with threadpool_limits(threads, user_api="blas"):
            found.append(grid_coefficients(values, side, d, 8))
    assert set(inside) == {1}
    for one, more in zip(*found, strict=True):
        np.testing.assert_array_equal(one, more)
