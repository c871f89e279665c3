"""Result folders to one HTML file that needs nothing else: no network, no other file."""

from __future__ import annotations

import base64
import csv
import mimetypes
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from .._files import atomic_path
from ..results import Figure, Results, Section, Table

try:
    from jinja2 import Environment, PackageLoader, StrictUndefined
except ImportError as error:
    raise ImportError("reports need Jinja2: pip install 'voroquad[study]'") from error

#: An SVG picture above this size is replaced by its PNG twin.
LARGEST_SVG = 400_000


def write_report(folders: Sequence[str | os.PathLike[str]], output: str | os.PathLike[str], title: str = "") -> Path:
    """Write one self-contained page that shows the results of one or more folders.

    Parameters
    ----------
    folders : sequence of paths
        Folders with a ``results.json``, as ``voroquad study`` and ``compare`` leave them.
    output : path
        The HTML file; written whole or not at all.
    title : str, optional
        The page's title; by default that of the results, if they are of one folder.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    ValueError
        No folders; a folder without results, with damaged ones, or with files missing.
    """
    if not folders:
        raise ValueError("folders: name at least one folder that 'voroquad study' or 'compare' made")
    parts = [_part(Path(folder), number) for number, folder in enumerate(folders, 1)]
    environment = Environment(
        loader=PackageLoader("voroquad.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page = environment.get_template("page.html").render(title=title or _title(parts), parts=parts)
    with atomic_path(output) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return Path(output)


# ---------------------------------------------------------------------- what the template shows


@dataclass(frozen=True)
class Grid:
    """A CSV table, ready to print."""

    name: str
    caption: str
    header: list[str]
    rows: list[list[str]]
    href: str  # the CSV file as data URI

    @property
    def numeric(self) -> list[bool]:
        """Which columns hold numbers only."""
        return [all(_is_number(row[k]) for row in self.rows) for k in range(len(self.header))]


@dataclass(frozen=True)
class Part:
    """One folder's results, with access to its files."""

    folder: Path
    results: Results
    anchor: str

    def picture(self, figure: Figure) -> str:
        """The figure as data URI: SVG unless it is large."""
        if figure.svg is not None and self._path(figure.svg).stat().st_size <= LARGEST_SVG:
            return self.data(figure.svg)
        return self.data(figure.png)

    def data(self, name: str) -> str:
        """A file of the folder as data URI."""
        kind = mimetypes.guess_type(name)[0] or "application/octet-stream"
        return f"data:{kind};base64,{base64.b64encode(self._path(name).read_bytes()).decode('ascii')}"

    def table(self, table: Table) -> Grid:
        """A table of the results."""
        return self._grid(table.csv, table.caption)

    def numbers(self, figure: Figure) -> Grid | None:
        """The numbers behind a figure, if it has any."""
        return None if figure.csv is None else self._grid(figure.csv, "The numbers behind the figure.")

    def section_anchor(self, section: Section) -> str:
        """The section's id in the page."""
        return f"{self.anchor}-{self.results.sections.index(section) + 1}"

    def _grid(self, name: str, caption: str) -> Grid:
        with self._path(name).open(encoding="utf-8", newline="") as file:
            header, *rows = list(csv.reader(file)) or [[]]
        if any(len(row) != len(header) for row in rows):
            raise ValueError(f"{self._path(name)} has rows longer or shorter than its first line; make it again")
        return Grid(name, caption, header, [[_shortened(cell) for cell in row] for row in rows], self.data(name))

    def _path(self, name: str) -> Path:
        path = self.folder / name
        if not path.is_file():
            raise ValueError(f"{path} is missing; make the folder again: {self.results.command}")
        return path


def _title(parts: Sequence[Part]) -> str:
    return parts[0].results.title if len(parts) == 1 else "voroquad: results"


def _part(folder: Path, number: int) -> Part:
    return Part(folder, Results.read(folder), f"part{number}")


def _shortened(cell: str) -> str:
    """A number of many digits to five of them, to be read; the CSV file has them all."""
    return f"{float(cell):.5g}" if len(cell) > 9 and _is_number(cell) else cell


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
