"""A figure with the numbers behind it, and how both are saved."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from matplotlib.figure import Figure

from ..results import manifest
from ..results.style import house_style

#: A table: one mapping from column to value per row, all with the same columns.
Rows = Sequence[Mapping[str, object]]


@dataclass(frozen=True)
class Drawing:
    """What one of the figure functions returns."""

    figure: Figure
    rows: Rows
    caption: str
    alt: str
    plots: Sequence[manifest.Plot] = ()
    series: str = "method"
    lines: Mapping[str, manifest.Line] = field(default_factory=dict)

    def save(self, folder: Path, stem: str) -> manifest.Figure:
        """Write ``stem.png``, ``.svg`` and ``.csv`` into `folder`."""
        with house_style():
            self.figure.savefig(folder / f"{stem}.png")
            self.figure.set_layout_engine("none")  # the SVG keeps the layout found for the PNG
            self.figure.savefig(folder / f"{stem}.svg", metadata={"Date": None})
        write_rows(folder / f"{stem}.csv", self.rows)
        return manifest.Figure(
            f"{stem}.png",
            self.caption,
            self.alt,
            svg=f"{stem}.svg",
            csv=f"{stem}.csv",
            plots=list(self.plots),
            series=self.series,
            lines=dict(self.lines),
        )


def write_rows(path: Path, rows: Rows) -> None:
    """Write a CSV file; floats with the ten digits that matter."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows({k: f"{v:.10g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows)


def read_rows(path: Path) -> list[dict[str, float | str]]:
    """The rows of a CSV file; what reads as a number is one."""
    with path.open(newline="", encoding="utf-8") as file:
        return [{k: _number(v) for k, v in row.items()} for row in csv.DictReader(file)]


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
