"""Pictures of a comparison."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.image import imsave
from numpy.typing import NDArray

from .render import Image, srgb

Window = tuple[slice, slice]


def image_png(image: Image, path: Path, magnify: int = 1) -> None:
    """Write an image in sRGB, its pixels magnified."""
    imsave(path, np.kron(srgb(image[..., :3]), np.ones((magnify, magnify, 1))))


def difference_png(error: NDArray[np.float64], scale: float, path: Path) -> None:
    """Write signed errors (height, width): blue −scale, white 0, red +scale."""
    position = np.clip(error / scale, -1, 1) / 2 + 0.5 if scale > 0 else np.full_like(error, 0.5)
    imsave(path, colormaps["RdBu_r"](position)[..., :3])


def closeup_windows(error: Image, count: int = 2, share: int = 5) -> list[Window]:
    """Windows, 1/share of the image wide and high, that hold the most squared error and do not overlap."""
    squared = (error**2).sum(-1)
    height, width = (max(1, n // share) for n in squared.shape)
    windows: list[Window] = []
    for _ in range(count):
        sums = np.pad(squared.cumsum(0).cumsum(1), ((1, 0), (1, 0)))
        inside = sums[height:, width:] - sums[:-height, width:] - sums[height:, :-width] + sums[:-height, :-width]
        y, x = np.unravel_index(int(inside.argmax()), inside.shape)
        windows.append((slice(int(y), int(y) + height), slice(int(x), int(x) + width)))
        squared = squared.copy()
        squared[windows[-1]] = 0
    return windows


def mse_figure(
    stem: Path, curves: dict[str, tuple[list[int], list[float], float | None]], reference_mse: float
) -> None:
    """Log-log plot of (spp, mse, slope) per method, as .png and .svg beside `stem`."""
    colours = ("#888888", "#000000", "#7fb3d5", "#1f5f99", "#e59866", "#c0392b", "#8e6bb0", "#b0b0b0", "#4f9d69")
    styles = {"uniform": "--", "stratified": "--", "Mitsuba independent": ":", "Mitsuba multijitter": ":"}
    with matplotlib.rc_context({"svg.hashsalt": "voroquad", "font.size": 10}):
        figure = Figure(figsize=(7.6, 5), layout="constrained")
        axes = figure.add_subplot()
        for (label, (spp, mse, slope)), colour in zip(curves.items(), colours, strict=True):
            bold = 2.4 if label.endswith("+ w") else 1.4
            name = label if slope is None else f"{label}  (" + f"{slope:.2f})".replace("-", "−")
            axes.loglog(spp, mse, styles.get(label, "-"), marker="o", ms=4, lw=bold, color=colour, label=name)
        axes.axhline(reference_mse, color="#bbbbbb", lw=0.8)
        axes.annotate("error of the reference", (axes.get_xlim()[0], reference_mse), xytext=(6, 3),
                      textcoords="offset points", color="#888888", fontsize=8)  # fmt: skip
        spp = next(iter(curves.values()))[0]
        axes.set_xticks(spp, [str(n) for n in spp])
        axes.minorticks_off()
        axes.set_xlabel("samples per pixel")
        axes.set_ylabel("mean squared error")
        axes.grid(True, color="#e6e6e6", lw=0.6)
        axes.spines[["top", "right"]].set_visible(False)
        figure.legend(loc="outside right upper", frameon=False, title="method (slope)")
        figure.savefig(stem.with_suffix(".png"), dpi=150)
        figure.savefig(stem.with_suffix(".svg"), metadata={"Date": None})
