"""Work in units. Their values are combined in a fixed order, wherever they were computed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from .arrays import Array

Add = Callable[[Array, Array], Array]
#: Called with what is being done and the number of units done since the last call
Advance = Callable[[str, int], None]


@dataclass(frozen=True)
class Series:
    """Units of one kind, numbered from 0.

    Parameters
    ----------
    name : str
        A valid folder name, unique in a run.
    count : int
        Number of units.
    shape : tuple of int
        Shape of a unit's value.
    function : callable
        ``function(*arguments, k)`` is the value of unit k, float64: pure, on one thread, in 1 to 60 seconds where
        there is that much to do. A function of a module, for it travels by its name.
    arguments : tuple
        Arguments of all units: small values, or results of :meth:`Pool.share` or :meth:`Pool.send`.
    """

    name: str
    count: int
    shape: tuple[int, ...]
    function: Callable[..., Array]
    arguments: tuple[Any, ...] = ()

    def value(self, k: int) -> Array:
        """The value of unit k."""
        return self.function(*self.arguments, k)


class File(Protocol):
    """A file that units need, at the place where they are computed."""

    @property
    def path(self) -> Path:
        """Its path on this machine."""


class Kept(Protocol):
    """Values of finished units that outlive the run."""

    def begin(self, key: dict[str, Any]) -> None:
        """Take the units of a run with these settings; ValueError if there are those of another."""

    def open(self, series: Series) -> None:
        """Make room for the units of a series."""

    def read(self, series: str, k: int) -> Array | None:
        """The value of unit k, or None if it is not finished."""

    def write(self, series: str, k: int, value: Array) -> None:
        """Keep the value of unit k."""


class Pool(Protocol):
    """What computes units.

    All pools give the same bits: a unit's value depends on its arguments alone, values come in the order of the
    units, and sums are those of :class:`TreeSum`.
    """

    @property
    def keeps(self) -> bool:
        """Whether finished units outlive the run."""

    def begin(self, key: dict[str, Any]) -> None:
        """Say by which settings the units that follow differ from those of other runs."""

    def values(self, series: Iterable[Series], advance: Advance) -> Iterator[Array]:
        """The values of all units, series after series."""

    def sums(self, series: Iterable[Series], add: Add, advance: Advance) -> Iterator[Array]:
        """The sum over the units of each series."""

    def share(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """The value of ``function(*arguments)`` as an argument of units: computed once, carried to each worker once."""

    def send(self, path: Path, others: Iterable[Path]) -> File:
        """A file as an argument of units, with others at their places around it."""


class TreeSum:
    """The sum of values that come one after the other, by a binary tree that their number alone determines.

    The tree of a sequence whose values are the sums of 2^m consecutive values each is that of the values themselves:
    so parts can be summed where they are, and log2 of their number is all that is held at a time.

    Examples
    --------
    >>> total = TreeSum(lambda a, b: f"({a}+{b})")
    >>> for value in "abcdefg":
    ...     total.put(value)
    >>> total.result()
    '(((a+b)+(c+d))+((e+f)+g))'
    """

    def __init__(self, add: Callable[[Any, Any], Any]) -> None:
        self._add = add
        self._sums: list[tuple[int, Any]] = []  # sums over 2^level values, level falling

    def put(self, value: Any) -> None:
        """Add the next value."""
        level = 0
        while self._sums and self._sums[-1][0] == level:
            value = self._add(self._sums.pop()[1], value)
            level += 1
        self._sums.append((level, value))

    def result(self) -> Any:
        """The sum of one value or more."""
        _, total = self._sums[-1]
        for _, value in reversed(self._sums[:-1]):
            total = self._add(value, total)
        return total


def tree_sum(values: Iterable[Any], add: Callable[[Any, Any], Any]) -> Any:
    """The sum of one value or more, see :class:`TreeSum`."""
    total = TreeSum(add)
    for value in values:
        total.put(value)
    return total.result()


def computed(series: Series, k: int, kept: Kept | None) -> Array:
    """The value of unit k: as it was kept, or now, and then kept."""
    if kept is not None and (value := kept.read(series.name, k)) is not None:
        return value
    value = series.value(k)
    if value.shape != series.shape:
        raise AssertionError(f"a unit of {series.name} has the shape {value.shape}, not {series.shape}")
    if kept is not None:
        kept.write(series.name, k, value)
    return value


@dataclass(frozen=True)
class LocalFile:
    """A file on this machine."""

    path: Path


@dataclass(frozen=True)
class InProcess:
    """The pool of this process: one unit after the other.

    Parameters
    ----------
    kept : Kept, optional
        Where finished units are kept.
    """

    kept: Kept | None = None

    @property
    def keeps(self) -> bool:
        """Whether finished units outlive the run."""
        return self.kept is not None

    def begin(self, key: dict[str, Any]) -> None:
        """Ready what keeps finished units."""
        if self.kept is not None:
            self.kept.begin(key)

    def values(self, series: Iterable[Series], advance: Advance) -> Iterator[Array]:
        """The values of all units, series after series."""
        for one in series:
            yield from self._of(one, advance)

    def sums(self, series: Iterable[Series], add: Add, advance: Advance) -> Iterator[Array]:
        """The sum over the units of each series."""
        for one in series:
            yield tree_sum(self._of(one, advance), add)

    def _of(self, series: Series, advance: Advance) -> Iterator[Array]:
        if self.kept is not None:
            self.kept.open(series)
        for k in range(series.count):
            value = computed(series, k, self.kept)
            advance(series.name, 1)
            yield value

    def share(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """The value itself."""
        return function(*arguments)

    def send(self, path: Path, others: Iterable[Path]) -> File:
        """The file itself."""
        return LocalFile(path)


ONE_PROCESS = InProcess()
