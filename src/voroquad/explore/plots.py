"""Errors of two rules over many sets: histograms side by side, and MSE against N."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, DataRange1d, FixedTicker, Range1d, Span
from bokeh.plotting import figure

from ..study.convergence import Measurement, fit_slope, powers_of_two
from .experiment import LARGEST_N, Replicates
from .style import MUTED, RULE_COLORS, new_plot

_BINS = 61


class Histograms:
    """The errors of both rules, one panel each on a common scale of errors."""

    def __init__(self) -> None:
        self._range = Range1d(-1, 1)
        self._sources = [ColumnDataSource({"left": [], "right": [], "count": []}) for _ in RULE_COLORS]
        self._means = [Span(location=0, dimension="height", line_color=color, line_width=2) for color in RULE_COLORS]
        self.figures = [self._panel(k) for k in range(len(RULE_COLORS))]

    def _panel(self, k: int) -> figure:
        ranges = {"x_range": self._range, "y_range": DataRange1d(start=0)}
        plot = new_plot(f"histogram-{'ab'[k]}", height=240, min_border=24, y_axis_location=None, **ranges)
        plot.quad(
            left="left", right="right", bottom=0, top="count", source=self._sources[k],
            fill_color=RULE_COLORS[k], fill_alpha=0.55, line_color=None,
        )  # fmt: skip
        plot.add_layout(Span(location=0, dimension="height", line_color=MUTED, line_dash="dashed", line_width=2))
        plot.add_layout(self._means[k])
        plot.xaxis.axis_label = "estimate − truth"
        return plot

    def show(self, replicates: Sequence[Replicates]) -> None:
        """Draw the errors of the replicates."""
        errors = [e[np.isfinite(e)] for e in (r.errors for r in replicates)]
        widest = max((3.5 * math.sqrt((e**2).mean()) for e in errors if len(e)), default=0.0) or 1e-15
        if not 0.7 < widest / self._range.end < 1.3:  # a steady scale is easier to watch
            self._range.update(start=-widest, end=widest)
        edges = np.linspace(-self._range.end, self._range.end, _BINS + 1)
        for source, mean, e in zip(self._sources, self._means, errors, strict=True):
            counts = np.histogram(e, edges)[0]
            source.data = {"left": edges[:-1], "right": edges[1:], "count": counts}
            mean.location = float(e.mean()) if len(e) else 0.0


class ConvergencePlot:
    """Mean squared error against N, with standard errors, and the slopes of the lines."""

    def __init__(self) -> None:
        sizes = powers_of_two(LARGEST_N)
        self.figure = new_plot(
            "convergence", height=300, x_axis_type="log", y_axis_type="log",
            x_range=Range1d(sizes[0] / 1.3, sizes[-1] * 1.3), y_range=Range1d(1e-6, 1),
        )  # fmt: skip
        self.figure.xaxis.ticker = FixedTicker(ticks=sizes)
        self.figure.xaxis.axis_label = "N"
        self.figure.grid.visible = True
        self._n = Span(location=sizes[0], dimension="height", line_color=MUTED, line_dash="dashed")
        self.figure.add_layout(self._n)
        self._sources = [ColumnDataSource({"n": [], "mse": [], "low": [], "high": []}) for _ in RULE_COLORS]
        for source, color, marker in zip(self._sources, RULE_COLORS, ("circle", "square"), strict=True):
            self.figure.segment(x0="n", y0="low", x1="n", y1="high", source=source, line_color=color, line_width=1.5)
            self.figure.line("n", "mse", source=source, line_color=color, line_width=2.5)
            self.figure.scatter("n", "mse", source=source, size=7, marker=marker, color=color)

    def show(self, rows: Sequence[Sequence[Replicates]], n: int) -> list[float | None]:
        """Draw each method's MSE so far; the slopes, None where three sizes are not known yet."""
        self._n.location = n
        measured = [[m for r in row if (m := r.measured()) is not None and 0 < m.mse < math.inf] for row in rows]
        everything = [m.mse for row in measured for m in row]
        if everything:
            self.figure.y_range.update(start=min(everything) / 3, end=max(everything) * 3)
        for source, row in zip(self._sources, measured, strict=True):
            source.data = _columns(row)
        return [fit_slope(row).value if len(row) >= 3 else None for row in measured]


def _columns(row: Sequence[Measurement]) -> dict[str, Any]:
    mse = np.array([m.mse for m in row])
    error = np.array([m.mse_error for m in row])
    return {"n": [m.n for m in row], "mse": mse, "low": np.maximum(mse - error, mse / 10), "high": mse + error}
