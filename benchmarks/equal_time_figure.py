"""Draws docs/figures/equal-time.svg from benchmarks/results/equal_time.csv: python benchmarks/equal_time_figure.py"""

from __future__ import annotations

import csv
import math
from collections import defaultdict
from pathlib import Path

from voroquad.results.style import BLUE, GREEN, MUTED, PURPLE, SKY, VERMILION, house_style, new_figure

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "benchmarks" / "results" / "equal_time.csv"
FIGURE = ROOT / "docs" / "figures" / "equal-time.svg"
STYLES = {
    "quad": (BLUE, "-", 2.2), "quad, default": (BLUE, ":", 1.8), "qmc_quad": (VERMILION, "-", 1.6),
    "CubQMCNetG": (GREEN, "-", 1.2), "CubQMCLatticeG": (GREEN, "--", 1.2), "vegas": (PURPLE, "-", 1.2),
    "cubature": (MUTED, "-", 1.2), "cubic stratification": (SKY, "-", 1.2),
}  # fmt: skip
LEAST = 1e-32  # squared relative errors below are rounding


def curves() -> dict[tuple[int, str], list[tuple[float, float]]]:
    """By dimension and rule, times and geometric means of the squared errors of all families that are known there."""
    with RESULTS.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    by_n: dict[tuple[int, str, int], list[tuple[float, float]]] = defaultdict(list)
    for r in rows:
        by_n[int(r["d"]), r["rule"], int(r["n"])].append((float(r["milliseconds"]), float(r["squared_error"])))
    families = len({r["family"] for r in rows})
    found: dict[tuple[int, str], list[tuple[float, float]]] = defaultdict(list)
    for (d, rule, _), points in sorted(by_n.items()):
        if len(points) == families:
            means = [math.exp(sum(math.log(max(x[i], LEAST)) for x in points) / families) for i in (0, 1)]
            found[d, rule].append((means[0], means[1]))
    return found


def draw() -> None:
    """A panel for each dimension."""
    found = curves()
    dimensions = sorted({d for d, _ in found})
    with house_style():
        columns = min(3, len(dimensions))
        rows = -(-len(dimensions) // columns)
        figure = new_figure(height=2.9 * rows + 0.7, width=9.6)
        panels = figure.subplots(rows, columns, squeeze=False, sharex=True).ravel()
        for axes, d in zip(panels, dimensions, strict=False):
            for rule, (colour, line, width) in STYLES.items():
                if points := found.get((d, rule)):
                    axes.plot(*zip(*points, strict=True), color=colour, linestyle=line, linewidth=width, label=rule)
            axes.set(xscale="log", yscale="log", title=f"d = {d}")
            axes.grid(True)
        for axes in panels[len(dimensions) :]:
            axes.set_axis_off()
        for axes in panels[len(dimensions) - columns :]:
            axes.set_xlabel("processor time, ms")
        for axes in panels[::columns]:
            axes.set_ylabel("squared relative error")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
        figure.savefig(FIGURE)


if __name__ == "__main__":
    draw()
