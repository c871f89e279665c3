"""CSV files of results: read in one place, refused in one line."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class CsvFile:
    """The first line of a CSV file, the rows below it, and the file's bytes."""

    header: list[str]
    rows: list[list[str]]
    source: bytes

    @property
    def records(self) -> list[dict[str, str]]:
        """The rows, each by the names of the columns."""
        return [dict(zip(self.header, row, strict=True)) for row in self.rows]


def read_csv(path: Path) -> CsvFile:
    """Read a CSV file whose first line names the columns.

    Raises
    ------
    ValueError
        It is no text, names no column or one twice, or has rows longer or shorter than its first line.
    """
    source = path.read_bytes()
    try:
        header, *rows = csv.reader(io.StringIO(source.decode("utf-8"), newline=""))
        if not header or len(set(header)) < len(header):
            raise ValueError("its first line must name each column once")
        if any(len(row) != len(header) for row in rows):
            raise ValueError("it has rows longer or shorter than its first line")
    except (csv.Error, ValueError) as error:
        reason = str(error)[:200] if source else "it is empty"
        raise ValueError(f"{path} is damaged ({reason}); make it again") from None
    return CsvFile(header, rows, source)
