"""Coverage of intervals and their widths, by kind of integrand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from ..results.style import BLUE, INK, MUTED, VERMILION, house_style, new_figure
from .drawing import Drawing

Row = Mapping[str, Any]


def draw_coverage(d: int, rows: Sequence[Row], replicates: int) -> Drawing:
    """Both panels for one dimension at its largest size, from rows with the columns of ``coverage.csv``."""
    largest = max(row["n"] for row in rows)
    shown = [row for row in rows if row["n"] == largest]
    kinds = list(dict.fromkeys(row["kind"] for row in shown))
    with house_style():
        figure = new_figure(4.4)
        left, right = figure.subplots(1, 2, sharey=True)
        _draw(left, shown, kinds, "coverage")
        _draw(right, shown, kinds, "width_over_rms")
        left.axvline(0.95, color=INK, linewidth=1.2)
        left.set(xlabel="coverage of 95 % intervals", xlim=(-0.02, 1.02), title=f"d = {d}, {largest} evaluations")
        right.axvline(1.96, color=INK, linewidth=1.2)
        right.set(xscale="log", xlabel="half-width / rms error")
        left.set_yticks(range(len(kinds)), kinds)
        left.set_ylim(len(kinds) - 0.5, -0.5)
    return Drawing(
        figure,
        rows,
        f"Error bars of vq.quad, d = {d}: a dot for each integrand, {replicates} sets of each. Open dots: integrands "
        "that the bar was calibrated on. Lines: 95 %, and 1.96 standard errors.",
        "Dots by kind of integrand: the share of 95 % intervals that hold the integral, and half their width over the "
        f"root mean square error, in {d} dimensions with {largest} evaluations.",
        series="integrand",
    )


def _draw(ax: Axes, rows: Sequence[Row], kinds: Sequence[str], column: str) -> None:
    """A row per kind, a dot per integrand."""
    for calibrated, face, color in (("no", BLUE, BLUE), ("yes", "none", VERMILION)):
        some = [row for row in rows if row["calibrated"] == calibrated]
        places = np.array([kinds.index(row["kind"]) for row in some], dtype=float)
        places += 0.15 if calibrated == "yes" else -0.15
        ax.plot([row[column] for row in some], places, "o", markersize=4, markerfacecolor=face, markeredgecolor=color)
    ax.hlines(np.arange(len(kinds) - 1) + 0.5, 0, 1, transform=ax.get_yaxis_transform(), color=MUTED, linewidth=0.2)
    ax.yaxis.set_tick_params(length=0)
