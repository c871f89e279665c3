"""The bias function in the plane: a boundary layer for uniform sets, and the strata's period for stratified ones."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.image import AxesImage

from ..results.style import BLUE, INK, VERMILION, house_style, new_figure
from ..rules.bias import bias_function
from .drawing import Drawing

N = 64
PIXELS = 256
CUT = 0.45  # the line x_2 = CUT
COLORS = {"uniform": BLUE, "stratified": VERMILION}
TITLES = {"uniform": "Uniform", "stratified": "Stratified, 8 × 8"}


def draw_bias_plane(rng: np.random.Generator) -> Drawing:
    """G of 64 uniform and of 8 × 8 stratified samples, as pictures and along a line; nothing is drawn at random."""
    x = (np.arange(1000) + 0.5) / 2000
    line = np.column_stack([x, np.full_like(x, CUT)])
    cuts = {design: bias_function(line, N, design) for design in COLORS}
    with house_style():
        figure = new_figure(2.9)
        left, middle, right = figure.subplots(1, 3, width_ratios=[1, 1, 1.15])
        images = [_draw_map(ax, design) for ax, design in ((left, "uniform"), (middle, "stratified"))]
        figure.colorbar(images[0], ax=[left, middle], ticks=[0.4, 0.7, 1, 1.3, 1.6], shrink=0.8, pad=0.02)
        for design, color in COLORS.items():
            right.plot(x, cuts[design], color=color, linewidth=1.4)
        right.axhline(1, color=INK, linewidth=0.6, linestyle=(0, (1, 3)))
        right.set(xlim=(0, 0.5), ylim=(0.55, 1.25), xticks=[0, 0.125, 0.25, 0.375, 0.5], yticks=[0.6, 0.8, 1, 1.2])
        right.set_xticklabels(["0", "⅛", "¼", "⅜", "½"])
        right.set_title(f"G along $x_2$ = {CUT}")
        right.text(0.03, 0.68, "uniform", color=BLUE)
        right.text(0.2, 1.07, "stratified", color=VERMILION)
    return Drawing(
        figure,
        [
            {"x_1": float(at), "x_2": CUT, "uniform": float(u), "stratified": float(s)}
            for at, u, s in zip(x, cuts["uniform"], cuts["stratified"], strict=True)
        ],
        f"The bias function in the plane, {N} samples. Uniform sets have a boundary layer, and 1 inside. With one "
        "sample per stratum G jumps between strata and has their period inside the box too: a sample in the corner of "
        "its stratum gets a smaller cell than one in the middle.",
        "Two maps of the bias function on the unit square, below one along the border and above one a little inside; "
        "the stratified one is a pattern of eight by eight tiles. Beside them both along a line.",
    )


def _draw_map(ax: Axes, design: str) -> AxesImage:
    c = (np.arange(PIXELS) + 0.5) / PIXELS
    points = np.stack(np.meshgrid(c, c), axis=-1).reshape(-1, 2)
    g = bias_function(points, N, design).reshape(PIXELS, PIXELS)
    ax.set(xticks=[0, 1], yticks=[0, 1])
    ax.set_title(TITLES[design])
    return ax.imshow(g, origin="lower", extent=(0, 1, 0, 1), cmap="RdBu_r", vmin=0.4, vmax=1.6)
