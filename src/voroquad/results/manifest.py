"""What a run leaves in its folder: figures, tables and images, listed in ``results.json``.

Studies and comparisons write it, the report reads it. File names are relative to the folder and lie inside it.
Fields with a default may be missing in a file: those added later, so that older folders still open. What is read is
checked against the types of the fields and by the classes themselves.
"""

from __future__ import annotations

import json
import os
import re
from dataclasses import asdict, dataclass, field
from pathlib import Path

from .._support.checks import one_of, positive_int
from .._support.extras import install_hint

NAME = "results.json"
DASHES = ("solid", "dashed", "dotted")
MARKERS = ("none", "circle", "open circle", "diamond")


@dataclass
class Line:
    """How a series looks in a plot."""

    color: str  # "#rrggbb"
    dash: str = "solid"  # one of DASHES
    marker: str = "none"  # one of MARKERS

    def __post_init__(self) -> None:
        if not re.fullmatch("#[0-9a-fA-F]{6}", self.color):
            raise ValueError(f"color must be written #rrggbb, got {self.color[:20]!r}")
        one_of("dash", self.dash, DASHES)
        one_of("marker", self.marker, MARKERS)


@dataclass
class Plot:
    """Two columns of a figure's CSV, to be drawn log–log with a line per series; y by its absolute value."""

    x: str
    y: str
    x_label: str
    y_label: str
    error: str | None = None  # column with the standard error of y
    slope_from: float | None = None  # fit a slope to each line at x ≥ this, or to its last three points; None: no slope
    where: dict[str, str] = field(default_factory=dict)  # only rows with these values in these columns


@dataclass
class Figure:
    """A picture with the numbers behind it, and how a reader may plot those.

    ``series`` is the CSV's column with one value for each line of the plots, ``lines`` their looks; a series without
    one gets a colour of its own.
    """

    png: str
    caption: str
    alt: str
    svg: str | None = None
    csv: str | None = None
    plots: list[Plot] = field(default_factory=list)
    series: str = "method"
    lines: dict[str, Line] = field(default_factory=dict)


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

    def __post_init__(self) -> None:
        if [len(row) for row in self.pngs] != [len(self.columns)] * len(self.rows):
            raise ValueError(f"pngs must have {len(self.rows)} rows of {len(self.columns)} names each")


@dataclass
class Rendering:
    """An image, linear, as EXR."""

    method: str
    spp: int
    exr: str

    def __post_init__(self) -> None:
        positive_int("spp", self.spp)


@dataclass
class ImageComparison:
    """Renderings of one scene by several methods at several samples per pixel, beside their reference.

    ``csv`` has a line per rendering with the columns method, spp, mse, flip and seconds. Equal-error ratios refer to
    the method ``baseline`` first; ``closeups`` are windows (left, top, width, height) in pixels.
    """

    reference: str
    renderings: list[Rendering]
    csv: str
    baseline: str
    caption: str
    closeups: list[tuple[int, int, int, int]] = field(default_factory=list)


@dataclass
class Section:
    """A titled part of the results."""

    title: str
    text: str = ""
    figures: list[Figure] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    grids: list[ImageGrid] = field(default_factory=list)
    comparisons: list[ImageComparison] = field(default_factory=list)


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
            from pydantic import TypeAdapter, ValidationError
        except ImportError as error:
            raise ImportError(f"reading results needs pydantic; {install_hint('study')}") from error
        try:
            return TypeAdapter(cls).validate_json(path.read_bytes())
        except ValidationError as error:
            first = error.errors(include_url=False, include_context=False, include_input=False)[0]
            place = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in first["loc"]).lstrip(".")
            reason = f"{place[:100]}: {first['msg'][:200]}" if place else first["msg"]
            raise ValueError(f"{path} is damaged ({reason}); make it again") from None
