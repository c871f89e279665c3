"""The pilot rule of the core: how its cells are divided, and its units."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pilot_reference import keys_of, rough

from voroquad.integrals.pilot import RULES


@pytest.mark.parametrize(("d", "k"), [(1, 5000), (2, 70), (3, 18)])
def test_parts_end_as_late_as_they_may(d, k):
    """Each has at most so many samples, and no room for the next cell; threads draw the same bits."""

    def planned(most: int, threads: int = 1) -> list[np.ndarray]:
        rule = RULES[d](k, 1, keys_of(1, d))
        rule.grid(0)[:] = rough(RULES[d].centres(k, 0, k**d))
        parts = rule.plan(4 * k**d, most, threads)
        return [rule.draw(part, threads) for part in range(parts)]

    whole, *none = planned(10**9)
    assert not none
    for most in (1, 64, 700, 9000):
        parts = planned(most)
        np.testing.assert_array_equal(np.concatenate(parts, axis=1), whole)
        again = planned(most, threads=3)
        assert [part.tobytes() for part in again] == [part.tobytes() for part in parts]
        cells = [np.unique(np.floor(k * part).astype(int), axis=1, return_counts=True) for part in parts]
        assert all(counts.sum() <= most or len(counts) == 1 for _, counts in cells)
        for (_, counts), (_, following), part in zip(cells, cells[1:], parts[1:], strict=False):
            first = (np.floor(k * part) == np.floor(k * part[:, :1])).all(axis=0).sum()
            assert first in following
            assert counts.sum() + first > most


@pytest.mark.parametrize(("d", "k"), [(1, 2**32 - 1), (2, 2**16 - 1), (3, 1625)])
def test_more_cells_than_blocks_have_numbers_are_refused(d, k):
    """k is the largest side of a grid of fewer than 2^32 cells."""
    assert k**d < 2**32 <= (k + 1) ** d
    for beyond in (k + 1, 2**63):
        with pytest.raises(ValueError, match=f"k must be at most {k}: there are to be fewer than 2\\^32 cells"):
            RULES[d](beyond, 1, keys_of(1, d))


@pytest.mark.parametrize("later", [False, True])
def test_a_rule_in_other_units_is_the_same(later):
    rule = RULES[1](50, 2, keys_of(1, 1))
    for field in range(2):
        rule.grid(field)[:] = rough((np.arange(50) + 0.5)[None] / 50)
    rule.plan(400, 1000, 1)
    values = rough(rule.draw(0, 1))
    rule.add(np.stack([values, values]), 1)
    if later:  # values that come after the unit are taken in it
        rule.renew(keys_of(1, 1))
    rule.rescale(1, -9)
    if later:
        values = rough(rule.draw(0, 1))
        rule.add(np.stack([values, values]), 1)
    for name in ("integral", "midpoints", "size", "absolute", "largest", "deviations"):
        before, after = getattr(rule, name)
        np.testing.assert_array_equal(after, np.ldexp(before, -9), err_msg=name)
        assert np.any(before)
    for name in ("square", "value_square", "expected"):
        before, after = getattr(rule, name)
        assert after == math.ldexp(before, -18) > 0
    for (before, after), power in zip(rule.differences(), (-18, -36), strict=True):
        np.testing.assert_array_equal(after, np.ldexp(before, power))
    (*place, square, residual, value), after = rule.worst(0), rule.worst(1)
    assert after == (*place, math.ldexp(square, -18), math.ldexp(residual, -9), math.ldexp(value, -9))
    np.testing.assert_array_equal(rule.grid(1), np.ldexp(rule.grid(0), -9))


@pytest.mark.parametrize("power", [-1100, -1023, -1022, 0, 1023, 1024])
def test_units_are_exact_powers_of_two(power):
    """Also where 2^power is no normal number."""
    rule = RULES[1](16, 1, keys_of(1, 1))
    values = np.ldexp(np.linspace(-1.0, 1.0, 16), -power // 2)
    rule.grid(0)[:] = values
    rule.rescale(0, power)
    np.testing.assert_array_equal(rule.grid(0), np.ldexp(values, power))
