"""BLAS limits nest across threads, are restored, and keep the bits of results."""

from __future__ import annotations

import multiprocessing
import os
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import voroquad as vq
from voroquad._support import blas
from voroquad._support.blas import one_blas_thread


def blas_threads() -> list[int]:
    return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]


@pytest.fixture
def two_blas_threads():
    with threadpool_limits(2, user_api="blas"):
        if not blas_threads() or set(blas_threads()) != {2}:
            pytest.skip("needs a BLAS with two threads")
        yield


def overlapping(first_leaves_first: bool) -> list[list[int]]:
    """Two threads inside at once, one of which leaves before the other; what the other sees, before and after."""
    inside, leave = threading.Barrier(3), [threading.Event(), threading.Event()]
    seen: list[list[int]] = []

    @one_blas_thread
    def wait(number: int) -> None:
        inside.wait(10)
        leave[number].wait(10)
        if number == (1 if first_leaves_first else 0):
            seen.append(blas_threads())

    threads = [threading.Thread(target=wait, args=(number,)) for number in (0, 1)]
    for thread in threads:
        thread.start()
    inside.wait(10)
    order = (0, 1) if first_leaves_first else (1, 0)
    for number in order:
        leave[number].set()
        threads[number].join(10)
    return seen


@pytest.mark.parametrize("first_leaves_first", [True, False])
def test_a_thread_that_leaves_does_not_change_the_limit_of_another(two_blas_threads, first_leaves_first):
    assert {count for counts in overlapping(first_leaves_first) for count in counts} == {1}
    assert set(blas_threads()) == {2}


def test_the_limit_is_restored_after_an_error(two_blas_threads):
    @one_blas_thread
    def fail() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert set(blas_threads()) == {2}


def integral(seed: int) -> float:
    return float(vq.quad(lambda x: np.cos(3 * x[0] + x[1] ** 2), [0, 0], [1, 1], n_points=256, rng=seed).integral)


def test_bits_do_not_depend_on_other_threads_or_on_the_users_limit(two_blas_threads):
    alone = [integral(seed) for seed in range(16)]
    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(integral, range(16))) == alone
    with threadpool_limits(1, user_api="blas"):
        assert [integral(seed) for seed in range(16)] == alone
    assert set(blas_threads()) == {2}


def _report(queue: multiprocessing.Queue) -> None:
    queue.put((blas_threads(), integral(1)))


def test_a_child_forked_while_a_thread_is_inside_works(two_blas_threads):
    expected = integral(1)
    inside, leave = threading.Event(), threading.Event()

    @one_blas_thread
    def wait() -> None:
        inside.set()
        leave.wait(60)

    thread = threading.Thread(target=wait)
    thread.start()
    inside.wait(10)
    fork = multiprocessing.get_context("fork")
    queue = fork.Queue()
    child = fork.Process(target=_report, args=(queue,))
    child.start()
    try:
        counts, value = queue.get(timeout=60)
    finally:
        leave.set()
        thread.join()
        child.kill()
        child.join()
    assert set(counts) == {2}
    assert value == expected


def test_a_fork_waits_for_a_thread_that_enters(two_blas_threads, monkeypatch):
    half_way, set_one = threading.Event(), blas._set

    def slowly(library, count):
        set_one(library, count)
        half_way.set()
        time.sleep(0.2)

    thread = threading.Thread(target=one_blas_thread(lambda: None))
    with monkeypatch.context() as patch:
        patch.setattr(blas, "_set", slowly)
        thread.start()
        half_way.wait(10)
        receive, send = multiprocessing.Pipe(duplex=False)
        if (child := os.fork()) == 0:
            monkeypatch.setattr(blas, "_set", set_one)
            send.send(blas_threads())
            os._exit(0)
        thread.join()
    assert receive.poll(60)
    assert set(receive.recv()) == {2}
    os.waitpid(child, 0)


def test_an_interrupt_on_the_way_in_leaves_no_limit(two_blas_threads, monkeypatch):
    set_one, calls = blas._set, []

    def interrupted(library, count):
        set_one(library, count)
        calls.append(count)
        if len(calls) == 1:
            raise KeyboardInterrupt

    monkeypatch.setattr(blas, "_set", interrupted)
    with pytest.raises(KeyboardInterrupt):
        one_blas_thread(lambda: None)()
    assert set(blas_threads()) == {2}
    assert set(one_blas_thread(blas_threads)()) == {1}  # and the next may enter
    assert set(blas_threads()) == {2}
