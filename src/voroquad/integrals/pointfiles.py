"""Points in a CSV file, weighed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from .._support.files import atomic_path
from ..rules.registry import weights

_EXPECTED = "expected numbers separated by commas, a point per line"


def weigh_file(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    *,
    order: int = 0,
    debias: str = "none",
    design: str | None = None,
) -> dict[str, Any]:
    """Read points (a line each, a header allowed), write them with a last column ``weight``.

    Returns the number of points, the dimension and the sum of the weights.
    """
    try:
        lines = Path(source).read_text(encoding="utf-8").splitlines()
    except UnicodeDecodeError:
        raise ValueError(f"{os.fspath(source)} is no text; {_EXPECTED}") from None
    if lines and not _is_numbers(lines[0]):
        del lines[0]
    if not any(line.strip() for line in lines):
        raise ValueError(f"{os.fspath(source)} holds no points; {_EXPECTED}")
    try:
        points = np.loadtxt(lines, delimiter=",", ndmin=2)
    except ValueError as error:
        reason = str(error).split(";")[0]  # NumPy's advice is for its own arguments
        raise ValueError(f"{os.fspath(source)}: {reason}; {_EXPECTED}") from None
    w = weights(points, order=order, debias=debias, design=design)
    columns = [*(f"x{a + 1}" for a in range(points.shape[1])), "weight"]
    with atomic_path(target) as temporary:
        table = np.column_stack([points, w])
        np.savetxt(temporary, table, fmt="%.17g", delimiter=",", header=",".join(columns), comments="")
    return {"n": len(points), "d": points.shape[1], "sum": float(w.sum()), "output": os.fspath(target)}


def _is_numbers(line: str) -> bool:
    try:
        [float(cell) for cell in line.split(",")]
    except ValueError:
        return False
    return True
