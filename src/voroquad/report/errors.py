"""Errors of renderings: methods by samples per pixel, with the spp another method needs for an equal error."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..results.equal_error import Samples, equal_error_ratio
from .numbers import ratio


@dataclass(frozen=True)
class Cell:
    """One rendering's errors.

    ``ratios`` tells per baseline how many times as many samples it needs for the same MSE.
    """

    method: str
    spp: int
    mse: float
    flip: float
    seconds: float
    ratios: dict[str, Samples]

    @property
    def shown_ratios(self) -> dict[str, list[str]]:
        """Per baseline the ratio to sort by and to read."""
        return {baseline: [f"{samples.n:g}", ratio(samples)] for baseline, samples in self.ratios.items()}


@dataclass(frozen=True)
class Errors:
    """The errors of all renderings of a comparison."""

    methods: list[str]
    spp: list[int]
    cells: dict[tuple[str, int], Cell]

    def lowest(self, spp: int) -> float:
        """The smallest MSE at an spp."""
        return min(cell.mse for cell in self.cells.values() if cell.spp == spp)

    def slope(self, method: str) -> float | None:
        """Least-squares slope of log MSE against log spp; None for fewer than two spp."""
        line = [cell for cell in self.cells.values() if cell.method == method and cell.mse > 0]
        if len(line) < 2:
            return None
        return float(np.polyfit(np.log([c.spp for c in line]), np.log([c.mse for c in line]), 1)[0])


def read_errors(path: Path) -> Errors:
    """Read a CSV file with the columns method, spp, mse, flip and seconds; ValueError if it is none such."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = [
                (r["method"], int(r["spp"]), float(r["mse"]), float(r["flip"]), float(r["seconds"]))
                for r in csv.DictReader(file)
            ]
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{path} is damaged ({error}); make it again") from None
    curves: dict[str, list[tuple[float, float]]] = {}
    for method, spp, mse, _, _ in sorted(rows, key=lambda row: row[1]):
        curves.setdefault(method, []).append((spp, mse))
    methods = list(dict.fromkeys(row[0] for row in rows))
    cells = {
        (method, spp): Cell(
            method, spp, mse, flip, seconds, {b: equal_error_ratio(curves[b], spp, mse) for b in methods}
        )
        for method, spp, mse, flip, seconds in rows
    }
    return Errors(methods, sorted({spp for _, spp in cells}), cells)
