"""CSVs of results that are measured part by part."""

from __future__ import annotations

import csv
import fcntl
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any


def put(
    path: Path, columns: Sequence[str], lines: Sequence[Sequence[object]], key: Callable[[Sequence[str]], Any]
) -> None:
    """Write lines in the place of those with the same key; all lines are ordered by it.

    Several programs may do so at once.
    """
    with (Path(tempfile.gettempdir()) / f"{path.stem}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        _put(path, columns, lines, key)


def _put(
    path: Path, columns: Sequence[str], lines: Sequence[Sequence[object]], key: Callable[[Sequence[str]], Any]
) -> None:
    rows = [[str(entry) for entry in line] for line in lines]
    measured = [key(row) for row in rows]
    if path.exists():
        with path.open(newline="", encoding="utf-8") as file:
            rows += [row for row in list(csv.reader(file))[1:] if key(row) not in measured]
    path.parent.mkdir(exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(sorted(rows, key=key))
