"""Two-dimensional sample sets and the cells of their samples."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import TwoSlopeNorm

from ..designs.sampling import SampleSet, sample
from ..geometry.cells import cells
from ..results.style import INK, house_style, new_figure
from .drawing import Drawing

SAMPLES = 100
_HEAVIEST = 3.0  # end of the colour scale, in units of 1/N


def draw_cells(rng: np.random.Generator) -> Drawing:
    """100 uniform and 100 stratified samples with their Voronoi cells, coloured by weight."""
    sets = [sample(design, SAMPLES, 2, rng=rng) for design in ("uniform", "stratified")]
    with house_style():
        figure = new_figure(4.4)
        axes = figure.subplots(1, 2)
        for ax, s in zip(axes, sets, strict=True):
            collection = _draw_set(ax, s)
        bar = figure.colorbar(
            collection, ax=list(axes), location="bottom", extend="max", shrink=0.6, aspect=40, pad=0.02
        )
        bar.set_ticks([0, 0.5, 1, 2, 3], labels=["0", "½", "1 = fair share", "2", "3"])
        bar.set_label("weight of a sample, N × area of its cell")
        bar.outline.set_visible(False)
    rows = [
        {"design": s.design, "x": float(x), "y": float(y), "weight": float(w)}
        for s in sets
        for (x, y), w in zip(s.points, cells(s.points).measures, strict=True)
    ]
    return Drawing(
        figure,
        rows,
        f"{SAMPLES} samples and their Voronoi cells. A sample in a crowd stands for little (violet), a lonely one for "
        "much (orange). Stratified samples are spread more evenly, so their weights vary less.",
        f"Two unit squares with {SAMPLES} points each and the Voronoi cells around them, coloured from violet for "
        "small to orange for large cells; uniform samples on the left vary far more than stratified ones on the right.",
    )


def _draw_set(ax: Axes, s: SampleSet) -> PolyCollection:
    voronoi = cells(s.points)
    shares = s.n * voronoi.measures
    collection = PolyCollection(voronoi.polygons(), edgecolor="white", linewidth=0.8, cmap="PuOr_r")
    collection.set_norm(TwoSlopeNorm(1.0, 0.0, _HEAVIEST))
    collection.set_array(shares)
    ax.add_collection(collection)
    ax.plot(*s.points.T, ".", color=INK, markersize=3)
    ax.set(xlim=(0, 1), ylim=(0, 1), xticks=[], yticks=[], aspect="equal")
    ax.spines[:].set_visible(False)
    ax.set_title(f"{s.design.capitalize()}: weights {shares.min():.2f} to {shares.max():.2f}")
    return collection
