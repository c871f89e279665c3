"""Log–log plots to touch, from a figure's numbers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .._support.arrays import Array
from .._support.extras import install_hint
from .._support.numbers import superscript
from ..results.manifest import Figure, Line, Plot
from ..results.power_law import fit_power_law
from .csv_files import read_csv
from .embed import embedded

try:
    from bokeh.models import (
        BoxZoomTool,
        ColumnDataSource,
        FixedTicker,
        GlyphRenderer,
        HoverTool,
        PanTool,
        Range1d,
        ResetTool,
        SaveTool,
        TeeHead,
        WheelZoomTool,
        Whisker,
    )
    from bokeh.palettes import Colorblind8
    from bokeh.plotting import figure
except ImportError as error:
    raise ImportError(f"reports need Bokeh; {install_hint('study')}") from error

#: Up to so many different abscissae, each has its tick
MOST_TICKS = 10
#: Over fewer decades, powers of ten alone are too few ticks
FEW_DECADES = 3
HEIGHT = 380

_DASHES: dict[str, str | list[int]] = {"solid": "solid", "dashed": [7, 4], "dotted": [2, 3]}
_MARKERS = {"none": ("circle", 0), "circle": ("circle", 7), "open circle": ("circle", 9), "diamond": ("diamond", 10)}

#: What is drawn lies between these: far beyond any measurement, and no arithmetic on it overflows
_SMALLEST, _LARGEST = 1e-150, 1e150


@dataclass(frozen=True)
class PowerLawFit:
    """A power law through some points of a line."""

    slope: float
    x: Array  # of those points
    y: Array  # of the power law there


@dataclass(frozen=True)
class Curve:
    """The points of a line, by x; coordinates are positive."""

    x: Array
    y: Array
    error: Array  # standard errors of y, or zeros
    fit: PowerLawFit | None


def fit_from(x: Array, y: Array, start: float) -> PowerLawFit | None:
    """The power law through the points with x ≥ start, or through the last three points if those are fewer.

    None for less than two different x.
    """
    fitted = x >= start if (x >= start).sum() >= 3 else np.arange(len(x)) >= len(x) - 3
    law = fit_power_law(x[fitted], y[fitted])
    return None if law is None else PowerLawFit(law.slope, x[fitted], law(x[fitted]))


@dataclass(frozen=True)
class LegendEntry:
    """A line's entry in the legend."""

    name: str
    line: Line
    slopes: list[float | None]  # of each plot that has slopes


@dataclass(frozen=True)
class Plots:
    """The plots of one figure and the legend that they share."""

    series: list[LegendEntry]
    fitted: list[Plot]  # those with slopes
    models: list[figure]

    def data(self, prefix: str) -> dict[str, Any]:
        """What the script needs to show them in the elements PREFIX1, PREFIX2, …"""
        return embedded({f"{prefix}{k}": model for k, model in enumerate(self.models, 1)})


def make_plots(spec: Figure, path: Path) -> Plots:
    """The plots of a figure from its numbers; ValueError if those lack a column or hold other things."""
    records = read_csv(path).records
    if not records:
        raise ValueError(f"{path} holds no rows to plot; make it again")
    try:
        names = list(dict.fromkeys(row[spec.series] for row in records))
        curves = [{name: _curve(records, plot, spec.series, name) for name in names} for plot in spec.plots]
    except KeyError as error:
        raise ValueError(f"{path} does not hold what the figure plots (no column {error}); make it again") from None
    except ValueError as error:
        raise ValueError(f"{path} does not hold what the figure plots ({str(error)[:200]}); make it again") from None
    lines = [spec.lines.get(name) or Line(Colorblind8[k % 8], marker="circle") for k, name in enumerate(names)]
    fitted = [k for k, plot in enumerate(spec.plots) if plot.slope_from is not None]
    series = [
        LegendEntry(name, line, [fit.slope if (fit := curves[k][name].fit) else None for k in fitted])
        for name, line in zip(names, lines, strict=True)
    ]
    models = [_log_log(plot, own, lines) for plot, own in zip(spec.plots, curves, strict=True)]
    return Plots(series, [spec.plots[k] for k in fitted], models)


def _curve(rows: list[dict[str, str]], plot: Plot, series: str, name: str) -> Curve:
    """What the rows of a series say, without what a logarithm cannot show; y by its absolute value."""
    points = [
        (float(row[plot.x]), abs(float(row[plot.y])), float(row[plot.error] or 0) if plot.error else 0.0)
        for row in rows
        if row[series] == name and row[plot.y] and all(row[column] == value for column, value in plot.where.items())
    ]
    shown = sorted((x, y, e) for x, y, e in points if all(_SMALLEST < value < _LARGEST for value in (x, y)))
    x, y, error = np.array(shown).reshape(-1, 3).T
    error = np.where(error < _LARGEST, error, 0)  # one that is not known has no bar
    return Curve(x, y, error, None if plot.slope_from is None else fit_from(x, y, plot.slope_from))


def _log_log(plot: Plot, curves: dict[str, Curve], lines: list[Line]) -> figure:
    """A plot whose renderers are named "line-K" and "fit-K" for the page's script, K the series' number."""
    x = np.concatenate([curve.x for curve in curves.values()])
    y = np.concatenate([curve.y for curve in curves.values()])
    wheel = WheelZoomTool(modifiers={"ctrl": True})
    drawn = figure(
        title=plot.y_label, x_axis_label=plot.x_label, x_axis_type="log", y_axis_type="log",
        x_range=_range(x, 1.12), y_range=_range(y, 1.5), height=HEIGHT, sizing_mode="stretch_width",
        tools=[PanTool(), BoxZoomTool(), wheel, ResetTool(), SaveTool()], active_scroll=wheel, active_drag=None,
        background_fill_color=None, border_fill_color=None, outline_line_color=None, toolbar_location="above",
    )  # fmt: skip
    drawn.toolbar.logo = None
    drawn.toolbar.autohide = True
    if len(ticks := np.unique(x)) <= MOST_TICKS:
        drawn.xaxis.ticker = FixedTicker(ticks=ticks.tolist())
        drawn.xaxis.major_label_overrides = {tick: f"{tick:g}" for tick in ticks}
    if len(y) and np.ptp(np.log10(y)) < FEW_DECADES:
        drawn.yaxis.ticker, drawn.yaxis.major_label_overrides = _one_two_five(y)
    dots = [
        _draw(drawn, k, name, curve, line)
        for k, ((name, curve), line) in enumerate(zip(curves.items(), lines, strict=True))
    ]
    tooltips = [("", "@name"), (plot.x_label, "@x_text"), (plot.y_label, "@y_text")]
    drawn.add_tools(HoverTool(renderers=dots, tooltips=tooltips))
    return drawn


def _draw(drawn: figure, number: int, name: str, curve: Curve, line: Line) -> GlyphRenderer:
    """Draw a line, its error bars, its points and, hidden, its fit; return the points."""
    tag = f"line-{number}"
    source = ColumnDataSource({
        "x": curve.x,
        "y": curve.y,
        "low": np.where(curve.error < curve.y, curve.y - curve.error, curve.y),  # a logarithm shows no bar to zero
        "high": curve.y + curve.error,
        "name": [name] * len(curve.x),
        "x_text": [f"{x:.4g}" for x in curve.x],
        "y_text": [f"{y:.3g}" + (f" ± {e:.1g}" if e > 0 else "") for y, e in zip(curve.y, curve.error, strict=True)],
    })  # fmt: skip
    alone = len(curve.x) == 1 and line.marker == "none"  # a point that no line goes through would not be seen
    marker, size = _MARKERS["circle" if alone else line.marker]
    drawn.line("x", "y", source=source, name=tag, color=line.color, line_width=2, line_dash=_DASHES[line.dash])
    if curve.error.any():
        whisker = Whisker(
            name=tag, source=source, base="x", lower="low", upper="high", line_color=line.color, line_alpha=0.6,
            lower_head=TeeHead(size=6, line_color=line.color), upper_head=TeeHead(size=6, line_color=line.color),
        )  # fmt: skip
        drawn.add_layout(whisker)
    if curve.fit is not None:
        ends = ([curve.fit.x[0], curve.fit.x[-1]], [curve.fit.y[0], curve.fit.y[-1]])
        drawn.line(*ends, name=f"fit-{number}", color=line.color, line_width=7, line_alpha=0.3, visible=False)
    fill = {"fill_color": None} if line.marker == "open circle" else {"fill_color": line.color}
    return drawn.scatter(
        "x", "y", source=source, name=tag, marker=marker, size=size or 8, line_color=line.color, line_width=1.5,
        **fill, alpha=1.0 if size else 0.0, tags=[] if size else ["invisible"],
    )  # fmt: skip


def _one_two_five(values: Array) -> tuple[FixedTicker, dict[float, str]]:
    """Ticks at 1, 2 and 5 times powers of ten, as far as one zooms out, and their labels."""
    decades = range(int(np.floor(np.log10(values.min()))) - 1, int(np.ceil(np.log10(values.max()))) + 2)
    labels = {float(f"{m}e{k}"): f"{m}·10{superscript(k)}" for k in decades for m in (1, 2, 5)}
    return FixedTicker(ticks=list(labels)), labels


def _range(values: Array, margin: float) -> Range1d:
    """A logarithmic axis around the values."""
    low, high = (values.min(), values.max()) if len(values) else (1, 10)
    return Range1d(start=low / margin, end=high * margin)
