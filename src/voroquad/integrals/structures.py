"""Values of func as rows of real numbers, and back: arrays, complex ones, and dicts and tuples of these."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from array_api_compat import is_array_api_obj

from .._support.arrays import Array, Numbers


@dataclass(frozen=True)
class Branch:
    """A dict, a tuple or a named tuple. Its children are branches too, or None for arrays.

    Attributes
    ----------
    kind : type
        ``dict``, ``tuple`` or the class of a named tuple.
    keys : tuple
        Of a dict; of the others the positions.
    children : tuple
        One per key.
    """

    kind: type
    keys: tuple[Any, ...]
    children: tuple[Branch | None, ...]

    def build(self, parts: list[Any]) -> Any:
        """The structure with these parts in it, one for each child."""
        if self.kind is dict:
            return dict(zip(self.keys, parts, strict=True))
        return self.kind(*parts) if hasattr(self.kind, "_fields") else tuple(parts)


#: What a call of func gives: the structure of its values, their arrays (..., n), the relative rounding error of each.
Answer = tuple[Branch | None, list[Numbers], float]


def take_apart(values: Any, single: bool) -> tuple[Branch | None, list[Any]]:
    """The structure of what func returned and its arrays, in order.

    A tuple of plain numbers is an array as a list is; where func has a `single` point each of them is a value of its
    own.
    """
    kind: type
    if isinstance(values, Mapping):
        kind, keys, items = dict, tuple(values), list(values.values())
    elif isinstance(values, tuple) and (single or any(_is_many(v) for v in values)):
        kind, keys, items = type(values), tuple(range(len(values))), list(values)
    else:
        return None, [values]
    branches, leaves = [], []
    for item in items:
        branch, found = take_apart(item, single)
        branches.append(branch)
        leaves += found
    return Branch(kind, keys, tuple(branches)), leaves


def _is_many(value: Any) -> bool:
    return isinstance(value, Mapping | tuple | list) or (is_array_api_obj(value) and value.ndim > 0)


def names_of(branch: Branch | None) -> list[str]:
    """How errors name each array of a structure, such as ['energy'][0]; one that stands alone has no name."""
    if branch is None:
        return [""]
    return [
        f"[{key!r}]{rest}"
        for key, child in zip(branch.keys, branch.children, strict=True)
        for rest in names_of(child)
    ]  # fmt: skip


def check_shapes(branch: Branch | None, leaves: list[Numbers], shape: tuple[int, ...]) -> None:
    """Raise ValueError unless each array is (..., n) for points of this shape (d, n)."""
    n = shape[-1]
    for name, values in zip(names_of(branch), leaves, strict=True):
        within = f" in {name}" if name else ""
        if values.ndim == 0 or values.shape[-1] != n:
            if values.ndim == 0:
                remedy = "; return a value for each point, as np.full(x.shape[1], value) is"
            else:
                remedy = "; put the points last, as values.T does" if values.shape[0] == n else ""
            raise ValueError(
                f"func must return shape ({n},) or (..., {n}) for points of shape {shape}, got {values.shape}"
                f"{within}{remedy}"
            )
        if values.size == 0:
            raise ValueError(f"func must return one component or more, got shape {values.shape}{within}")
    if not leaves:
        raise ValueError("func must return one component or more, got an empty dict or tuple")


def mapped(function: Callable[..., Any], first: Any, *others: Any) -> Any:
    """The structure `first` with function(leaf, ...) in the place of each leaf; the others are structured alike."""
    if isinstance(first, dict):
        return {key: mapped(function, value, *(o[key] for o in others)) for key, value in first.items()}
    if isinstance(first, tuple):
        parts = [mapped(function, *values) for values in zip(first, *others, strict=True)]
        return type(first)(*parts) if hasattr(first, "_fields") else tuple(parts)
    return function(first, *others)


def part(structure: Any, where: Any) -> Any:
    """A component: the index of an array, the key of a dict, or a tuple of a key and what follows within it."""
    if not isinstance(structure, dict | tuple):
        return structure[where]
    first, *rest = where if isinstance(where, tuple) else (where,)
    return part(structure[first], tuple(rest)) if rest else structure[first]


@dataclass(frozen=True)
class Form:
    """What func returns for a point.

    Attributes
    ----------
    branch : Branch or None
        The structure; None for an array.
    shapes : tuple of tuple of int
        Of each array, without the axis of the points.
    is_complex : tuple of bool
        Whether an array is complex: its real parts and then its imaginary parts are rows.
    """

    branch: Branch | None
    shapes: tuple[tuple[int, ...], ...]
    is_complex: tuple[bool, ...]

    @classmethod
    def of(cls, branch: Branch | None, leaves: list[Numbers]) -> Form:
        """That of arrays (..., n)."""
        return cls(branch, tuple(v.shape[:-1] for v in leaves), tuple(np.iscomplexobj(v) for v in leaves))

    def rows(self, leaves: list[Numbers]) -> Array:
        """Real numbers (fields, n) of arrays (..., n). Real arrays where the form has complex ones are as good.

        Of a single array they may share its memory.
        """
        found = []
        for leaf, as_complex in zip(leaves, self.is_complex, strict=True):
            flat = leaf.reshape(-1, leaf.shape[-1])
            found += [flat.real, flat.imag] if as_complex else [flat]
        return found[0] if len(found) == 1 else np.concatenate(found)

    def size(self, leaf: int) -> int:
        """Number of rows of an array."""
        return int(np.prod(self.shapes[leaf], dtype=int)) * (2 if self.is_complex[leaf] else 1)

    def build(self, leaves: list[Any]) -> Any:
        """The structure that func returns, with these in the places of its arrays."""
        return _assembled(self.branch, list(leaves))

    def partners(self) -> list[int]:
        """For each row that of the other part of its complex number, or the row itself."""
        found: list[int] = []
        for shape, as_complex in zip(self.shapes, self.is_complex, strict=True):
            size, start = int(np.prod(shape, dtype=int)), len(found)
            ranges = [(size, 2 * size), (0, size)] if as_complex else [(0, size)]
            found += [start + i for first, last in ranges for i in range(first, last)]
        return found

    def components(self) -> list[int]:
        """The component that each row belongs to; both parts of a complex number are of one.

        Examples
        --------
        >>> from voroquad.integrals.structures import Form
        >>> Form(None, ((), (2,)), (False, True)).components()
        [0, 1, 2, 1, 2]
        """
        rows = enumerate(self.partners())
        first: list[int] = [min(row, partner) for row, partner in rows]
        number = {row: i for i, row in enumerate(sorted(set(first)))}
        return [number[row] for row in first]

    def leaves(self, rows: Numbers) -> list[Numbers]:
        """Arrays (*shape, ...) of rows (fields, ...)."""
        found, start = [], 0
        for shape, as_complex in zip(self.shapes, self.is_complex, strict=True):
            size = int(np.prod(shape, dtype=int))
            values = rows[start : start + size]
            start += size
            if as_complex:
                both = np.empty(values.shape, dtype=np.complex128)  # a sum would make infinite parts NaN
                both.real, both.imag = values, rows[start : start + size]
                values = both
                start += size
            found.append(values.reshape((*shape, *rows.shape[1:])))
        return found

    def texts(self, rows: Sequence[str]) -> Any:
        """Texts of rows in the structure that func returns: strings, and arrays of strings (*shape,)."""
        found: list[Any] = []
        for leaf in self.leaves(np.arange(len(rows))):
            parts = np.stack([leaf.real, leaf.imag]) if np.iscomplexobj(leaf) else leaf[None]
            texts = [" | ".join(dict.fromkeys(rows[int(k)] for k in ks)) for ks in parts.reshape(len(parts), -1).T]
            found.append(np.array(texts, dtype=object).reshape(leaf.shape) if leaf.ndim else texts[0])
        return _assembled(self.branch, found)

    def assemble(self, rows: Numbers, finish: Callable[[Numbers], Any] = lambda leaf: leaf) -> Any:
        """Rows (fields, ...) in the structure that func returns, each array (*shape, ...) as `finish` makes it."""
        return self.build([finish(leaf) for leaf in self.leaves(rows)])


def _assembled(branch: Branch | None, leaves: list[Any]) -> Any:
    """The structure with the leaves, which are taken from the front of the list."""
    if branch is None:
        return leaves.pop(0)
    return branch.build([_assembled(child, leaves) for child in branch.children])
