"""A thread that works ahead: order, results and exceptions."""

from __future__ import annotations

import threading

import pytest

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
