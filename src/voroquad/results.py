"""What a run leaves in its folder: figures, tables and image grids, listed in ``results.json``.

Studies and comparisons write it, the report reads it; file names are relative to the folder.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

NAME = "results.json"


@dataclass
class Figure:
    """A picture with the numbers behind it."""

    png: str
    caption: str
    alt: str
    svg: str | None = None
    csv: str | None = None


@dataclass
class Table:
    """A CSV file whose first line names the columns."""

    csv: str
    caption: str


@dataclass
class ImageGrid:
    """Images in rows and columns; ``pngs[row][column]`` may be None."""

    rows: list[str]
    columns: list[str]
    pngs: list[list[str | None]]
    caption: str


@dataclass
class Section:
    """A titled part of the results."""

    title: str
    text: str = ""
    figures: list[Figure] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    grids: list[ImageGrid] = field(default_factory=list)


@dataclass
class Results:
    """Everything a run shows, and the command line that made it."""

    title: str
    command: str
    sections: list[Section] = field(default_factory=list)

    def write(self, folder: str | os.PathLike[str]) -> None:
        """Write ``results.json`` into `folder`."""
        text = json.dumps(asdict(self), indent=1, ensure_ascii=False)
        (Path(folder) / NAME).write_text(text + "\n", encoding="utf-8")

    @classmethod
    def read(cls, folder: str | os.PathLike[str]) -> Results:
        """Read what :meth:`write` wrote; ValueError if the folder holds no results."""
        path = Path(folder) / NAME
        if not path.is_file():
            raise ValueError(f"{os.fspath(folder)!r} holds no {NAME}; run 'voroquad study' or 'compare'")
        try:
            raw: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
            sections = [
                Section(
                    title=s["title"],
                    text=s["text"],
                    figures=[Figure(**f) for f in s["figures"]],
                    tables=[Table(**t) for t in s["tables"]],
                    grids=[ImageGrid(**g) for g in s["grids"]],
                )
                for s in raw["sections"]
            ]
            return cls(raw["title"], raw["command"], sections)
        except (KeyError, TypeError, AttributeError, ValueError) as error:
            raise ValueError(f"{path} is damaged ({error}); make it again") from None
