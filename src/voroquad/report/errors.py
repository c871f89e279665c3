"""Errors of renderings: methods by samples per pixel, with the spp another method needs for an equal error."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from ..results.equal_error import Samples, equal_error_ratio
from ..results.power_law import fit_power_law
from .csv_files import read_csv
from .numbers import ratio

#: A number of samples per pixel beyond this is a mistake, not a rendering
_MOST_SPP = 10**12


@dataclass(frozen=True)
class RenderingErrors:
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
    cells: dict[tuple[str, int], RenderingErrors]

    def lowest(self, spp: int) -> float:
        """The smallest MSE at an spp; NaN where none is a number."""
        return min((cell.mse for cell in self.cells.values() if cell.spp == spp and cell.mse >= 0), default=math.nan)

    def slope(self, method: str) -> float | None:
        """Least-squares slope of log MSE against log spp; None for fewer than two spp with an error."""
        line = [(cell.spp, cell.mse) for cell in self.cells.values() if cell.method == method]
        law = fit_power_law(*zip(*line, strict=True))
        return None if law is None else law.slope


def read_errors(path: Path) -> Errors:
    """Read a CSV file with the columns method, spp, mse, flip and seconds; ValueError if it is none such.

    An error is NaN where a pixel is, and never negative.
    """
    records = read_csv(path).records
    try:
        rows = [(r["method"], int(r["spp"]), float(r["mse"]), float(r["flip"]), float(r["seconds"])) for r in records]
        for method, spp, mse, _, _ in rows:
            if not 1 <= spp <= _MOST_SPP or mse < 0:
                raise ValueError(f"{method!r} has spp = {spp} and mse = {mse}")
    except (KeyError, ValueError) as error:
        reason = f"no column {error}" if isinstance(error, KeyError) else str(error)[:200]
        raise ValueError(f"{path} is damaged ({reason}); make it again") from None
    curves: dict[str, list[tuple[float, float]]] = {}
    for method, spp, mse, _, _ in sorted(rows, key=lambda row: row[1]):
        curves.setdefault(method, []).append((spp, mse))
    methods = list(dict.fromkeys(row[0] for row in rows))
    cells = {
        (method, spp): RenderingErrors(
            method, spp, mse, flip, seconds, {b: equal_error_ratio(curves[b], spp, mse) for b in methods}
        )
        for method, spp, mse, flip, seconds in rows
    }
    return Errors(methods, sorted({spp for _, spp in cells}), cells)
