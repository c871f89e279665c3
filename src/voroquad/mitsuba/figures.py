"""Pictures of a comparison."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.image import imsave
from matplotlib.ticker import NullFormatter, NullLocator

from .._support.arrays import Array
from ..results.manifest import Line
from ..results.style import FAINT, MUTED, LineLabel, house_style, label_line_ends, new_figure
from .render import Image, rgb, srgb

Window = tuple[slice, slice]


def image_png(image: Image, path: Path, magnify: int = 1) -> None:
    """Write an image in sRGB, its pixels magnified."""
    imsave(path, np.kron(srgb(rgb(image)), np.ones((magnify, magnify, 1))))


def difference_png(error: Array, scale: float, path: Path) -> None:
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


def share_png(share: Array, path: Path) -> None:
    """Write a map (height, width) of shares: 0 dark, 1 light."""
    imsave(path, colormaps["cividis"](np.clip(share, 0, 1))[..., :3])


_MARKERS: dict[str, dict[str, Any]] = {
    "none": {"lw": 1.2},
    "circle": {"marker": "o", "ms": 4, "lw": 1.8},
    "diamond": {"marker": "D", "ms": 3.5, "lw": 1.4},
}


@dataclass
class ErrorCurve:
    """The errors of a method: its name, its look, samples per pixel and MSE, and the slope of the one by the other."""

    label: str
    line: Line
    spp: list[int]
    mse: list[float]
    slope: float | None


def mse_figure(stem: Path, curves: list[ErrorCurve], reference_mse: float) -> None:
    """Log-log plot of the errors of all methods, as .png and .svg beside `stem`."""
    spp = sorted({n for curve in curves for n in curve.spp})
    labels = []
    with house_style():
        figure = new_figure(1.6 + 0.28 * max(10, len(curves)))
        axes = figure.add_subplot()
        for curve in curves:
            axes.plot(curve.spp, curve.mse, color=curve.line.color, ls=curve.line.dash, **_MARKERS[curve.line.marker])
            text = curve.label
            if curve.slope is not None:
                text += f"  {curve.slope:.1f}".replace("-", "−")
            labels.append(LineLabel(text, curve.mse[-1], curve.line.color))
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


def write_spectra(stem: Path, spectra: list[tuple[str, Line, Array, Array]]) -> None:
    """Log-log plot of spectra, each with name, look, frequencies and powers, as .png and .svg beside `stem`."""
    labels = []
    with house_style():
        figure = new_figure(1.6 + 0.28 * max(10, len(spectra)))
        axes = figure.add_subplot()
        for label, line, frequency, power in spectra:
            axes.plot(frequency, power, color=line.color, ls=line.dash, **_MARKERS[line.marker] | {"marker": "none"})
            labels.append(LineLabel(label, power[-1], line.color))
        end = max(frequency[-1] for _, _, frequency, _ in spectra)
        start = spectra[0][2][0]
        axes.set(xscale="log", yscale="log", xlabel="cycles per pixel", xlim=(start * 0.9, end * 1.05))
        ticks = [tick for tick in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5) if start * 0.9 <= tick <= end * 1.05]
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_title("Power of the error by frequency")
        axes.grid(True, axis="y")
        figure.draw_without_rendering()
        label_line_ends(axes, end, labels)
        figure.savefig(stem.with_suffix(".png"))
        figure.savefig(stem.with_suffix(".svg"), metadata={"Date": None})
