"""MSE of vq.quad's peers over its own: by family, and against the number of evaluations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter, NullLocator

from ..results.manifest import Line, Plot
from ..results.style import (
    BLUE,
    GREEN,
    INK,
    MUTED,
    PURPLE,
    SKY,
    VERMILION,
    LineLabel,
    house_style,
    label_line_ends,
    new_figure,
)
from .drawing import Drawing
from .genz import FAMILIES

_COLORS = {"qmc_quad": BLUE, "cubature": MUTED, "vegas": GREEN, "qmcpy": PURPLE, "control": SKY, "cubic": VERMILION}
_MARKERS = "osD^v<>P"
_DASHES = ("solid", "dashed", "dotted")  # instead of the markers, in the report

Row = Mapping[str, Any]


def draw_ratios(d: int, rows: Sequence[Row], instances: int) -> Drawing:
    """Both figures for one dimension, from rows with the columns of ``genz-ratios.csv``."""
    peers = list(dict.fromkeys(row["peer"] for row in rows))
    sizes = sorted({row["n"] for row in rows})
    styles = _styles(peers)
    with house_style():
        figure = new_figure(4.4 if len(peers) < 8 else 5.4)
        left, right = figure.subplots(1, 2, width_ratios=[1.3, 1], sharey=False)
        _draw_families(left, [row for row in rows if row["n"] == sizes[-1]], styles)
        _draw_sizes(right, [row for row in rows if row["family"] == "all"], sizes, styles)
        left.set_title(f"d = {d}, {sizes[-1]} evaluations")
        right.set_title("All families")
        figure.draw_without_rendering()
        ends = [_last(rows, peer) for peer in peers]
        labels = [LineLabel(p, float(e["mse_ratio"]), styles[p]["color"]) for p, e in zip(peers, ends, strict=True)]
        label_line_ends(right, sizes[-1], labels, size=8)
    return Drawing(
        figure,
        rows,
        f"Mean squared error of other rules over that of vq.quad, d = {d}. Left: families of integrands, geometric "
        f"means over {instances} members with one standard error. Right: geometric mean over the families. Above the "
        "line vq.quad is better.",
        f"Two log plots of the mean squared error of {len(peers)} rules relative to vq.quad in {d} dimensions: by "
        f"family of integrands at {sizes[-1]} evaluations, and over all families against the number of evaluations.",
        plots=[Plot("n", "mse_ratio", "evaluations", "MSE of the peer / MSE of vq.quad", where={"family": "all"})],
        series="peer",
        lines={
            peer: Line(style["color"], _DASHES[_MARKERS.index(style["marker"]) % len(_DASHES)], "circle")
            for peer, style in styles.items()
        },
    )


def _styles(peers: Sequence[str]) -> dict[str, dict[str, Any]]:
    """One colour per library or paper, one marker per variant of it."""
    styles: dict[str, dict[str, Any]] = {}
    used: dict[str, int] = {}
    for peer in peers:
        color = next((c for name, c in _COLORS.items() if peer.startswith(name)), INK)
        styles[peer] = {"color": color, "marker": _MARKERS[used.get(color, 0) % len(_MARKERS)]}
        used[color] = used.get(color, 0) + 1
    return styles


def _last(rows: Sequence[Row], peer: str) -> Row:
    return max((row for row in rows if row["peer"] == peer and row["family"] == "all"), key=lambda row: int(row["n"]))


def _draw_families(ax: Axes, rows: Sequence[Row], styles: Mapping[str, dict[str, Any]]) -> None:
    """A row per family, a marker per peer."""
    peers = list(dict.fromkeys(row["peer"] for row in rows))
    for k, peer in enumerate(peers):
        own = [row for row in rows if row["peer"] == peer and row["family"] != "all"]
        ratio = np.array([float(row["mse_ratio"]) for row in own])
        factor = np.exp([float(row["log_error"]) for row in own])
        shift = 0.7 * ((k + 0.5) / len(peers) - 0.5)
        ax.errorbar(
            ratio,
            np.arange(len(own)) + shift,
            xerr=(ratio - ratio / factor, ratio * factor - ratio),
            linestyle="none",
            markersize=4,
            elinewidth=0.8,
            **styles[peer],
        )
    ax.axvline(1, color=INK, linewidth=1.2)
    ax.set(xscale="log", xlabel="MSE of the peer / MSE of vq.quad", ylim=(len(FAMILIES) - 0.5, -0.5))
    ax.set_yticks(range(len(FAMILIES)), list(FAMILIES))
    ax.yaxis.set_tick_params(length=0)
    ax.hlines(np.arange(len(FAMILIES) - 1) + 0.5, 0, 1, transform=ax.get_yaxis_transform(), color=MUTED, linewidth=0.2)
    ax.xaxis.set_minor_locator(NullLocator())


def _draw_sizes(ax: Axes, rows: Sequence[Row], sizes: Sequence[int], styles: Mapping[str, dict[str, Any]]) -> None:
    for peer, style in styles.items():
        line = sorted((row for row in rows if row["peer"] == peer), key=lambda row: int(row["n"]))
        ax.plot(
            [row["n"] for row in line],
            [float(row["mse_ratio"]) for row in line],
            linewidth=1.4,
            markersize=4,
            **style,
        )
    ax.axhline(1, color=INK, linewidth=1.2)
    ax.set(xscale="log", yscale="log", xlabel="evaluations", xlim=(sizes[0] * 0.85, sizes[-1] * 1.1))
    ax.set_xticks(sizes, [str(n) for n in sizes])
    ax.xaxis.set_minor_locator(NullLocator())
    ax.yaxis.set_minor_formatter(NullFormatter())
    ax.grid(True, axis="y")
