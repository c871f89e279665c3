"""Pictures of samples with their cells, of the integrand, and of the bias function."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.models import (
    BasicTicker,
    ColorBar,
    ColumnDataSource,
    FixedTicker,
    Line,
    LinearColorMapper,
    Range1d,
    Scatter,
    Span,
    Ticker,
)
from bokeh.plotting import figure
from scipy.spatial import KDTree

from .._support.arrays import Array
from ..geometry.cells import cells
from ..rules.bias import BIAS_DESIGNS, bias_function
from ..study.integrand import KnownIntegrand
from .edits import EditedSet
from .style import MUTED, diverging_mapper, new_plot

Corners = list[list[float]]

#: Abscissas of curves
_CURVE = np.linspace(0, 1, 1001)
#: Pixels along a side of images
_PIXELS = 160
#: Up to this many samples are drawn with outlines, which are visible on every colour; more are plain dots
_OUTLINED = 400
_OUTLINE = {"fill_color": "#16181b", "line_color": "#ffffff"}
_PLAIN = {"fill_color": MUTED, "line_color": None}
#: How far the mark of a sample may reach, in widths of the picture
_POINT = 0.03
#: Fraction of the cells that may be drawn over others before all are drawn again
_MOST_ABOVE = 1 / 8
#: End of the scale of weights, in units of 1/N, as in the figures of the study
_HEAVIEST = 3.0
_SHARES = [0, 0.5, 1, 2, 3]


class CellsInterval:
    """d = 1: samples as bars of their cell's width and the integrand's height, coloured by weight."""

    def __init__(self) -> None:
        self.figure = new_plot("interval", x_range=Range1d(0, 1), y_range=Range1d(0, 1), height=380)
        self._bars = ColumnDataSource({"left": [], "right": [], "f": [], "x": [], "share": []})
        self._curve = ColumnDataSource({"x": [], "f": []})
        mapper = diverging_mapper("interval-shares", 0, _HEAVIEST)
        self.figure.quad(
            left="left", right="right", bottom=0, top="f", source=self._bars,
            fill_color={"field": "share", "transform": mapper}, line_color=MUTED, line_width=0.6,
        )  # fmt: skip
        self.figure.line("x", "f", source=self._curve, line_color=MUTED, line_width=2)
        _points(self.figure, "x", "f", self._bars)
        _add_color_bar(
            self.figure,
            diverging_mapper("interval-scale", 0, _HEAVIEST),
            "weight of a sample, N w",
            FixedTicker(ticks=_SHARES),
        )
        self.figure.xaxis.axis_label = "x: drag a sample left or right"

    def show_integrand(self, integrand: KnownIntegrand) -> None:
        """Draw the curve."""
        f = _finite(integrand.values(_CURVE[:, None]))
        self._curve.data = {"x": _CURVE, "f": f}
        low, high = min(0.0, f.min()), max(0.0, f.max())
        margin = 0.06 * ((high - low) or 1.0)
        self.figure.y_range.update(start=low - (low < 0) * margin, end=high + margin)

    def show(self, edited: EditedSet, f: Array, shares: Array) -> None:
        """Draw the samples with values f (n,) and weights over 1/N, (n,)."""
        left, right = cells(edited.points).intervals().T
        self._bars.data = {"left": left, "right": right, "f": f, "x": edited.points[:, 0].copy(), "share": shares}
        _set_detail(self.figure, len(edited))


class CellsSquare:
    """d = 2: samples in their Voronoi cells, coloured by weight.

    Bokeh paints the level "overlay" on a canvas of its own. Cells that differ from those below are drawn there, over
    them; together they fill the same area. A drag among a thousand samples therefore paints about ten cells, not all.
    """

    def __init__(self) -> None:
        self.figure = new_plot("square", x_range=Range1d(0, 1), y_range=Range1d(0, 1), aspect_ratio=0.93)
        mapper = diverging_mapper("square-shares", 0, _HEAVIEST)
        self._below = self._layer("glyph", mapper)
        # A separate mapper: a change of the other would lay out its colour bar and the whole plot again
        self._above = self._layer("overlay", diverging_mapper("square-shares-above", 0, _HEAVIEST))
        _add_color_bar(self.figure, mapper, "weight of a sample, N w", FixedTicker(ticks=_SHARES))

    def _layer(self, level: str, mapper: LinearColorMapper) -> ColumnDataSource:
        """Cells and points of a level, by the samples' numbers."""
        source = ColumnDataSource({"sample": [], "xs": [], "ys": [], "x": [], "y": [], "share": []})
        self.figure.patches(
            "xs", "ys", source=source, level=level, line_color=MUTED, line_width=0.6,
            fill_color={"field": "share", "transform": mapper},
        )  # fmt: skip
        _points(self.figure, "x", "y", source, level=level)
        return source

    def show(self, edited: EditedSet, f: Array, shares: Array) -> None:
        """Draw the samples with weights over 1/N, (n,)."""
        n, points = len(edited), edited.points
        xs, ys = _corners(cells(points).polygons())
        changed = self._changed(xs, ys, points, shares)
        if len(changed) > _MOST_ABOVE * n:
            self._below.data = _rows(range(n), xs, ys, points, shares)
            _set_detail(self.figure, n)
            changed = []
        # The marks of samples may reach into other cells: those that could are drawn again, without their cells
        overlaid = _within(points, points[changed], _POINT)
        above = set(changed)
        xs, ys = ([corners[k] if k in above else [] for k in overlaid] for corners in (xs, ys))
        self._above.data = _rows(overlaid, xs, ys, points[overlaid], shares[overlaid])

    def _changed(self, xs: Corners, ys: Corners, points: Array, shares: Array) -> list[int]:
        """Numbers of the samples that are not drawn below as they are; all if there are more or fewer."""
        below = self._below.data
        if len(below["sample"]) != len(points):
            return list(range(len(points)))
        now = np.column_stack([points, shares])
        same = (np.column_stack([below["x"], below["y"], below["share"]]) == now).all(axis=1)
        corners = zip(xs, ys, below["xs"], below["ys"], strict=True)
        return [k for k, (x, y, old_x, old_y) in enumerate(corners) if not same[k] or x != old_x or y != old_y]


class IntegrandSquare:
    """d = 2: the integrand as an image."""

    def __init__(self) -> None:
        self.figure = new_plot("integrand", x_range=Range1d(0, 1), y_range=Range1d(0, 1), aspect_ratio=0.93)
        self._image = ColumnDataSource({"image": []})
        self._mapper = LinearColorMapper(palette="Cividis256")
        self.figure.image("image", source=self._image, x=0, y=0, dw=1, dh=1, color_mapper=self._mapper)
        self.figure.add_layout(
            ColorBar(color_mapper=self._mapper, title="f(x, y)", ticker=BasicTicker(desired_num_ticks=4), **_BAR),
            "below",
        )

    def show_integrand(self, integrand: KnownIntegrand) -> None:
        """Draw the image."""
        f = _finite(integrand.values(_pixel_centres()))
        self._image.data = {"image": [f]}
        self._mapper.update(low=float(f.min()), high=float(max(f.max(), f.min() + 1e-12)))


class BiasInterval:
    """d = 1: the bias function of Voronoi weights."""

    def __init__(self) -> None:
        self.figure = new_plot("bias-interval", x_range=Range1d(0, 1), y_range=Range1d(0.4, 1.4), height=380)
        self._curve = ColumnDataSource({"x": [], "g": []})
        self.figure.add_layout(Span(location=1, dimension="width", line_color=MUTED, line_dash="dashed"))
        self.figure.line("x", "g", source=self._curve, line_width=2.5, line_color="#8e5bb5")
        self.figure.xaxis.axis_label = "x"

    def show(self, design: str, n: int) -> str:
        """Draw G of n samples and describe it in one line."""
        if design not in BIAS_DESIGNS:
            self._curve.data = {"x": [], "g": []}
            return _no_formula(design)
        self._curve.data = {"x": _CURVE, "g": bias_function(_CURVE, n, design)}
        return _what_it_says(n)


class BiasSquare:
    """d = 2: the bias function of Voronoi weights as an image."""

    def __init__(self) -> None:
        self.figure = new_plot("bias-square", x_range=Range1d(0, 1), y_range=Range1d(0, 1), aspect_ratio=0.93)
        self._image = ColumnDataSource({"image": []})
        mapper = diverging_mapper("bias", 0.25, 1.75)
        self.figure.image("image", source=self._image, x=0, y=0, dw=1, dh=1, color_mapper=mapper)
        _add_color_bar(self.figure, mapper, "G(x, y)", FixedTicker(ticks=[0.25, 0.5, 0.75, 1, 1.25, 1.5, 1.75]))

    def show(self, design: str, n: int) -> str:
        """Draw G of n samples and describe it in one line."""
        if design not in BIAS_DESIGNS:
            self._image.data = {"image": []}
            return _no_formula(design)
        g = bias_function(_pixel_centres().reshape(-1, 2), n, design).reshape(_PIXELS, _PIXELS)
        self._image.data = {"image": [g]}
        return _what_it_says(n)


def _no_formula(design: str) -> str:
    return f"G is known for uniform and stratified samples, not for {design} sets."


def _what_it_says(n: int) -> str:
    return (
        f"Voronoi weights of {n} sample{'s' * (n > 1)} integrate G·f in place of f on average: "
        "G < 1 counts too little, G > 1 too much. Unbiased rules make it 1 everywhere."
    )


# ---------------------------------------------------------------------- parts

_BAR: dict[str, Any] = {
    "background_fill_color": None, "bar_line_color": None, "major_tick_line_color": None, "height": 10,
    "title_text_font_style": "normal", "title_text_font_size": "12px", "major_label_text_font_size": "11px",
    "title_text_color": MUTED, "major_label_text_color": MUTED, "title_standoff": 6, "label_standoff": 4, "padding": 4,
}  # fmt: skip


def _points(plot: figure, x: str, y: str, source: ColumnDataSource, level: str = "glyph") -> Any:
    return plot.scatter(x, y, source=source, level=level, size=8, line_width=1.2, **_OUTLINE)


def _set_detail(plot: figure, n: int) -> None:
    """Outlines of n cells and points if there is room for them."""
    few = n <= _OUTLINED
    for glyph in (renderer.glyph for renderer in plot.renderers):
        if isinstance(glyph, Scatter):
            glyph.update(size=float(np.clip(60 / np.sqrt(n), 3.5, 9)), **(_OUTLINE if few else _PLAIN))
        elif not isinstance(glyph, Line):
            glyph.line_color = MUTED if few else None


def _add_color_bar(plot: figure, mapper: LinearColorMapper, title: str, ticker: Ticker) -> None:
    plot.add_layout(ColorBar(color_mapper=mapper, title=title, ticker=ticker, **_BAR), "below")


def _rows(samples: Sequence[int], xs: Corners, ys: Corners, points: Array, shares: Array) -> dict[str, Any]:
    x, y = points.T.tolist()  # lists travel in one message, arrays in two more each
    return {"sample": list(samples), "xs": xs, "ys": ys, "x": x, "y": y, "share": shares.tolist()}


def _within(points: Array, others: Array, distance: float) -> list[int]:
    """Numbers of the points (n, 2) no farther than that from any of the others (m, 2)."""
    if len(others) == 0:
        return []
    return np.flatnonzero(KDTree(others).query(points)[0] <= distance).tolist()


def _corners(polygons: Sequence[Array]) -> tuple[Corners, Corners]:
    """Abscissas and ordinates of each polygon's corners."""
    x, y = np.concatenate(polygons).T.tolist()
    ends = np.cumsum([len(polygon) for polygon in polygons]).tolist()
    starts = [0, *ends[:-1]]
    return (
        [x[start:end] for start, end in zip(starts, ends, strict=True)],
        [y[start:end] for start, end in zip(starts, ends, strict=True)],
    )


def _pixel_centres() -> Array:
    """Centres (rows, columns, 2) of the pixels of an image of the unit square."""
    t = (np.arange(_PIXELS) + 0.5) / _PIXELS
    return np.stack(np.meshgrid(t, t), axis=-1)


def _finite(f: Array) -> Array:
    """Values without poles at the border, where no sample falls."""
    return np.where(np.isfinite(f), f, np.nan_to_num(np.nanmean(f[np.isfinite(f)])))
