"""Puts what `make figures` measured into the documentation: pictures into docs/figures, numbers into README.md.

    python scripts/publish_figures.py build/figures

The folder holds `study` (voroquad study) and `compare` (voroquad compare depth-of-field). The tables of README.md stand
between `<!-- table: NAME -->` and `<!-- end -->` and are replaced whole, so that each number there comes from a file.
"""

from __future__ import annotations

import csv
import re
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.image import imread

ROOT = Path(__file__).parents[1]
FIGURES = ROOT / "docs" / "figures"


def main() -> None:
    """Publish the folder named on the command line."""
    source = Path(sys.argv[1])
    FIGURES.mkdir(parents=True, exist_ok=True)
    for name in ("bias-function.svg", "bins.svg", "cells.svg", "mse-smooth.svg", "mse-talk.svg", "three-samples.svg"):
        shutil.copy(source / "study" / name, FIGURES / name)
    shutil.copy(source / "compare" / "mse.svg", FIGURES / "depth-of-field-mse.svg")
    draw_teaser(source / "compare", FIGURES / "depth-of-field.png")

    readme = ROOT / "README.md"
    text = readme.read_text(encoding="utf-8")
    for name, table in TABLES.items():
        text = replace_table(text, name, table(source))
    readme.write_text(text, encoding="utf-8")


def draw_teaser(compare: Path, target: Path) -> None:
    """The reference and one close-up as four methods render it."""
    mse = {(row["method"], int(row["spp"])): float(row["mse"]) for row in read(compare / "errors.csv")}
    panels = {
        "uniform": "uniform",
        "uniform + w": "uniform-w",
        "stratified": "stratified",
        "stratified + w": "stratified-w",
    }
    figure = plt.figure(figsize=(10, 4.35), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(1.22, 1))
    axes = left.subplots()
    axes.imshow(imread(compare / "images" / "reference.png"))
    axes.set_title("Reference", loc="left", fontsize=10)
    for axes_, (label, stem) in zip(right.subplots(2, 2).flat, panels.items(), strict=True):
        axes_.imshow(imread(compare / "closeups" / f"{stem}-1.png"))
        ratio = mse["uniform", spp_shown(compare)] / mse[label, spp_shown(compare)]
        note = "" if ratio == 1 else f": MSE ÷ {ratio:.1f}"
        axes_.set_title(f"{label}{note}", loc="left", fontsize=10)
        axes_.set_axis_off()
    axes.set_axis_off()
    figure.savefig(target, dpi=150)
    plt.close(figure)


def spp_shown(compare: Path) -> int:
    """The samples per pixel of the close-ups: the middle of those compared."""
    spp = sorted({int(row["spp"]) for row in read(compare / "errors.csv")})
    return spp[len(spp) // 2]


def depth_of_field_table(source: Path) -> str:
    """MSE of each method against samples per pixel."""
    rows = read(source / "compare" / "errors.csv")
    spp = sorted({int(row["spp"]) for row in rows})
    lines = ["| method | " + " | ".join(f"{n} spp" for n in spp) + " |", "| --- |" + " ---: |" * len(spp)]
    for method in dict.fromkeys(row["method"] for row in rows):
        cells = [next(r for r in rows if r["method"] == method and int(r["spp"]) == n)["mse"] for n in spp]
        lines.append(f"| {method} | " + " | ".join(scientific(float(c)) for c in cells) + " |")
    return "\n".join(lines)


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


TABLES: dict[str, Callable[[Path], str]] = {"depth-of-field": depth_of_field_table, "rules": rules_table}


def replace_table(text: str, name: str, table: str) -> str:
    """Put a table between its markers."""
    pattern = re.compile(rf"(<!-- table: {re.escape(name)} -->\n).*?(<!-- end -->)", re.DOTALL)
    text, count = pattern.subn(lambda match: f"{match[1]}{table}\n{match[2]}", text)
    if count != 1:
        raise ValueError(f"README.md must hold the markers of table {name!r} once, found {count}")
    return text


def scientific(value: float) -> str:
    """A number to two digits, as 1.2·10⁻⁵."""
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa}·10" + str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def read(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV file."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


if __name__ == "__main__":
    main()
