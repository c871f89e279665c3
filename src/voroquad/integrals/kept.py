"""Evaluations that outlive their call: a call that was killed goes on where it was."""

from __future__ import annotations

import functools
import hashlib
import json
import os
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .structures import Answer, Branch, Form, check_shapes

if TYPE_CHECKING:
    from ..cluster.store import Store

#: To be increased when the same call has other points or batches.
FORMAT = 2

#: Settings whose numbers count by their values: whole numbers and an array are as good.
NUMBERS = ("a", "b", "loc", "scale")

#: Numbers of an array that a key holds as they are; more are told by their hash.
MOST_NUMBERS = 16

_KINDS: dict[str, type] = {"dict": dict, "tuple": tuple}


class KeptEvaluations:
    """The batches of a call in a store, numbered in the order in which they are needed.

    An array of a batch has the coordinates and the values of a point in each column, (d + fields, m).

    Parameters
    ----------
    store : Store
        It begins with the first batch, so a call that is refused before leaves no trace.
    key : dict
        The settings of the call.
    """

    def __init__(self, store: Store, key: dict[str, Any]):
        self.store, self._key, self._next, self._begun = store, key, 0, False
        #: Of the rounds of the tolerance mode: what their batches have in their names
        self.branch = ""

    @classmethod
    def of(cls, url: str | os.PathLike[str], settings: Mapping[str, Any]) -> KeptEvaluations:
        """Those of a call with these settings, "func" among them; ValueError if the store belongs to another one."""
        from ..cluster.store import Store

        store = Store(os.fspath(url))
        key = {name: _told(_as_float(value) if name in NUMBERS else value) for name, value in settings.items()}
        whole = key | {"func": _name_of(settings["func"]), "evaluations": FORMAT}
        store.check(whole)
        return cls(store, whole)

    def begin(self) -> None:
        """Claim the store, unless that has been done."""
        if not self._begun:
            self.store.begin(self._key)
            self._begun = True

    def completed(
        self, pieces: list[NDArray[Any]], evaluate: Callable[[list[NDArray[Any]]], Iterator[Answer]]
    ) -> Iterator[Answer]:
        """The answers for pieces (d, m): those that are kept, and the others as they are evaluated, then kept."""
        self.begin()
        numbers = range(self._next, self._next + len(pieces))
        self._next = numbers.stop
        known = [self._read(k, x) for k, x in zip(numbers, pieces, strict=True)]
        new = evaluate([x for x, answer in zip(pieces, known, strict=True) if answer is None])
        for k, x, answer in zip(numbers, pieces, known, strict=True):
            if answer is None:
                answer = next(new)
                self._write(k, x, answer)
            yield answer

    def _read(self, k: int, x: NDArray[Any]) -> Answer | None:
        found = self.store.get(self._name(k))
        if found is None:
            return None
        values, about = found
        if values[: len(x)].tobytes() != np.asarray(x, dtype=np.float64).tobytes():
            raise ValueError(
                f"store {self.store.url} keeps evaluations at other points than those of this call (batch {k}); "
                "name another store"
            )
        branch = _branch(about["branch"])
        form = Form(branch, tuple(map(tuple, about["shapes"])), tuple(about["is_complex"]))
        return branch, form.leaves(values[len(x) :]), about["epsilon"]

    def _write(self, k: int, x: NDArray[Any], answer: Answer) -> None:
        branch, leaves, epsilon = answer
        check_shapes(branch, leaves, x.shape)
        form = Form.of(branch, leaves)
        about = {"branch": _written(branch), "shapes": form.shapes, "is_complex": form.is_complex, "epsilon": epsilon}
        self.store.put(self._name(k), np.concatenate([x, form.rows(leaves)], dtype=np.float64), about)

    def _name(self, k: int) -> str:
        return f"batch{self.branch}-{k:06d}"


class Trials:
    """The rounds of the tolerance mode, where no other call made any."""

    def planned(self, first: int, most: int) -> int:
        """Evaluations of the rounds so far that this call counts, with a first set of `first` and at most `most`."""
        return 0

    def of_others(self, room: int) -> int | None:
        """The largest number of evaluations of the next round, if a call with another tolerance began it.

        One that is not complete is passed over where it has more than `room`.
        """
        return None

    def begin(self, n: int, last: bool) -> None:
        """Begin a round of at most n evaluations, the last of the call or one before."""

    def end(self, n: int) -> None:
        """The round is complete, with n evaluations."""


class KeptTrials(Trials):
    """The rounds of all calls with a store that differ in their tolerance only, in their order.

    Parameters
    ----------
    kept : KeptEvaluations
        Of the call.
    call : dict
        What tells the call from others.
    rng : numpy.random.Generator
        Of the samples.

    Notes
    -----
    A call that passes over an unfinished round goes on in a branch: its rounds and batches have names of their own, and
    its samples come from another stream, so that they are independent of those of the round. Other calls that pass over
    the same round share the branch. The call keeps to its branch when the round has been completed since.
    """

    def __init__(self, kept: KeptEvaluations, call: Mapping[str, Any], rng: np.random.Generator):
        self._kept, self._rng, self._next = kept, rng, 0
        self._call = {name: _told(_as_float(value)) for name, value in call.items()}
        self._told = hashlib.sha256(json.dumps(self._call, sort_keys=True).encode()).hexdigest()[:16]

    def planned(self, first: int, most: int) -> int:
        """As rounds have it."""
        spent, k, branch = 0, 0, ""
        while (found := self._kept.store.get(_round(branch, k))) is not None:
            own = found[1] == self._call
            if own and found[0][1:].any():  # its last
                return 0
            n = int((self._ended(branch, k) or found)[0][0])
            if not own and self._passes(branch, k, n, most - spent - first):
                branch += f"-{k}"
                continue
            spent, k = spent + n, k + 1
        return spent

    def of_others(self, room: int) -> int | None:
        """As rounds have it."""
        while True:
            branch = self._kept.branch
            found = self._kept.store.get(_round(branch, self._next))
            if found is None or found[1] == self._call:
                return None
            if not self._passes(branch, self._next, int(found[0][0]), room):
                self._next += 1
                return int(found[0][0])
            self._kept.begin()
            self._kept.store.put(self._passed(branch, self._next), np.zeros(1), self._call)
            self._kept.branch += f"-{self._next}"
            seed = self._rng.integers(2**63, size=4).tolist()
            self._rng.bit_generator.state = type(self._rng.bit_generator)(seed).state

    def begin(self, n: int, last: bool) -> None:
        """As rounds have it."""
        self._kept.begin()
        name = _round(self._kept.branch, self._next)
        if self._kept.store.get(name) is None:
            self._kept.store.put(name, np.array([float(n), float(last)]), self._call)
        self._next += 1

    def end(self, n: int) -> None:
        """As rounds have it."""
        if self._ended(self._kept.branch, self._next - 1) is None:
            self._kept.store.put(_end(self._kept.branch, self._next - 1), np.array([float(n)]), {})

    def _passes(self, branch: str, k: int, n: int, room: int) -> bool:
        """Whether to pass over a round of another call, of at most n evaluations."""
        if self._kept.store.get(self._passed(branch, k)) is not None:
            return True
        return n > room and self._ended(branch, k) is None

    def _ended(self, branch: str, k: int) -> Any:
        return self._kept.store.get(_end(branch, k))

    def _passed(self, branch: str, k: int) -> str:
        return f"passed{branch}-{k:06d}-{self._told}"


def _round(branch: str, k: int) -> str:
    return f"round{branch}-{k:06d}"


def _end(branch: str, k: int) -> str:
    return f"end{branch}-{k:06d}"


def _name_of(func: Any) -> str:
    """What is written in a program, with what a partial binds; that of an object is its class."""
    if isinstance(func, functools.partial):
        bound = [*map(_told, func.args), *(f"{name}={_told(value)}" for name, value in func.keywords.items())]
        return f"{_name_of(func.func)}({', '.join(bound)})"
    return str(getattr(func, "__qualname__", type(func).__qualname__))


def _written(branch: Branch | None) -> Any:
    """A structure as JSON; ValueError for what JSON does not give back."""
    if branch is None:
        return None
    kind = branch.kind.__name__
    if _KINDS.get(kind) is not branch.kind or not all(isinstance(key, str | int) for key in branch.keys):
        raise ValueError(
            f"store= keeps arrays, tuples, and dicts whose keys are texts, and func returned a {kind} with the keys "
            f"{', '.join(map(repr, branch.keys))}; return a dict with texts as keys"
        )
    return {"kind": kind, "keys": branch.keys, "children": [_written(child) for child in branch.children]}


def _branch(written: Any) -> Branch | None:
    if written is None:
        return None
    return Branch(_KINDS[written["kind"]], tuple(written["keys"]), tuple(map(_branch, written["children"])))


def _as_float(value: Any) -> Any:
    """Real numbers in double precision as a float or nested lists of floats; all else as it is."""
    if not isinstance(value, int | float | list | tuple | np.ndarray | np.number):
        return value
    try:
        numbers = np.asarray(value)
    except ValueError:  # lists of different lengths
        return value
    is_double = numbers.dtype.kind in "iu" or numbers.dtype == np.float64
    return numbers.astype(np.float64).tolist() if is_double else value


def _told(value: Any) -> str:
    """What a setting is: numbers and texts as they are, a function by its name, all else by its hash."""
    from dask.base import tokenize

    value = value.item() if isinstance(value, np.generic) else value
    if value is None or isinstance(value, bool | int | float | str):
        return repr(value)
    if isinstance(value, np.random.Generator):
        state = json.dumps(value.bit_generator.state, default=lambda array: array.tolist())
        return hashlib.sha256(state.encode()).hexdigest()[:16]
    if isinstance(value, list | tuple | np.ndarray):
        try:
            numbers = np.asarray(value)
        except ValueError:
            numbers = np.empty(0, dtype=object)
        if numbers.dtype.kind in "biuf" and 0 < numbers.size <= MOST_NUMBERS:
            return repr(numbers.tolist())
    return _name_of(value) if hasattr(value, "__qualname__") else str(tokenize(value))
