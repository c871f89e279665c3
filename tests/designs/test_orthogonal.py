"""Orthogonal arrays: every pair of coordinates evenly spread, and each coordinate."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import voroquad as vq
from voroquad.designs.orthogonal import array, field, least


@pytest.mark.parametrize("q", [2, 3, 4, 5, 8, 9, 16])
def test_fields_and_arrays(q):
    add, multiply = field(q)
    for table in (add, multiply[1:, 1:] - 1):  # groups: each row and each column has every element once
        for rows in (table, table.T):
            np.testing.assert_array_equal(np.sort(rows, axis=1), np.tile(np.arange(len(table)), (len(table), 1)))
    a, b, c = np.ogrid[:q, :q, :q]
    np.testing.assert_array_equal(multiply[a, add[b, c]], add[multiply[a, b], multiply[a, c]])
    columns = array(q).T
    assert columns.shape == (q + 1, q * q)
    for one, other in itertools.combinations(columns, 2):
        assert len(set(zip(one, other, strict=True))) == q * q


@pytest.mark.parametrize(("n", "d"), [(49, 4), (64, 9), (16, 5)])
def test_strata_of_pairs_and_of_coordinates(n, d):
    points = vq.sample("orthogonal", n=n, d=d, sets=3, rng=1).points
    q = round(n**0.5)
    for of_set in points:
        for axis in range(d):
            assert len(set((of_set[:, axis] * n).astype(int))) == n
        for pair in itertools.combinations(range(d), 2):
            assert len(set(map(tuple, (of_set[:, pair] * q).astype(int)))) == n


def test_variance_of_a_sum_of_pairs():
    """What pairs of coordinates make goes away as for strata of the square: far below that of uniform samples."""

    def variance(design):
        x = vq.sample(design, n=49, d=4, sets=500, rng=2).points
        return (x[..., 0] * x[..., 2] + np.sin(3 * x[..., 1] * x[..., 3])).mean(-1).var()

    assert variance("orthogonal") < variance("uniform") / 30


@pytest.mark.statistical
@pytest.mark.parametrize("upper", [(False, False, False), (False, True, False)])
def test_triples_of_coordinates_are_uniform(z_score, upper):
    """The array spreads pairs of levels; that a point may have any three is due to their random labels."""
    points = vq.sample("orthogonal", n=16, d=3, sets=4000, rng=3).points
    inside = np.where(upper, points >= 0.75, points < 0.25).all(axis=-1)
    # 0.1 standard deviations of one set: |z| ≈ 6.3; without random labels E is 1/16 or 0
    assert abs(z_score(inside.mean(axis=-1), 1 / 64)) < 5.5


@pytest.mark.parametrize(
    ("n", "d", "message"),
    [
        (50, 2, "n = 49 and n = 64"),
        (2, 1, "are n = 4$"),
        (36, 2, "n = 25 and n = 49"),
        (49, 9, "at most d = 8, .* n = 64"),
    ],
)
def test_numbers_that_are_none(n, d, message):
    with pytest.raises(ValueError, match=message):
        vq.sample("orthogonal", n=n, d=d)


def test_the_least_number_of_points():
    assert [least(d) for d in (1, 2, 3, 4, 7, 8)] == [4, 4, 4, 9, 49, 49]
