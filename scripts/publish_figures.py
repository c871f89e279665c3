"""Puts what `make figures` measured into the documentation: pictures into docs/figures, numbers into its tables.

    python scripts/publish_figures.py build/figures

The folder holds `study` (voroquad study), `compare` (voroquad compare depth-of-field) and `mri`
(examples/mri_density.py), or some of these: what comes from the others stays as it is. The tables stand between
`<!-- table: NAME -->` and `<!-- end -->` and are replaced whole, so that each number there comes from a file.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.image import imread
from tables.text import FIGURES, ROOT, read, replace_table, scientific

from voroquad.results.style import house_style, new_figure

COPIES = {
    **{f"{name}.svg": f"study/{name}.svg" for name in ("bias-function", "bins", "mse-smooth", "mse-talk")},
    "bias-plane.png": "study/bias-plane.png",
    "cells.png": "study/cells.png",
    "depth-of-field-mse.svg": "compare/mse.svg",
    "depth-of-field-reference.png": "compare/images/reference.png",
    "depth-of-field-errors.csv": "compare/errors.csv",
    "mri-density.png": "mri/density.png",
    "mri-density.csv": "mri/density.csv",
}


def main() -> None:
    """Publish the folder named on the command line."""
    source = Path(sys.argv[1])
    FIGURES.mkdir(parents=True, exist_ok=True)
    there = {folder.name for folder in source.iterdir()}
    for name, file in COPIES.items():
        if Path(file).parts[0] in there:
            shutil.copy(source / file, FIGURES / name)
    if "compare" in there:
        draw_teaser(source / "compare", FIGURES / "depth-of-field.png")

    for (page, name), (folder, table) in TABLES.items():
        if folder in there:
            path = ROOT / page
            text = path.read_text(encoding="utf-8")
            path.write_text(replace_table(text, name, table(source)), encoding="utf-8")


def draw_teaser(compare: Path, target: Path) -> None:
    """The reference; a close-up and the errors of uniform lens samples, with equal weights and with ours."""
    spp = spp_shown(compare)
    mse = {row["method"]: float(row["mse"]) for row in read(compare / "errors.csv") if int(row["spp"]) == spp}
    panels = {
        f"uniform samples, {spp} spp": compare / "closeups" / "uniform-1.png",
        "the same, weighted": compare / "closeups" / "uniform-w-1.png",
        "error": compare / "differences" / f"uniform-{spp}.png",
        f"error, MSE ÷ {mse['uniform'] / mse['uniform + w']:.1f}": compare / "differences" / f"uniform-w-{spp}.png",
    }
    with house_style():
        figure = new_figure(height=4.05, width=9.6)
        left, right = figure.subfigures(1, 2, width_ratios=(1.2, 1))
        show(left.subplots(), "depth of field, reference", compare / "images" / "reference.png")
        for axes, (title, path) in zip(right.subplots(2, 2).flat, panels.items(), strict=True):
            show(axes, title, path)
        figure.savefig(target, dpi=150)


def show(axes: Axes, title: str, path: Path) -> None:
    """An image under its title."""
    axes.imshow(imread(path))
    axes.set_title(title, fontsize=10, fontweight="normal")
    axes.set_axis_off()


def spp_shown(compare: Path) -> int:
    """The samples per pixel of the close-ups: the middle of those compared."""
    spp = sorted({int(row["spp"]) for row in read(compare / "errors.csv")})
    return spp[len(spp) // 2]


def rules_table(source: Path) -> str:
    """MSE and slope of the rules for single sets on a smooth function, d = 1."""
    n = 512
    rows = [r for r in read(source / "study" / "mse-smooth.csv") if int(r["n"]) == n]
    slopes = {r["method"]: r for r in read(source / "study" / "slopes-1d.csv") if r["integrand"] == "smooth"}
    lines = [f"| samples + weights | MSE at N = {n} | slope |", "| --- | ---: | ---: |"]
    for row in rows:
        slope = f"{float(slopes[row['method']]['slope']):.2f}".replace("-", "−")
        lines.append(f"| {row['method']} | {scientific(float(row['mse']))} | {slope} |")
    return "\n".join(lines)


#: By page and name, the folder that a table needs, and what makes it
TABLES: dict[tuple[str, str], tuple[str, Callable[[Path], str]]] = {
    ("docs/measured/rules.md", "rules"): ("study", rules_table),
}


if __name__ == "__main__":
    main()
