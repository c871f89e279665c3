"""Where do samples go? What `quad(adapt=True)` learns of a peak and of a ridge.

    pip install '.[study]'
    python examples/peaks.py -o out/peaks

A map of each axis spreads samples over a peak; a ridge along a diagonal takes a tree of boxes. `peaks.png` shows the
lines between which the map puts equally many samples, and the boxes that have samples of their own.
"""

import argparse
from pathlib import Path

import numpy as np

import voroquad as vq


def peak(x: np.ndarray) -> np.ndarray:
    """A product of two Breit-Wigner peaks of the half-width 1/100."""
    return np.exp(x[2] + x[3]) / ((x[0] - 0.3) ** 2 + 1e-4) / ((x[1] - 0.62) ** 2 + 1e-4)


def ridge(x: np.ndarray) -> np.ndarray:
    """Along the diagonal of the first two axes."""
    return np.exp(-(((x[0] - x[1]) / 0.03) ** 2) + x[2] + x[3])


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("-o", "--output", type=Path)
output = parser.parse_args().output

found = {}
for name, f in (("peak", peak), ("ridge", ridge)):
    r = found[name] = vq.quad(f, [0] * 4, [1] * 4, n_points=16_000, adapt=True, rng=1)
    boxes = len(r.adaptation.low)
    print(f"{name:7}{r}, {r.adaptation.n_pilot} evaluations to adapt, {boxes} box{'es' if boxes > 1 else ''}")

if output:
    from matplotlib.patches import Rectangle

    from voroquad.results.style import BLUE, house_style, new_figure

    output.mkdir(parents=True, exist_ok=True)
    middle = (np.arange(400) + 0.5) / 400
    x, y = np.meshgrid(middle, middle)
    with house_style():
        figure = new_figure(height=4.3)
        left, right = figure.subplots(1, 2)
        for ax, f, title in (
            (left, peak, "a peak: lines of the map"),
            (right, ridge, "a ridge: boxes of the tree"),
        ):
            values = f(np.stack([x, y, np.zeros_like(x), np.zeros_like(x)]))
            ax.imshow(np.cbrt(values), origin="lower", extent=(0, 1, 0, 1), cmap="Greys", interpolation="bilinear")
            ax.set(title=title, xlabel="x₁", ylabel="x₂", xticks=[0, 0.5, 1], yticks=[0, 0.5, 1])
        nodes = found["peak"].adaptation.nodes
        left.vlines(nodes[0], 0, 1, color=BLUE, linewidth=0.5)
        left.hlines(nodes[1], 0, 1, color=BLUE, linewidth=0.5)
        learned = found["ridge"].adaptation
        grid = np.linspace(0, 1, learned.nodes.shape[1])
        for low, high in zip(learned.low, learned.high, strict=True):
            (x0, x1), (y0, y1) = (np.interp([low[a], high[a]], grid, learned.nodes[a]) for a in (0, 1))
            right.add_patch(Rectangle((x0, y0), x1 - x0, y1 - y0, fill=False, edgecolor=BLUE, linewidth=0.5))
        figure.savefig(output / "peaks.png", dpi=150)
