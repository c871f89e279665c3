"""Pictures of a comparison."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.image import imsave
from matplotlib.ticker import NullFormatter, NullLocator
from numpy.typing import NDArray

from ..results import Line
from ..style import (
    BLUE,
    FAINT,
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
from .render import Image, rgb, srgb

Window = tuple[slice, slice]


def image_png(image: Image, path: Path, magnify: int = 1) -> None:
    """Write an image in sRGB, its pixels magnified."""
    imsave(path, np.kron(srgb(rgb(image)), np.ones((magnify, magnify, 1))))


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


#: Colour of a method by its sampler, the first words of its label
_COLORS = {
    "uniform": BLUE,
    "stratified": VERMILION,
    "zero-two": SKY,
    "Sobol'": GREEN,
    "Halton": PURPLE,
    "Mitsuba independent": MUTED,
    "Mitsuba multijitter": INK,
}


def line_style(label: str) -> Line:
    """How a method's line looks: the colour of its sampler, solid if it is weighted."""
    sampler = label.removesuffix(" + w")
    return Line(_COLORS[sampler], dash="dashed") if sampler == label else Line(_COLORS[sampler], marker="circle")


def mse_figure(
    stem: Path, curves: dict[str, tuple[list[int], list[float], float | None]], reference_mse: float
) -> None:
    """Log-log plot of (spp, mse, slope) per method, as .png and .svg beside `stem`."""
    spp = next(iter(curves.values()))[0]
    labels = []
    with house_style():
        figure = new_figure(4.4)
        axes = figure.add_subplot()
        for label, (_, mse, slope) in curves.items():
            sampler = label.removesuffix(" + w")
            weighted: dict[str, Any] = (
                {"marker": "o", "ms": 4, "lw": 1.8} if sampler != label else {"ls": "--", "lw": 1.2}
            )
            axes.plot(spp, mse, color=_COLORS[sampler], **weighted)
            text = label if slope is None else f"{label}  " + f"{slope:.1f}".replace("-", "−")
            labels.append(LineLabel(text, mse[-1], _COLORS[sampler]))
        axes.axhline(reference_mse, color=FAINT, lw=0.8)
        axes.annotate("error of the reference", (spp[0], reference_mse), xytext=(0, 3),
                      textcoords="offset points", color=MUTED, fontsize=8)  # fmt: skip
        axes.set(xscale="log", yscale="log", xlabel="samples per pixel", xlim=(spp[0] * 0.9, spp[-1] * 1.1))
        axes.set_xticks(spp, [str(n) for n in spp])
        axes.xaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.grid(True, axis="y")
        axes.set_title("Mean squared error")
        if len(spp) > 1:
            axes.set_title("slope", loc="right", fontsize=9, fontweight="normal")
        figure.draw_without_rendering()
        label_line_ends(axes, spp[-1], labels)
        figure.savefig(stem.with_suffix(".png"))
        figure.savefig(stem.with_suffix(".svg"), metadata={"Date": None})
