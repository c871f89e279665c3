"""Processes that evaluate func."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any

from .._support.checks import positive_int
from .kept import KeptEvaluations

Map = Callable[..., Any]

_THREADS = "pass threads, workers=concurrent.futures.ThreadPoolExecutor().map"
_REMEDY = f"define it with def at the top of a module that can be imported, or {_THREADS}"


@contextmanager
def mapping(
    workers: int | Map, func: Any, client: Any = None, kept: KeptEvaluations | None = None
) -> Iterator[tuple[Map, int]]:
    """A map, and the number of parts to split the points into.

    Processes start anew ("spawn"). A fork copies locks of BLAS, Mitsuba or Dask in the state in which other threads
    hold them, and may wait for them for ever.

    Parameters
    ----------
    workers : int or callable
        Number of processes (1: this one; -1: one per processor), or a map.
    func : callable
        What they are to call.
    client : distributed.Client or str, optional
        In their place the workers of a Dask cluster.
    kept : KeptEvaluations, optional
        What outlives a cluster that is gone.

    Raises
    ------
    ValueError
        `workers` is no such number; both `workers` and `client`; func cannot be sent to another process, or not be
        loaded there.
    RuntimeError
        A process ends before its work is done.
    """
    if client is not None:
        if workers != 1:
            raise ValueError(f"workers={workers!r} and client exclude each other: a cluster has its own; give one")
        from ..cluster import attached

        with attached(client, kept.store if kept is not None else None) as pool:
            yield pool.map, pool.threads
        return
    if callable(workers):
        yield workers, os.cpu_count() or 1
        return
    number = (os.cpu_count() or 1) if workers == -1 else positive_int("workers", workers)
    if number == 1:
        yield map, 1
        return
    _end_if_imported_by_a_worker()
    try:
        sent = pickle.dumps(func)
    except Exception as error:
        raise ValueError(f"func cannot be sent to {number} worker processes ({error}); {_REMEDY}") from None
    with ProcessPoolExecutor(number, mp_context=multiprocessing.get_context("spawn")) as pool:
        _try(pool, sent)
        try:
            yield pool.map, number
        except BrokenProcessPool:
            raise RuntimeError(
                f"workers: one of {number} processes ended while it evaluated func (killed, out of memory or a crash); "
                "take fewer workers, or workers=1 to see what func does"
            ) from None


def _try(pool: ProcessPoolExecutor, sent: bytes) -> None:
    """Have a process load func before any work."""
    try:
        pool.submit(_load, sent).result()
    except BrokenProcessPool:
        raise RuntimeError(
            "workers: the first process ended before it could load func; it imports the script that starts it, which "
            f'must be a file that calls quad under if __name__ == "__main__": only; change that, or {_THREADS}'
        ) from None
    except Exception as error:
        raise ValueError(f"func cannot be loaded by worker processes ({error}); {_REMEDY}") from None


def _load(sent: bytes) -> None:
    pickle.loads(sent)


def _end_if_imported_by_a_worker() -> None:
    """End a process that came here while importing the script that started it, rather than start more."""
    if getattr(multiprocessing.current_process(), "_inheriting", False):  # as multiprocessing itself tells
        sys.exit(1)
