"""Processor time of a piece of Python, as a test may bound it."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def cpu_time() -> Iterator[Callable[[], float]]:
    """Measure this thread's seconds in the block, without garbage collections, as ``timeit`` does.

    A collection looks at every object that earlier tests left in the process: after Mitsuba's, that
    takes a third of a second, whatever ran when it was due.
    """
    seconds = float("nan")
    collects = gc.isenabled()
    gc.disable()
    start = time.thread_time()
    try:
        yield lambda: seconds
    finally:
        seconds = time.thread_time() - start
        if collects:
            gc.enable()
