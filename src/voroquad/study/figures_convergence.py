"""MSE against N on one integrand, beside a picture of that integrand."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter, NullLocator

from ..results.manifest import Line, Plot
from ..results.style import BLUE, GREEN, INK, PURPLE, VERMILION, LineLabel, house_style, label_line_ends, new_figure
from .convergence import Measurement, Scheme, Slope, fit_slope
from .drawing import Drawing
from .integrand import KnownIntegrand

_COLORS = {"uniform": BLUE, "stratified": VERMILION, "sobol": GREEN, "halton": PURPLE}
_LINES: dict[str | None, dict[str, Any]] = {  # by weights: plain, Voronoi, its two corrections
    None: {"linestyle": (0, (4, 2))},
    "none": {"linestyle": "-", "marker": "o", "markersize": 6.5, "markerfacecolor": "white"},
    "bias-function": {"linestyle": ":", "marker": "D", "markersize": 4},
    "exchange": {"linestyle": "-", "marker": "o", "markersize": 3.5},
}
_LOOKS = {  # the same for plots in the report: dash and marker
    None: ("dashed", "none"),
    "none": ("solid", "open circle"),
    "bias-function": ("dotted", "diamond"),
    "exchange": ("solid", "circle"),
}
_NAMES = {
    None: "equal weights",
    "none": "Voronoi, biased",
    "bias-function": "Voronoi over g, unbiased",
    "exchange": "exchange, unbiased",
}


def draw_convergence(f: KnownIntegrand, measurements: Sequence[Measurement]) -> Drawing:
    """MSE of every method on one integrand, log–log, with the slope fitted to each line."""
    methods = list(dict.fromkeys(m.method for m in measurements))
    lines = {m: sorted((x for x in measurements if x.method == m), key=lambda x: x.n) for m in methods}
    slopes = {m: fit_slope(lines[m]) for m in methods}
    sizes = [x.n for x in lines[methods[0]]]
    first = slopes[methods[0]]
    with house_style():
        figure = new_figure(4.4)
        left, right = figure.subplots(1, 2, width_ratios=[1, 2.6])
        _draw_integrand(left, f)
        _draw_key(left, methods)
        for method, line in lines.items():
            _draw_line(right, method, line)
        ticks = sizes if len(sizes) < 6 else sizes[::3]
        right.set(xscale="log", yscale="log", xlabel="samples N", xlim=(sizes[0] * 0.85, sizes[-1] * 1.1))
        right.set_xticks(ticks, [str(n) for n in ticks])
        right.xaxis.set_minor_locator(NullLocator())
        right.yaxis.set_minor_formatter(NullFormatter())
        right.grid(True, axis="y")
        right.set_title("Mean squared error")
        right.set_title(f"slope, N = {first.n_from} … {first.n_to}", loc="right", fontsize=9, fontweight="normal")
        figure.draw_without_rendering()
        ends = [LineLabel(_label(m, slopes[m]), lines[m][-1].mse, _COLORS[m.design]) for m in methods]
        label_line_ends(right, sizes[-1], ends)
    counts = [x.replicates for x in lines[methods[0]]]
    rows = [_row(x) for m in methods for x in lines[m]]
    best = min(methods, key=lambda m: lines[m][-1].mse)
    return Drawing(
        figure,
        rows,
        f"{f.title}: {f.formula}. MSE over {counts[0]} independent sample sets at N = {sizes[0]} "
        f"down to {counts[-1]} at N = {sizes[-1]}; the number beside each name is the slope of its line, by least "
        f"squares on log MSE against log N from N = {first.n_from} to {first.n_to}. " + _talk_names(methods),
        f"Log–log plot of mean squared error against the number of samples for {len(methods)} methods on the "
        f"{f.title.lower()} integrand; at N = {sizes[-1]} the lowest is {best.name}.",
        plots=[
            Plot("n", "mse", "samples N", "mean squared error", error="mse_error", slope_from=first.n_from),
            Plot("n", "bias", "samples N", "|mean error|", error="bias_error"),
        ],
        lines={m.name: Line(_COLORS[m.design], *_LOOKS[m.debias]) for m in methods},
    )


def slope_rows(measurements: Sequence[Measurement]) -> list[dict[str, object]]:
    """The fitted slopes, one row per integrand and method."""
    rows = []
    integrands = dict.fromkeys(m.integrand for m in measurements)
    methods = dict.fromkeys(m.method for m in measurements)
    for integrand, method in itertools.product(integrands, methods):
        line = [m for m in measurements if (m.integrand, m.method) == (integrand, method)]
        slope = fit_slope(line)
        last = max(line, key=lambda m: m.n)
        rows.append({
            "integrand": integrand, "method": method.name, "slope": slope.value, "slope_error": slope.error,
            "n_from": slope.n_from, "n_to": slope.n_to, "mse_at_n_to": last.mse,
        })  # fmt: skip
    return rows


def _row(m: Measurement) -> dict[str, object]:
    return {
        "integrand": m.integrand, "method": m.method.name, "design": m.method.design, "order": m.method.order,
        "debias": m.method.debias or "equal weights", "n": m.n, "replicates": m.replicates,
        "mse": m.mse, "mse_error": m.mse_error, "bias": m.bias, "bias_error": m.bias_error,
    }  # fmt: skip


def _draw_line(ax: Axes, method: Scheme, line: Sequence[Measurement]) -> None:
    ax.plot(
        [m.n for m in line],
        [m.mse for m in line],
        color=_COLORS[method.design],
        linewidth=1.4,
        **_LINES[method.debias],
    )


def _draw_integrand(ax: Axes, f: KnownIntegrand) -> None:
    grid = np.linspace(0, 1, 801)
    if f.d == 1:
        values = f.values(grid[:, None])
        values[:-1][np.abs(np.diff(values)) > 0.1 * np.ptp(values)] = np.nan  # do not join a jump
        ax.plot(grid, values, color=INK, linewidth=1.3)
        ax.set(xlim=(0, 1), ylim=(min(0.0, ax.get_ylim()[0]), None), xticks=[0, 0.5, 1], xlabel="x")
        ax.set_box_aspect(1)
    else:
        points = np.stack(np.meshgrid(grid[::4], grid[::4], indexing="xy"), axis=-1)
        ax.imshow(f.values(points), origin="lower", extent=(0, 1, 0, 1), cmap="cividis")
        ax.set(xticks=[0, 1], yticks=[0, 1], xlabel="x", ylabel="y")
    ax.set_anchor("N")
    ax.set_title(f.title)


def _draw_key(ax: Axes, methods: Sequence[Scheme]) -> None:
    """What the lines' styles mean, below the picture of the integrand."""
    used = {m.debias for m in methods}
    handles = [
        Line2D([], [], color=INK, linewidth=1.4, label=_NAMES[debias], **style)
        for debias, style in _LINES.items()
        if debias in used
    ]
    ax.legend(handles=handles, loc="upper left", bbox_to_anchor=(-0.2, -0.32), frameon=False, fontsize=8.5)


def _talk_names(methods: Sequence[Scheme]) -> str:
    text = "Î_C: the talk's consistent estimator, Voronoi weights."
    if any(m.debias == "bias-function" for m in methods):
        text += " Î_GR: its unbiased one, Voronoi weights over g."
    return text


def _label(method: Scheme, slope: Slope) -> str:
    name = method.name.replace("Î_C", r"$\hat{I}_C$").replace("Î_GR", r"$\hat{I}_{GR}$")
    return f"{name}  {slope.value:.1f}".replace("-", "−")
