"""What a run leaves in its folder: figures, tables and images, listed in ``results.json``.

Studies and comparisons write it, the report reads it; file names are relative to the folder. Fields with a default
may be missing in a file: those added later, so that older folders still open.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

NAME = "results.json"


@dataclass
class Line:
    """How a series looks in a plot."""

    color: str  # "#rrggbb"
    dash: str = "solid"  # solid, dashed or dotted
    marker: str = "none"  # none, circle, open circle or diamond


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

    ``series`` is the CSV's column that tells the lines of the plots apart, ``lines`` their looks; a series without
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


@dataclass
class Rendering:
    """An image, linear, as EXR."""

    method: str
    spp: int
    exr: str


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
    closeups: list[list[int]] = field(default_factory=list)


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
            raw: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
            return cls(raw["title"], raw["command"], [_section(section) for section in raw["sections"]])
        except (KeyError, TypeError, AttributeError, ValueError) as error:
            raise ValueError(f"{path} is damaged ({error}); make it again") from None


def _section(raw: dict[str, Any]) -> Section:
    return Section(
        title=raw["title"],
        text=raw["text"],
        figures=[_figure(figure) for figure in raw["figures"]],
        tables=[Table(**table) for table in raw["tables"]],
        grids=[ImageGrid(**grid) for grid in raw["grids"]],
        comparisons=[_comparison(comparison) for comparison in raw.get("comparisons", [])],
    )


def _figure(raw: dict[str, Any]) -> Figure:
    plots = [Plot(**plot) for plot in raw.get("plots", [])]
    lines = {name: Line(**line) for name, line in raw.get("lines", {}).items()}
    return Figure(**raw | {"plots": plots, "lines": lines})


def _comparison(raw: dict[str, Any]) -> ImageComparison:
    return ImageComparison(**raw | {"renderings": [Rendering(**rendering) for rendering in raw["renderings"]]})
