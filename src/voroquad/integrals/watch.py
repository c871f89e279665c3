"""What is known of an integral while it is computed: for callbacks, progress bars and Ctrl-C."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, Protocol, TypeVar


class Counted(Protocol):
    """What rests on n evaluations."""

    @property
    def n(self) -> int:
        """Their number."""


E = TypeVar("E", bound=Counted)


class Watch(Generic[E]):
    """Counts the evaluations of a call, and holds the estimates that it could end with.

    Estimators say how to make an estimate of what they have so far. It is made only where somebody asks, so a call that
    nobody watches pays nothing.
    """

    def __init__(self) -> None:
        self.n_evaluations = 0
        #: Called after each batch of evaluations
        self.listeners: list[Callable[[], None]] = []
        self._finished: E | None = None
        self._running: Callable[[], E | None] | None = None

    def evaluated(self, n: int) -> None:
        """Count n evaluations more."""
        self.n_evaluations += n
        self.tell()

    def tell(self) -> None:
        """Call the listeners."""
        for listener in self.listeners:
            listener()

    def follow(self, running: Callable[[], E | None]) -> None:
        """Take what an estimator says of the whole integral until it has ended; None while it knows nothing."""
        self._running = running

    def finish(self, estimate: E) -> None:
        """Take an estimate that is complete, as a round of the tolerance mode is."""
        self._finished, self._running = estimate, None

    def known(self) -> E | None:
        """Of the estimates so far the one from most evaluations: their number, unlike their values, is no choice."""
        running = self._running() if self._running is not None else None
        found = [e for e in (self._finished, running) if e is not None]
        return max(found, key=lambda e: e.n, default=None)


class WatchOfParts(Watch[Any]):
    """Of a part of an integral only the evaluations count, since its estimates are none of the whole."""

    def __init__(self, whole: Watch[Any]):
        super().__init__()
        self._whole = whole

    def evaluated(self, n: int) -> None:
        """Count n evaluations more."""
        self._whole.evaluated(n)

    def known(self) -> None:
        """Nothing."""
