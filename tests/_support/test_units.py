"""Units in this process, and the one order of sums."""

from __future__ import annotations

import numpy as np
import pytest

from voroquad._support.units import InProcess, Series, TreeSum, tree_sum


def add(a, b):
    return f"({a}{b})"


@pytest.mark.parametrize("count", [1, 2, 3, 7, 16, 33, 100])
@pytest.mark.parametrize("part", [1, 2, 8, 16])
def test_parts_make_the_tree_of_the_whole(count, part):
    """Sums of 2^m consecutive values each, and the rest, sum to the very tree of all values."""
    leaves = [f"<{k}>" for k in range(count)]
    parts = [tree_sum(leaves[start : start + part], add) for start in range(0, count, part)]
    assert tree_sum(parts, add) == tree_sum(leaves, add)


def test_parts_of_other_sizes_make_another_tree():
    leaves = list("abcdef")
    assert tree_sum([tree_sum(leaves[:3], add), tree_sum(leaves[3:], add)], add) != tree_sum(leaves, add)


def test_a_tree_holds_few_values():
    total = TreeSum(lambda a, b: a + b)
    for k in range(1, 1000):
        total.put(1)
        assert len(total._sums) == k.bit_count()
    assert total.result() == 999


def square(factor, k):
    return np.array([factor * k**2, 1.0])


class Memory:
    """Keeps values in a dict."""

    def __init__(self):
        self.kept = {}

    def begin(self, key):
        self.key = key

    def open(self, series):
        pass

    def read(self, series, k):
        return self.kept.get((series, k))

    def write(self, series, k, value):
        self.kept[series, k] = value


def test_values_and_sums_in_order():
    said = []
    series = [Series("small", 3, (2,), square, (1.0,)), Series("large", 2, (2,), square, (10.0,))]
    pool = InProcess()
    assert [v[0] for v in pool.values(series, lambda name, steps: said.append((name, steps)))] == [0, 1, 4, 0, 10]
    assert said == [("small", 1)] * 3 + [("large", 1)] * 2
    sums = [s.tolist() for s in pool.sums(series, np.add, lambda name, steps: None)]
    assert sums == [[5, 3], [10, 2]]


def test_kept_units_are_not_computed_again():
    memory, calls = Memory(), []

    def counted(k):
        calls.append(k)
        return np.array([float(k)])

    pool = InProcess(memory)
    pool.begin({"seed": 1})
    for _ in range(2):
        values = [v[0] for v in pool.values([Series("s", 4, (1,), counted)], lambda name, steps: None)]
        assert values == [0, 1, 2, 3]
    assert calls == [0, 1, 2, 3]
    assert memory.key == {"seed": 1}


def test_a_value_of_another_shape_is_found():
    with pytest.raises(AssertionError, match=r"a unit of s has the shape \(2,\), not \(3,\)"):
        list(InProcess().values([Series("s", 1, (3,), square, (1.0,))], lambda name, steps: None))
