"""Cells of one thread do not wait for those of another, and are the same by any number of threads."""

from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from threading import Event

import numpy as np
import pytest

import voroquad as vq
from voroquad import _core

MINUTE = 60.0


@pytest.fixture
def held(monkeypatch):
    """Measures of three points take until `go_on`; `begun` tells that they have begun."""
    begun, go_on, measures = Event(), Event(), _core.measures

    def hold(points, *rest):
        if points.shape[1] == 3:
            begun.set()
            assert go_on.wait(MINUTE)
        return measures(points, *rest)

    monkeypatch.setattr(_core, "measures", hold)
    yield begun, go_on
    go_on.set()


def test_few_points_do_not_wait_for_the_many_of_another_thread(held):
    begun, go_on = held
    with ThreadPoolExecutor(2) as threads:
        slow = threads.submit(lambda: vq.cells([0.1, 0.5, 0.9]).measures)
        assert begun.wait(MINUTE)
        np.testing.assert_allclose(threads.submit(lambda: vq.cells([0.25, 0.75]).measures).result(MINUTE), 0.5)
        assert not slow.done()
        go_on.set()
        np.testing.assert_allclose(slow.result(MINUTE), [0.3, 0.4, 0.3])


def test_of_one_set_two_threads_have_the_same(held):
    begun, go_on = held
    cells = vq.cells([0.1, 0.5, 0.9])
    with ThreadPoolExecutor(2) as threads:
        both = [threads.submit(lambda: cells.measures) for _ in range(2)]
        assert begun.wait(MINUTE)
        go_on.set()
        np.testing.assert_array_equal(both[0].result(MINUTE), both[1].result(MINUTE))


def test_no_property_shares_a_lock_of_all_instances():
    """As functools.cached_property does on Python 3.11: a child forked meanwhile would wait for ever."""
    assert not [name for name, value in vars(vq.Cells).items() if isinstance(value, cached_property)]


def many_points(kind: str, n: int, d: int) -> np.ndarray:
    """So many that a few threads sort them together."""
    rng = np.random.default_rng(d)
    points = rng.random((n, d))
    if kind == "copies":
        points[rng.integers(n, size=n // 5)] = points[rng.integers(n, size=n // 5)]
    elif kind == "copies in a corner":  # and none in most stretches of the curve
        points[: n // 5] *= 0.2
        points[: n // 10] = points[rng.permutation(n // 10) + n // 10]
    elif kind == "sparse":  # grids have blocks of a point or two beside crowded ones
        points **= 6
    return points


@pytest.mark.parametrize("kind", ["uniform", "copies", "copies in a corner", "sparse"])
@pytest.mark.parametrize(("n", "d"), [(100_000, 2), (50_000, 3)])
def test_sets_sorted_by_several_threads_have_the_same_cells(kind, n, d):
    points = many_points(kind, n, d)
    one, *others = (vq.cells(points, threads=t).measures for t in (1, 2, 3))
    assert abs(one.sum() - 1) <= 1e-12
    for measures in others:
        np.testing.assert_array_equal(measures, one)
    places = np.random.default_rng(5).integers(n, size=1000)
    found = vq.cells(points, threads=3).locate(points[places])
    np.testing.assert_array_equal(points[found], points[places])
    assert (found <= places).all()
