"""One-dimensional integration with 20 samples: the bin that each sample represents (the talk's four pictures)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.patches import Rectangle

from .._support.arrays import Array
from ..designs.sampling import sample
from ..geometry.cells import cells
from ..results.style import BLUE, FAINT, INK, MUTED, VERMILION, house_style, new_figure
from ..rules.registry import weights
from .drawing import Drawing
from .functions import INTEGRANDS
from .integrand import KnownIntegrand

SAMPLES = 20
REPETITIONS = 10_000


@dataclass(frozen=True)
class Binning:
    """Sample positions and the intervals that they represent, each a rectangle of height f."""

    title: str
    x: Array  # (n,)
    low: Array  # (n,) ends of the bins
    high: Array
    rms: float | None  # root mean squared error over many sets; None where the set is always the same

    def estimate(self, f: KnownIntegrand) -> float:
        """Total area of the rectangles: Σ width · f(x)."""
        return float((self.high - self.low) @ f.values(self.x[:, None]))


def draw_bins(rng: np.random.Generator) -> Drawing:
    """Four ways to put 20 rectangles over the talk's test function."""
    f = INTEGRANDS["talk"]
    binnings = _binnings(f, rng)
    with house_style():
        figure = new_figure(6.0)
        panels = figure.subplots(2, 2, sharex=True, sharey=True)
        for ax, binning in zip(panels.flat, binnings, strict=True):
            _panel(ax, f, binning)
        key = {"x": 0.0, "y": -1.9, "fontsize": 9, "va": "top"}
        panels[0, 1].text(s="in no bin", color=VERMILION, **key)
        panels[0, 1].text(s="in two or more", color=BLUE, **{**key, "x": 0.27})
    rows = [
        {"panel": b.title, "x": x, "f": y, "bin_low": low, "bin_high": high}
        for b in binnings
        for x, y, low, high in zip(b.x, f.values(b.x[:, None]), b.low, b.high, strict=True)
    ]
    return Drawing(
        figure,
        rows,
        f"Each of {SAMPLES} samples stands for a bin; the estimate is the total area of the rectangles. Independent "
        "samples of equal weight leave gaps (orange in the strip below each panel) and count other parts twice or "
        "more (dark blue), and importance sampling does so too. Voronoi cells use the very same random samples "
        f"and tile the interval. RMS: root mean squared error over {REPETITIONS:,} sets, relative to the "
        f"integral {f.integral:.5f}.",
        "Four panels with the talk's test function under 20 rectangles: regular bins, random samples with gaps and "
        "overlaps, importance sampling with narrower overlapping bins, and the same random samples with "
        "Voronoi cells, which cover the interval once.",
    )


def _binnings(f: KnownIntegrand, rng: np.random.Generator) -> list[Binning]:
    n = SAMPLES
    regular = sample("regular", n).points[:, 0]
    many = sample("uniform", n, sets=REPETITIONS, rng=rng)
    values = f.values(many.points)
    x = np.sort(many.points[0, :, 0])
    density = StepDensity.like(f, bins=8)
    u = sample("uniform", n, sets=REPETITIONS, rng=rng).points[..., 0]
    warped = density.warp(u)
    importance = np.sort(warped[0])
    ends = cells(x[:, None]).intervals()

    def rms(estimates: Array) -> float:
        return float(np.sqrt(np.mean((estimates - f.integral) ** 2)))

    def centred(title: str, x: Array, width: Array | float, error: float | None) -> Binning:
        return Binning(title, x, x - width / 2, x + width / 2, error)

    return [
        centred("Regular binning", regular, 1 / n, None),
        centred("Random samples", x, 1 / n, rms(values.mean(axis=-1))),
        centred(
            "Importance sampling",
            importance,
            1 / (n * density(importance)),
            rms((f.values(warped[..., None]) / density(warped)).mean(axis=-1)),
        ),
        Binning("Reweighted random samples", x, ends[:, 0], ends[:, 1], rms((weights(many) * values).sum(axis=-1))),
    ]


@dataclass(frozen=True)
class StepDensity:
    """A density constant on equal bins of [0, 1], its values given."""

    heights: Array

    @classmethod
    def like(cls, f: KnownIntegrand, bins: int) -> StepDensity:
        """Proportional to the mean of f on each bin, but nowhere below a quarter of the average."""
        x = (np.arange(64 * bins) + 0.5) / (64 * bins)
        means = f.values(x[:, None]).reshape(bins, 64).mean(axis=1)
        means = np.maximum(means, means.mean() / 4)
        return cls(means / means.mean())

    def __call__(self, x: Array) -> Array:
        """The density at x."""
        index = np.minimum((x * len(self.heights)).astype(np.intp), len(self.heights) - 1)
        return np.asarray(self.heights[index])

    def warp(self, u: Array) -> Array:
        """The inverse of the distribution function: uniform u to samples of the density."""
        knots = np.linspace(0, 1, len(self.heights) + 1)
        distribution = np.concatenate([[0], np.cumsum(self.heights) / len(self.heights)])
        return np.interp(u, distribution, knots)


def _panel(ax: Axes, f: KnownIntegrand, binning: Binning) -> None:
    heights = f.values(binning.x[:, None])
    spans = list(zip(binning.low, binning.high, heights, strict=True))
    ax.add_collection(
        PatchCollection(
            [Rectangle((low, 0), high - low, y) for low, high, y in spans],
            facecolor=BLUE,
            edgecolor=BLUE,
            alpha=0.28,
            linewidth=0.7,
        )
    )
    grid = np.linspace(0, 1, 2001)
    ax.plot(grid, f.values(grid[:, None]), color=INK, linewidth=1.3)
    ax.plot(binning.x, heights, "o", color=INK, markersize=2.6)
    _coverage_strip(ax, binning, bottom=-1.5, height=0.8)
    ax.set(xlim=(-0.06, 1.06), ylim=(-3, 11.9), xticks=[0, 0.5, 1], yticks=[0, 5, 10])
    ax.spines["left"].set_bounds(0, 10)
    ax.spines["bottom"].set_visible(False)
    ax.tick_params(axis="x", length=0)
    ax.set_title(binning.title)
    error = f"{binning.estimate(f) / f.integral - 1:+.1%}".replace("-", "−").replace("%", " %")
    if binning.rms is None:
        ax.text(1.05, 11.7, f"error {error}", ha="right", va="top")
    else:
        ax.text(1.05, 11.7, f"RMS error {100 * binning.rms / f.integral:.1f} %", ha="right", va="top")
        ax.text(1.05, 10.6, f"this set {error}", ha="right", va="top", fontsize=9, color=MUTED)


def _coverage_strip(ax: Axes, binning: Binning, bottom: float, height: float) -> None:
    """How many bins cover each point of [0, 1]: none, one, several."""
    edges = np.unique(np.clip(np.concatenate([binning.low, binning.high, [0, 1]]), 0, 1))
    middle = (edges[:-1] + edges[1:]) / 2
    cover = ((binning.low <= middle[:, None]) & (middle[:, None] < binning.high)).sum(axis=1)
    for low, high, count in zip(edges[:-1], edges[1:], cover, strict=True):
        if high - low > 1e-9:
            color = VERMILION if count == 0 else FAINT if count == 1 else BLUE
            ax.add_patch(Rectangle((low, bottom), high - low, height, facecolor=color, linewidth=0, antialiased=False))
