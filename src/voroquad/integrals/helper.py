"""A thread that works ahead while the calling thread evaluates func."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Generic, Protocol, TypeVar

T = TypeVar("T", covariant=True)
S = TypeVar("S")


class Task(Protocol[T]):
    """What is done, or about to be."""

    def result(self) -> T:
        """Its result, when it is done."""


class _Done(Generic[S]):
    def __init__(self, value: S):
        self._value = value

    def result(self) -> S:
        return self._value


def done(value: S) -> Task[S]:
    """A task that has been done."""
    return _Done(value)


class Helper:
    """Does tasks in the order in which they come: on a thread of its own, or at once.

    Parameters
    ----------
    pool : ThreadPoolExecutor, optional
        Of one thread.
    """

    def __init__(self, pool: ThreadPoolExecutor | None = None):
        self._pool = pool

    def do(self, task: Callable[[], S]) -> Task[S]:
        """Do a task some time soon; its exceptions are raised with its result."""
        if self._pool is None:
            return done(task())
        future: Future[S] = self._pool.submit(task)
        return future

    def ahead(self, task: Callable[[], S], times: int) -> Iterator[S]:
        """The results of a task that is done several times, each while the caller has that before.

        Without a thread each is done when it is asked for.

        Examples
        --------
        >>> from voroquad.integrals.helper import helper
        >>> numbers = iter(range(3))
        >>> with helper(threads=2, tasks=3) as aside:
        ...     list(aside.ahead(lambda: next(numbers), 3))
        [0, 1, 2]
        """
        if self._pool is None:
            for _ in range(times):
                yield task()
            return
        following = self._pool.submit(task)
        for left in range(times - 1, -1, -1):
            result = following.result()
            if left:
                following = self._pool.submit(task)
            yield result


@contextmanager
def helper(threads: int, tasks: int) -> Iterator[Helper]:
    """A helper for so many tasks: a thread if there are several tasks and threads.

    At the end it has done what it was given.
    """
    if threads == 1 or tasks <= 1:
        yield Helper()
        return
    with ThreadPoolExecutor(1, "voroquad") as pool:
        yield Helper(pool)
