"""Units on Dask's workers."""

from __future__ import annotations

import errno
import os
import uuid
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from distributed import Client, Future, KilledWorker, Worker, WorkerPlugin, wait
from distributed.comm.core import CommClosedError

from .._support.arrays import Array
from .._support.units import Add, Advance, Series, TreeSum, computed, tree_sum
from .._support.version import __version__
from .files import Files, SentFile
from .store import Store

#: Units whose values are summed on a worker; a power of two, see TreeSum
FOLD = 16
#: Units in flight per worker thread, and at least: enough that no worker waits for the slowest
AHEAD, FEWEST_AHEAD = 8, 32
#: Attempts after the first at a unit that raises
RETRIES = 2
#: Seconds to wait for a worker where there is none
PATIENCE = 60.0


@dataclass
class _Part:
    """Consecutive units of a series in flight."""

    series: Series
    units: list[Future[Array]]
    value: Future[Array]
    last: bool  # of its series


class OnDask:
    """The pool of a Dask cluster; its results have the bits of :class:`voroquad._support.units.InProcess`.

    Parameters
    ----------
    client : distributed.Client
        Of any cluster whose workers have this version of voroquad.
    store : Store, optional
        Where workers keep finished units.

    Raises
    ------
    ValueError
        Workers have another version.
    ConnectionError
        There is no worker.

    Notes
    -----
    Dask schedules, retries and moves data. A bounded number of units is in flight at a time, workers add 16 of them
    before they return a sum, and sums are awaited in order. The memory of this process therefore does not depend on the
    number of units.
    """

    def __init__(self, client: Client, store: Store | None = None) -> None:
        self.client = client
        self.store = store
        self._address = client.scheduler_info(n_workers=0)["address"]
        self._threads = 1
        with self._clear_errors():
            self._wait_for_workers()
            client.register_plugin(OneThread())
            self._check_workers()

    @property
    def keeps(self) -> bool:
        """Whether finished units outlive the run."""
        return self.store is not None

    def begin(self, key: dict[str, Any]) -> None:
        """Open the store; ValueError if a worker does not see it."""
        if self.store is None:
            return
        self.store.begin(key)
        with self._clear_errors():
            seen = self.client.run(_sees, self.store)
        for worker, known in seen.items():
            if not known:
                raise ValueError(
                    f"worker {worker} does not see the store {self.store.url}; name one that all machines share, "
                    "such as s3://bucket/name"
                )

    def values(self, series: Iterable[Series], advance: Advance) -> Iterator[Array]:
        """The values of all units, series after series."""
        for _, value in self._parts(series, 1, _only, advance):
            yield value

    def sums(self, series: Iterable[Series], add: Add, advance: Advance) -> Iterator[Array]:
        """The sum over the units of each series."""
        total = TreeSum(add)
        for part, value in self._parts(series, FOLD, add, advance):
            total.put(value)
            if part.last:
                yield total.result()
                total = TreeSum(add)

    @property
    def threads(self) -> int:
        """Of all workers when this pool was made."""
        return self._threads

    def map(self, function: Callable[[Any], Any], items: Iterable[Any]) -> Iterator[Any]:
        """``function(item)`` of each item, in their order, as the built-in map has them; exceptions are its own.

        A bounded number of items is in flight at a time. Those of a worker that dies go to another.
        """
        flying: deque[Future[Any]] = deque()
        coming = iter(items)
        try:
            with self._clear_errors():
                while True:
                    for item in islice(coming, self._ahead - len(flying)):
                        flying.append(self.client.submit(function, item, pure=False, retries=RETRIES))
                    if not flying:
                        return
                    value = self._awaited(flying[0], _nothing)
                    flying.popleft()
                    yield value
        finally:
            if self.client.status == "running":
                self.client.cancel(list(flying))

    def share(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """The future value; Dask sends it to each worker that needs it, once."""
        with self._clear_errors():
            return self.client.submit(function, *arguments, retries=RETRIES)

    def send(self, path: Path, others: Iterable[Path]) -> SentFile:
        """Write a file, and others around it, on all workers."""
        files = Files(path, others)
        with self._clear_errors():
            self.client.register_plugin(files)
        return files.file

    # ------------------------------------------------------------------ units in flight

    def _parts(self, series: Iterable[Series], size: int, add: Add, advance: Advance) -> Iterator[tuple[_Part, Array]]:
        """Sums over `size` consecutive units each, in their order, and fewer at the end of a series."""
        coming = self._submit(series, size, add)
        flying: deque[_Part] = deque()
        done = _Progress(advance)
        try:
            with self._clear_errors():
                while True:
                    while sum(len(part.units) for part in flying) < self._ahead and (part := next(coming, None)):
                        done.watch(part)
                        flying.append(part)
                    if not flying:
                        break
                    value = self._awaited(flying[0].value, done.report)
                    part = flying.popleft()
                    yield part, value
            done.report()
        finally:
            if self.client.status == "running":
                self.client.cancel([future for part in flying for future in (*part.units, part.value)])

    def _submit(self, series: Iterable[Series], size: int, add: Add) -> Iterator[_Part]:
        run = uuid.uuid4().hex[:8]  # Dask identifies values by keys; series of other runs may have the same names
        for one in series:
            if self.store is not None:
                self.store.open(one)
            for start in range(0, one.count, size):
                numbers = range(start, min(start + size, one.count))
                # As separate arguments, so that Dask replaces futures by their values
                units = [
                    self.client.submit(
                        _unit, self.store, one.name, one.shape, one.function, k, *one.arguments,
                        key=f"{one.name}-{k}-{run}", pure=False, retries=RETRIES, priority=-start,
                    )
                    for k in numbers
                ]  # fmt: skip
                whole = units[0] if size == 1 else self.client.submit(_fold, units, add, pure=False, retries=RETRIES)
                yield _Part(one, units, whole, numbers.stop == one.count)

    @property
    def _ahead(self) -> int:
        return max(FEWEST_AHEAD, AHEAD * self._threads)

    def _awaited(self, value: Future[Any], report: Callable[[], None]) -> Any:
        """A value, when it is there."""
        alone = 0.0
        while True:
            report()
            try:
                wait(value, timeout=1)
                break
            except TimeoutError:
                alone = alone + 1 if not self.client.scheduler_info(n_workers=-1)["workers"] else 0.0
                if alone >= PATIENCE:
                    raise ConnectionError(self._resumable("there is no worker any more")) from None
        return value.result()

    # ------------------------------------------------------------------ what goes wrong

    def _wait_for_workers(self) -> None:
        try:
            self.client.wait_for_workers(1, timeout=PATIENCE / 6)
        except TimeoutError:
            raise ConnectionError(
                f"the scheduler {self._address} has no worker; start one: dask worker {self._address}"
            ) from None

    def _check_workers(self) -> None:
        """Raise ValueError for workers of another version."""
        self._threads = sum(self.client.nthreads().values())
        try:
            versions = self.client.run(_version)
        except ModuleNotFoundError as error:
            raise ValueError(f"a worker lacks {error.name!r}; install the extra 'cluster' there") from None
        for worker, version in versions.items():
            if version != __version__:
                raise ValueError(f"worker {worker} has voroquad {version}, here it is {__version__}; install the same")

    def _resumable(self, what: str) -> str:
        if self.store is None:
            return f"{what}; nothing was kept, as no store was named"
        return self.store.resumable(what)

    @contextmanager
    def _clear_errors(self) -> Iterator[None]:
        """Turn errors of Dask into errors of one line that tell what to do."""
        try:
            yield
        except CancelledError as error:
            gone, why = f"the scheduler {self._address} is gone", " ".join(str(error).split())
            if "scheduler-connection-lost" not in why:
                gone = f"the scheduler {self._address} dropped the work ({why})"
            raise ConnectionError(self._resumable(gone)) from None
        except CommClosedError:
            raise ConnectionError(self._resumable(f"the scheduler {self._address} is gone")) from None
        except KilledWorker as error:
            raise ChildProcessError(
                self._resumable(
                    f"unit {error.task} ended {error.allowed_failures + 1} workers, perhaps for lack of memory"
                )
            ) from None
        except OSError as error:
            if error.errno != errno.ENOSPC or self.store is None:
                raise
            raise OSError(error.errno, self._resumable(f"{os.strerror(error.errno)} ({error.filename})")) from None


class _Progress:
    """Counts finished units."""

    def __init__(self, advance: Advance) -> None:
        self._advance = advance
        self._done: deque[str] = deque()  # callbacks run on a thread of Dask

    def watch(self, part: _Part) -> None:
        """Count the units of a part as they finish."""
        for unit in part.units:
            unit.add_done_callback(lambda _, name=part.series.name: self._done.append(name))

    def report(self) -> None:
        """Report what finished since the last time."""
        if steps := len(self._done):
            names = [self._done.popleft() for _ in range(steps)]
            self._advance(names[-1], steps)


class OneThread(WorkerPlugin):
    """A unit is the work of one thread, unless the worker's environment says otherwise."""

    name = "voroquad-one-thread"
    idempotent = True

    def setup(self, worker: Worker) -> None:
        """Set the number of threads that a call of voroquad takes."""
        self._set_here = "VOROQUAD_NUM_THREADS" not in os.environ
        os.environ.setdefault("VOROQUAD_NUM_THREADS", "1")

    def teardown(self, worker: Worker) -> None:
        """Restore the number, since a worker may be a thread of the user's own process."""
        if self._set_here:
            os.environ.pop("VOROQUAD_NUM_THREADS", None)


# ---------------------------------------------------------------------- what workers run


def _unit(
    store: Store | None, name: str, shape: tuple[int, ...], function: Callable[..., Array], k: int, *arguments: Any
) -> Array:
    """The value of unit k."""
    try:
        return computed(Series(name, 0, shape, function, arguments), k, store)
    except (OSError, MemoryError):
        raise
    except Exception as error:
        raise ValueError(f"unit {k} of {name} failed: {type(error).__name__}: {error}") from error


def _fold(values: list[Array], add: Add) -> Array:
    return tree_sum(values, add)


def _only(a: Array, b: Array) -> Array:
    raise AssertionError("a part of one unit has nothing to add")


def _nothing() -> None:
    """Ignore a report."""


def _version() -> str:
    return __version__


def _sees(store: Store) -> bool:
    """Whether this worker sees the store."""
    return store.exists()
