"""Pictures of sample sets, with Matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .._support.arrays import Array
from .._support.figures import axes_for

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: From this number of strata along an axis on, their borders hide the points
MOST_LINES = 64


def draw(points: Array, strata: tuple[int, ...] | None, weights: Array | None, ax: Axes | None, cmap: Any) -> Axes:
    """Draw one set of points (n, d), its strata and weights (n,); see :meth:`SampleSet.plot`."""
    n, d = points.shape
    ax = axes_for(ax, d)
    if d == 1:
        _draw_line(points[:, 0], weights, ax)
    else:
        share = {} if weights is None else {"c": n * weights, "cmap": cmap}
        scatter: Any = ax.scatter  # which takes a third coordinate in three dimensions
        dots = scatter(*points.T, s=np.clip(4000 / n, 4, 40), **share)
        if weights is not None:
            ax.figure.colorbar(dots, ax=ax, label="weight times n", shrink=0.8)
        ax.set_aspect("equal")
    ax.set(**{f"{axis}lim": (0, 1) for axis in "xyz"[:d]})
    if strata is not None and d < 3:
        _draw_strata(strata, ax)
    return ax


def _draw_line(x: Array, weights: Array | None, ax: Axes) -> None:
    if weights is None:
        ax.plot(x, np.zeros(len(x)), "|", markersize=12)
        ax.set(yticks=[])
    else:
        ax.vlines(x, 0, len(x) * weights)
        ax.axhline(1, linewidth=0.5, color="grey")
        ax.set(ylabel="weight times n")


def _draw_strata(strata: tuple[int, ...], ax: Axes) -> None:
    if max(strata) > MOST_LINES:
        return
    style = {"color": "grey", "linewidth": 0.5, "alpha": 0.5}
    for k, line in zip(strata, (ax.axvline, ax.axhline), strict=False):
        for place in np.arange(1, k) / k:
            line(place, **style)
