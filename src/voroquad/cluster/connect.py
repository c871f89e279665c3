"""Make a pool from the options of the command line."""

from __future__ import annotations

import gc
import logging
import os
import re
import sys
import traceback
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import dask.config
from distributed import Client, LocalCluster

from .._support.checks import positive_int
from .._support.units import InProcess, Pool
from .on_dask import OnDask
from .store import Store

HOST = "127.0.0.1"
#: Seconds within which a scheduler must answer
ANSWER = 10.0


@contextmanager
def connected(
    scheduler: str | None, workers: int | None, store: str | None, out: str | os.PathLike[str]
) -> Iterator[Pool]:
    """The pool of a scheduler, of workers on this machine, or of this process.

    Parameters
    ----------
    scheduler : str, optional
        Its address, such as ``tcp://10.0.0.1:8786``, or ``tls://…`` with the certificates of Dask's configuration.
    workers : int, optional
        Number of worker processes to start on this machine; they listen on 127.0.0.1 only and end with the block.
    store : str, optional
        Where finished units are kept, any path of fsspec. By default, with a scheduler or workers, the folder
        ``out.units`` beside the results, which is deleted when the block ends without an error.
    out : path
        The results.

    Raises
    ------
    ValueError
        Both scheduler and workers.
    ConnectionError
        No scheduler answers, or it has no worker.
    """
    if scheduler is not None and workers is not None:
        raise ValueError("scheduler and workers exclude each other: the scheduler has its own workers; give one")
    kept = Store(store or f"{os.fspath(out)}.units")
    with ExitStack() as stack:
        if scheduler is None and workers is None:
            yield InProcess(kept)
        else:
            stack.enter_context(_dask_is_silent())
            # Dask's log of recent messages would keep those of thousands of units
            stack.enter_context(dask.config.set({"distributed.admin.low-level-log-length": 10}))
            client = stack.enter_context(_client(scheduler, workers))
            print(f"voroquad: dashboard {client.dashboard_link}", file=sys.stderr)
            try:
                yield OnDask(client, kept)
            except KeyboardInterrupt:
                print(f"voroquad: {kept.url} keeps finished units; the same command computes the rest", file=sys.stderr)
                raise
        if store is None:
            kept.delete()


@contextmanager
def attached(client: Any, store: Store | None = None) -> Iterator[OnDask]:
    """The pool of a client, or of the scheduler at an address; it says that finished units are in the store.

    Raises ValueError for what is neither, and ConnectionError where no scheduler answers or it has no worker.
    """
    if isinstance(client, Client):
        yield OnDask(client, store)
        return
    if not isinstance(client, str):
        raise ValueError(
            "client must be a distributed.Client or the address of a scheduler, such as 'tcp://10.0.0.1:8786', "
            f"got {client!r}"
        )
    with _dask_is_silent(), _client(client, None) as own:
        yield OnDask(own, store)


@contextmanager
def _dask_is_silent() -> Iterator[None]:
    """Silence Dask's tracebacks about lost connections and restarted workers; what matters is raised."""
    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] in ("distributed", "tornado")]
    before = {logger: logger.level for logger in map(logging.getLogger, names)}
    try:
        for logger in before:
            logger.setLevel(logging.CRITICAL + 1)
        yield
    finally:
        for logger, level in before.items():
            logger.setLevel(level)


@contextmanager
def _client(scheduler: str | None, workers: int | None) -> Iterator[Client]:
    if scheduler is None:
        cluster = LocalCluster(
            n_workers=positive_int("workers", workers),
            threads_per_worker=1,
            host=HOST,
            dashboard_address=f"{HOST}:0",
            silence_logs=logging.CRITICAL + 1,
        )
        with cluster, Client(cluster) as client:
            yield client
        return
    try:
        client = Client(scheduler, timeout=ANSWER)
    except (OSError, TimeoutError) as error:
        why = re.sub(r"in <.*?>: ", "", str(error.__cause__ or error))
        _let_go(error)
        raise ConnectionError(f"no scheduler answers at {scheduler} ({why}); start one: dask scheduler") from None
    except TypeError as error:  # Dask's, of tls:// without certificates
        _let_go(error)
        raise ValueError(
            f"{scheduler} wants certificates: name them in Dask's configuration, such as "
            "DASK_DISTRIBUTED__COMM__TLS__CA_FILE, __CLIENT__CERT and __CLIENT__KEY"
        ) from None
    with client:
        yield client


def _let_go(error: BaseException | None) -> None:
    """Collect a client whose start failed now, since its finaliser would wait for ever while another client starts."""
    while error is not None:
        traceback.clear_frames(error.__traceback__)
        error = error.__cause__ or error.__context__
    gc.collect()
