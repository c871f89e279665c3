"""Points in a text file, and their weights."""

from __future__ import annotations

import csv
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._support.arrays import Array
from .._support.files import atomic_path
from ..rules.registry import weights

_EXPECTED = "expected numbers separated by commas, a point per line"
#: The name of the last column of files with weights
WEIGHT = "weight"
#: Between the fields of a line: the first of these that the first line holds, else white space
_SEPARATORS = (",", ";", "\t")


def weigh_file(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    *,
    order: int | str = 0,
    debias: str = "none",
    design: str | None = None,
    bounds: ArrayLike | None = None,
) -> dict[str, Any]:
    """Read points, write them with a last column ``weight``.

    Parameters
    ----------
    source : str or path
        A file that :func:`read_points` reads.
    target : str or path
        CSV file to write.
    order, debias, design, bounds
        As for :func:`voroquad.weights`.

    Returns
    -------
    dict
        The number of points, the dimension and the sum of the weights.
    """
    points = read_points(source)
    few = len(points) < points.shape[1]  # rows are points, even a single one, and errors name the row
    w = weights(points[None] if few else points, order=order, debias=debias, design=design, bounds=bounds).ravel()
    columns = [*(f"x{a + 1}" for a in range(points.shape[1])), WEIGHT]
    with atomic_path(target) as temporary:
        table = np.column_stack([points, w])
        np.savetxt(temporary, table, fmt="%.17g", delimiter=",", header=",".join(columns), comments="")
    return {"n": len(points), "d": points.shape[1], "sum": float(w.sum()), "output": os.fspath(target)}


def read_points(source: str | os.PathLike[str]) -> Array:
    """Points (n, d) from a text file with a point on each line.

    Fields are separated by commas, semicolons, tabs or spaces, the same in the whole file. Empty lines and lines that
    begin with ``#`` are left out. A first line in which no field is a number is a header; it is left out too, and
    standard error says so. Nothing else is left out. Files that :func:`weigh_file` wrote are refused, since their last
    column holds no coordinates.

    Raises ValueError, which names line and field, for a field that is not a number and for lines of unequal length.
    """
    name = os.fspath(source)
    try:
        text = Path(source).read_text(encoding="utf-8-sig")  # spreadsheets begin a file with a byte order mark
    except UnicodeDecodeError:
        raise ValueError(f"{name} is not UTF-8 text; {_EXPECTED}") from None
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    separator = next((mark for mark in _SEPARATORS if lines and mark in lines[0][1]), None)
    if lines and not any(_is_number(field) for field in _fields(lines[0][1], separator)):
        if _fields(lines[0][1], separator)[-1] == WEIGHT:
            raise ValueError(f"{name}: the last column is called '{WEIGHT}' and would be a coordinate; drop it")
        print(f"voroquad: {name}: line {lines[0][0]} has no number and is taken as a header", file=sys.stderr)
        del lines[0]
    if not lines:
        raise ValueError(f"{name} holds no points; {_EXPECTED}")
    rows = [_fields(line, separator) for _, line in lines]
    _check(name, [k for k, _ in lines], rows)
    return np.array(rows, dtype=np.float64)


def _fields(line: str, separator: str | None) -> list[str]:
    """The fields of a line, quoted or not; without a separator, those between white space."""
    if separator is None:
        return line.split()
    return [field.strip() for field in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]


def _check(name: str, numbers: Sequence[int], rows: Sequence[Sequence[str]]) -> None:
    """Raise ValueError for the first line that is not as many numbers as the first."""
    for number, row in zip(numbers, rows, strict=True):
        if len(row) != len(rows[0]):
            raise ValueError(
                f"{name}: line {number} has {len(row)} fields, but line {numbers[0]} has {len(rows[0])}; {_EXPECTED}"
            )
        for k, field in enumerate(row, 1):
            if not _is_number(field):
                raise ValueError(f"{name}: field {k} of line {number} is {field!r}, not a number; {_EXPECTED}")


def _is_number(field: str) -> bool:
    """Whether a field is a number as text files have it: no underscores, as Python would allow."""
    if "_" in field or not field.isascii():
        return False
    try:
        float(field)
    except ValueError:
        return False
    return True
