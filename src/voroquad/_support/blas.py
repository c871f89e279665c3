"""Linear algebra on one thread of BLAS."""

from __future__ import annotations

import functools
import os
import threading
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import scipy.linalg  # noqa: F401  its BLAS and NumPy's must be loaded before they are looked for
from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
R = TypeVar("R")


class _OneThread:
    """A context in which BLAS has one thread. Any number of threads may be inside at a time.

    The number of threads of BLAS belongs to the process, unless BLAS runs on OpenMP. The first thread that enters sets
    it, and the last that leaves restores what was there before. If each restored what it found, a thread would change
    the number while another computes, or leave it at 1 for good.

    Code outside voroquad that sets the number from another thread meanwhile keeps what it set. Bits may then differ.
    Set it before threads start, as `threadpool_limits` around all of them does.
    """

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._inside = 0
        self._before: list[int] = []

    def __enter__(self) -> None:
        with self._lock:
            self._inside += 1
            try:
                if self._inside == 1:
                    self._before = [library.get_num_threads() for library in _process_wide()]
                    for library, before in zip(_process_wide(), self._before, strict=True):
                        if before != 1:
                            _set(library, 1)
            except BaseException:  # Ctrl-C, after which nobody leaves
                self._leave()
                raise

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._leave()

    def before_fork(self) -> None:
        """Wait for threads that enter or leave, so that the child finds a consistent state."""
        self._lock.acquire()

    def after_fork_in_parent(self) -> None:
        """Go on."""
        self._lock.release()

    def after_fork_in_child(self) -> None:
        """Restore the number: the threads that were inside do not exist in the child."""
        self._lock = threading.RLock()
        if self._inside:
            self._inside = 0
            self._restore()

    def _leave(self) -> None:
        self._inside -= 1
        if self._inside == 0:
            self._restore()

    def _restore(self) -> None:
        for library, before in zip(_process_wide(), self._before, strict=True):
            if before != 1 and library.get_num_threads() == 1:
                _set(library, before)


@functools.cache
def _libraries() -> ThreadpoolController:
    return ThreadpoolController().select(user_api="blas")


def _on_openmp(library: Any) -> bool:
    """Whether each thread has a limit of its own."""
    return getattr(library, "threading_layer", "") == "openmp"


@functools.cache
def _process_wide() -> tuple[Any, ...]:
    return tuple(library for library in _libraries().lib_controllers if not _on_openmp(library))


@functools.cache
def _per_thread() -> ThreadpoolController:
    return _libraries().select(filepath=[lib.filepath for lib in _libraries().lib_controllers if _on_openmp(lib)])


def _set(library: Any, count: int) -> None:
    """Set the number of threads, also where threadpoolctl lets a single thread of the process do so."""
    let_any_thread = getattr(type(library), "clear_controlling_thread", lambda force: None)  # since threadpoolctl 3.7
    let_any_thread(force=True)
    library.set_num_threads(count)
    let_any_thread(force=True)


_one_thread = _OneThread()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(
        before=_one_thread.before_fork,
        after_in_parent=_one_thread.after_fork_in_parent,
        after_in_child=_one_thread.after_fork_in_child,
    )


def one_blas_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Run a function with BLAS on one thread.

    More threads change the order of summation, so the bits of a result would depend on the machine. Where processes or
    threads share the cores, BLAS threads also wait for one another for many times longer than they compute.
    """

    @functools.wraps(function)
    def limited(*args: P.args, **named: P.kwargs) -> R:
        with _one_thread:
            if not _per_thread().lib_controllers:
                return function(*args, **named)
            with _per_thread().limit(limits=1):
                return function(*args, **named)

    return limited
