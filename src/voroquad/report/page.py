"""Result folders to one HTML file that needs nothing else: no network, no other file."""

from __future__ import annotations

import base64
import json
import math
import mimetypes
import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

from .._support.extras import install_hint
from .._support.files import atomic_path
from .._support.numbers import scientific
from .._support.version import __version__
from ..results.manifest import NAME, Figure, ImageComparison, Results, Table
from .comparison import Viewer, make_viewer
from .csv_files import read_csv
from .embed import library
from .numbers import is_number, ratio, shortened, signed, subscripts
from .plots import Plots, make_plots

try:
    from jinja2 import Environment, PackageLoader, StrictUndefined
except ImportError as error:
    raise ImportError(f"reports need Jinja2; {install_hint('study')}") from error

#: An SVG picture above this size is replaced by its PNG twin.
LARGEST_SVG = 400_000
PAGE = "index.html"


def write_report(
    folders: Sequence[str | os.PathLike[str]],
    output: str | os.PathLike[str] | None = None,
    title: str = "",
    live: str = "",
) -> Path:
    """Write one self-contained page that shows the results of one or more folders.

    Parameters
    ----------
    folders : sequence of paths
        Folders with a ``results.json``, as ``voroquad study`` and ``compare`` leave them.
    output : path, optional
        The HTML file; written whole or not at all. By default ``index.html`` in the folder, or, of several folders,
        in the current one.
    title : str, optional
        The page's title; by default that of the results, if they are of one folder.
    live : str, optional
        The live figure (:func:`live_figure`), to be shown first.

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
    sections = [section for part in parts for section in part.results.sections]
    comparisons = any(section.comparisons for section in sections)
    plots = comparisons or any(figure.plots for section in sections for figure in section.figures)
    page = (
        _environment()
        .get_template("page.html")
        .render(
            title=title or _title(parts),
            parts=parts,
            comparisons=comparisons,
            library=library() if plots else "",
            version=__version__,
            live=live,
        )
    )
    output = Path(output) if output is not None else Path(folders[0], PAGE) if len(folders) == 1 else Path(PAGE)
    with atomic_path(output) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return output


def live_figure() -> str:
    """The page of the live figure; empty where the package was built without it (``make wasm`` makes it)."""
    page = Path(__file__).with_name("live.html")
    return page.read_text(encoding="utf-8") if page.exists() else ""


@cache
def _environment() -> Environment:
    """The templates of the page."""
    environment = Environment(
        loader=PackageLoader("voroquad.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.policies["json.dumps_kwargs"] = {"sort_keys": False}  # Bokeh refers backwards only
    environment.filters |= {
        "scientific": lambda value: scientific(value, 3),
        "signed": signed,
        "shortened": shortened,
        "ratio": ratio,
        "subscripts": subscripts,
    }
    return environment


# ---------------------------------------------------------------------- what the template shows


@dataclass(frozen=True)
class Grid:
    """A CSV table, ready to print."""

    name: str
    caption: str
    header: list[str]
    rows: list[list[str]]
    source: bytes

    @cached_property
    def numeric(self) -> list[bool]:
        """Which columns hold numbers only, where they hold anything."""
        columns = [[row[k] for row in self.rows if row[k]] for k in range(len(self.header))]
        return [bool(column) and all(map(is_number, column)) for column in columns]

    @property
    def downloads(self) -> dict[str, str]:
        """File names with their contents as data URIs: the CSV file, and the same as JSON."""
        records = [dict(zip(self.header, map(_json_value, row), strict=True)) for row in self.rows]
        text = json.dumps(records, ensure_ascii=False, separators=(",", ":"))
        return {
            self.name: _data_uri(self.source, "text/csv"),
            f"{Path(self.name).stem}.json": _data_uri(text.encode(), "application/json"),
        }


@dataclass(frozen=True)
class ResultsFolder:
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
        return _data_uri(self._path(name).read_bytes(), kind)

    def table(self, table: Table) -> Grid:
        """A table of the results."""
        return self._grid(table.csv, table.caption)

    def numbers(self, source: Figure | ImageComparison) -> Grid | None:
        """The numbers behind a figure or a comparison, if it has any."""
        return None if source.csv is None else self._grid(source.csv, "The numbers behind the figure.")

    def plots(self, figure: Figure) -> Plots | None:
        """The figure's plots, if it has any."""
        return make_plots(figure, self._path(figure.csv)) if figure.plots and figure.csv else None

    def viewer(self, comparison: ImageComparison, anchor: str) -> Viewer:
        """A comparison of renderings."""
        return make_viewer(comparison, self._path, anchor)

    def _grid(self, name: str, caption: str) -> Grid:
        file = read_csv(self._path(name))
        return Grid(Path(name).name, caption, file.header, file.rows, file.source)

    def _path(self, name: str) -> Path:
        """The path of a file that the results name; it must lie inside the folder, links followed."""
        path = self.folder / name
        if "\0" in name or not path.resolve().is_relative_to(self.folder.resolve()):
            raise ValueError(f"{self.folder / NAME} names {name[:200]!r}, which is not inside the folder")
        if not path.is_file():
            raise ValueError(f"{path} is missing; make the folder again: {self.results.command}")
        return path


def _title(parts: Sequence[ResultsFolder]) -> str:
    return parts[0].results.title if len(parts) == 1 else "voroquad: results"


def _part(folder: Path, number: int) -> ResultsFolder:
    return ResultsFolder(folder, Results.read(folder), f"part{number}")


def _data_uri(content: bytes, kind: str) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"


def _json_value(text: str) -> float | str | None:
    """A number if it is one that JSON has; null where nothing is known."""
    if not text:
        return None
    if not is_number(text) or not math.isfinite(number := float(text)):
        return text
    return int(number) if text.lstrip("-").isdigit() and abs(number) < 2**53 else number
