"""A thread that works ahead: order, results and exceptions."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import numpy as np
import pytest

import voroquad as vq
from voroquad.integrals.helper import helper


@pytest.mark.parametrize("threads", [1, 2])
def test_tasks_are_done_in_their_order(threads):
    found: list[int] = []
    with helper(threads, 5) as aside:
        for k in range(5):
            aside.do(lambda k=k: found.append(k))
    assert found == list(range(5))


def test_the_next_task_runs_while_the_caller_has_a_result():
    started = [threading.Event() for _ in range(3)]
    numbers = iter(range(3))

    def task() -> int:
        k = next(numbers)
        started[k].set()
        return k

    with helper(2, 3) as aside:
        for k in aside.ahead(task, 3):
            assert all(event.wait(10) for event in started[: k + 2])
    assert next(numbers, None) is None


def test_without_threads_nothing_is_done_before_it_is_asked_for():
    numbers = iter(range(3))
    with helper(1, 3) as aside:
        assert next(aside.ahead(lambda: next(numbers), 3)) == 0
    assert next(numbers) == 1


@pytest.mark.parametrize("threads", [1, 2])
def test_exceptions_come_with_the_result(threads):
    with pytest.raises(ZeroDivisionError), helper(threads, 2) as aside:
        list(aside.ahead(lambda: 1 / 0, 2))


def test_an_exception_of_the_caller_leaves_no_thread():
    before = threading.active_count()
    with pytest.raises(KeyError), helper(2, 2) as aside:
        aside.do(lambda: None)
        raise KeyError
    assert threading.active_count() == before


@pytest.mark.parametrize(("of_func", "ahead"), [(0.9, False), (1.1, True)])
def test_the_rule_works_ahead_of_a_func_that_takes_long(of_func, ahead, monkeypatch):
    """Of the first part the samples take 1, and to add their values takes 3."""
    clock = iter(np.cumsum([0, 1, of_func, 3]))
    monkeypatch.setattr("voroquad.integrals.pilot.time", SimpleNamespace(perf_counter=lambda: next(clock)))
    seen: set[str] = set()

    def func(x: np.ndarray) -> np.ndarray:
        seen.update(thread.name for thread in threading.enumerate())
        return x[0]

    vq.quad(func, 0, 1, n_points=100_000, method="pilot", rng=1, threads=2)
    assert any(name.startswith("voroquad") for name in seen) == ahead
    assert not list(clock)
