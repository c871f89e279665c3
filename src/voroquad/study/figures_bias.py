"""Where the bias of Voronoi weights in one dimension comes from: the two end cells (the talk's N = 3 and g)."""

from __future__ import annotations

import itertools

import numpy as np
from matplotlib.axes import Axes

from .._support.arrays import Array
from ..designs.sampling import sample
from ..results.style import BLUE, FAINT, GREEN, INK, MUTED, VERMILION, house_style, new_figure
from ..rules.bias import bias_function
from ..rules.registry import weights
from .drawing import Drawing

COLORS = (BLUE, GREEN, VERMILION)

# ---------------------------------------------------------------------- three samples

THREE_SETS = 100_000
POSITIONS = np.array([1, 2, 3]) / 4  # E x_(i) = i / (n + 1)
WEIGHTS = np.array([3, 2, 3]) / 8  # half a spacing on each side, a whole one at an end; the mean of a spacing is ¼


def draw_three(rng: np.random.Generator) -> Drawing:
    """Mean positions and mean Voronoi weights of three sorted uniform samples."""
    x = np.sort(sample("uniform", 3, sets=THREE_SETS, rng=rng).points[..., 0], axis=-1)
    w = weights(x[..., None])
    rows = [
        {"quantity": f"{name}_{i + 1}", "expected": float(expected[i]), "simulated": float(values[:, i].mean()),
         "standard_error": float(values[:, i].std(ddof=1) / np.sqrt(len(values))), "sets": len(values)}
        for name, expected, values in (("x", POSITIONS, x), ("w", WEIGHTS, w))
        for i in range(3)
    ]  # fmt: skip
    with house_style():
        figure = new_figure(4.0)
        top, bottom = figure.subplots(2, 1, sharex=True)
        _draw_positions(top, x)
        _draw_weights(bottom, w)
    return Drawing(
        figure,
        rows,
        f"Three sorted uniform samples, {THREE_SETS:,} sets. On average they stand at ¼, ½, ¾, but their Voronoi cells "
        "are ⅜, ¼, ⅜ long: the outer ones reach to the border. The outer samples count more than with equal "
        "weights, the inner one less; the bias function g tells what that does to Î_C.",
        "Top: distributions of the three sorted samples with means at one, two and three quarters. Bottom: mean "
        "Voronoi weights three eighths, a quarter, three eighths, expected and simulated.",
    )


def _draw_positions(ax: Axes, x: Array) -> None:
    bins = np.linspace(0, 1, 51)
    for i, (color, fraction) in enumerate(zip(COLORS, "¼½¾", strict=True)):
        ax.hist(x[:, i], bins=list(bins), density=True, color=color, alpha=0.35)
        ax.axvline(POSITIONS[i], color=color, linewidth=1.2, linestyle=(0, (4, 2)))
        ax.text(POSITIONS[i] + 0.008, 3.1, f"{fraction}   simulated {x[:, i].mean():.4f}", color=color, va="top")
    ax.set(ylim=(0, 3.2), yticks=[])
    ax.spines["left"].set_visible(False)
    ax.set_title("Where the first, second and third sample lie, and their means")


def _draw_weights(ax: Axes, w: Array) -> None:
    for y, label, widths in ((1, "expected", WEIGHTS), (0, "simulated", w.mean(axis=0))):
        left = 0.0
        for i, (width, color) in enumerate(zip(widths, COLORS, strict=True)):
            ax.barh(y, width, left=left, height=0.7, color=color, alpha=0.35, edgecolor="white", linewidth=1.5)
            text = "⅜¼⅜"[i] if y else f"{width:.4f}"
            ax.text(left + width / 2, y, text, ha="center", va="center", color=color, fontsize=14 if y else 10)
            left += float(width)
        ax.text(-0.01, y, label, ha="right", va="center", color=MUTED)
    for fair in (1 / 3, 2 / 3):
        ax.axvline(fair, color=INK, linewidth=1, linestyle=(0, (1, 2)))
    ax.text(2 / 3 + 0.01, -0.62, "⅓ each: equal weights", ha="left", va="top", color=INK, fontsize=9)
    ax.set(xlim=(0, 1), ylim=(-1.1, 1.5), yticks=[], xticks=[0, 0.25, 0.5, 0.75, 1])
    ax.set_xticklabels(["0", "¼", "½", "¾", "1"])
    ax.spines["left"].set_visible(False)
    ax.set_title("Mean Voronoi weights, laid end to end")


# ---------------------------------------------------------------------- the bias function

SIZES = (30, 50, 100)
BIAS_SETS = 100_000
_BATCH = 10_000
BINS = 200


def draw_bias_function(rng: np.random.Generator) -> Drawing:
    """g for N = 30, 50, 100, closed form and simulation."""
    edges = np.linspace(0, 1, BINS + 1)
    rows = []
    with house_style():
        figure = new_figure(3.6)
        whole, zoom = figure.subplots(1, 2, width_ratios=[1, 1.1])
        fine = np.linspace(0, 1, 4001)
        for n, color in zip(SIZES, COLORS, strict=True):
            simulated, error = simulate_bias(n, edges, BIAS_SETS, rng)
            exact = np.array([mean_bias(n, low, high) for low, high in itertools.pairwise(edges)])
            rows += [
                {"n": n, "bin_low": low, "bin_high": high, "g": g, "simulated": s, "standard_error": e}
                for low, high, g, s, e in zip(edges[:-1], edges[1:], exact, simulated, error, strict=True)
            ]  # fmt: skip
            middle = (edges[:-1] + edges[1:]) / 2
            for ax, every in ((whole, 4), (zoom, 1)):
                ax.plot(fine, bias_function(fine, n), color=color, linewidth=1.4)
                ax.plot(middle[::every], simulated[::every], "o", color=color, markersize=3, alpha=0.6)
        for ax in (whole, zoom):
            ax.axhline(1, color=FAINT, linewidth=0.8, zorder=0)
            ax.set(ylim=(0.45, 1.2), yticks=[0.5, 0.75, 1], xlabel="x")
        whole.set(xlim=(-0.01, 1.01), xticks=[0, 0.5, 1])
        zoom.set(xlim=(0, 0.15), xticks=[0, 0.05, 0.1, 0.15])
        whole.set_title("Bias function g(x)")
        zoom.set_title("Its left end")
        for n, color, (x, y) in zip(SIZES, COLORS, ((0.062, 1.115), (0.034, 1.115), (0.004, 1.115)), strict=True):
            zoom.text(x, y, f"N = {n}", color=color)
    return Drawing(
        figure,
        rows,
        "Voronoi weights count f(x) g(x) instead of f(x): about half at the border, 7 % too much a little "
        f"inside, right elsewhere. Lines: closed form; points: {BIAS_SETS:,} simulated sets of each size. The more "
        "samples, the narrower the layer.",
        "Curves of the bias function for 30, 50 and 100 samples: one half at both ends, a bump above one close "
        "to them, and one in the interior; simulated points lie on the curves.",
    )


def simulate_bias(n: int, edges: Array, sets: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Mean of g over each bin, from the weights that fall into it, and standard errors.

    E Σ_i w_i [x_i in bin] = ∫_bin g.
    """
    bins = len(edges) - 1
    total, squares = np.zeros(bins), np.zeros(bins)
    for done in range(0, sets, _BATCH):
        batch = min(_BATCH, sets - done)
        samples = sample("uniform", n, sets=batch, rng=rng)
        bin_index = np.clip(np.searchsorted(edges, samples.points[..., 0], side="right") - 1, 0, bins - 1)
        index = np.arange(batch)[:, None] * bins + bin_index
        sums = np.bincount(index.ravel(), weights(samples).ravel(), minlength=batch * bins).reshape(batch, bins)
        total += sums.sum(axis=0)
        squares += (sums**2).sum(axis=0)
    mean = total / sets
    error = np.sqrt((squares / sets - mean**2) / (sets - 1))
    return mean / np.diff(edges), error / np.diff(edges)


def mean_bias(n: int, low: float, high: float) -> float:
    """Mean of g over an interval, by Gauss–Legendre quadrature."""
    x, w = np.polynomial.legendre.leggauss(16)
    return float(w @ bias_function(low + (high - low) * (x + 1) / 2, n) / 2)
