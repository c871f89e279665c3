"""One look for all figures: light background, colour-blind safe, lines labelled where they end."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import isotonic_regression

from .._support.extras import install_hint

try:
    import matplotlib as mpl
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
except ImportError as error:
    raise ImportError(f"figures need Matplotlib; {install_hint('study')}") from error

INK = "#222222"
MUTED = "#6b6b6b"
FAINT = "#d9d9d9"

# Okabe and Ito's palette, told apart by all common kinds of colour vision
BLUE = "#0072B2"
VERMILION = "#D55E00"
GREEN = "#009E73"
PURPLE = "#A8508A"  # darkened, so that it can be read as text
SKY = "#56B4E9"

WIDTH = 8.0  # inches; at DPI 200 a figure is 1600 pixels wide
DPI = 200

_SETTINGS: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with Matplotlib: the same on every machine
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.labelsize": 10,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.8,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "text.color": INK,
    "grid.color": FAINT,
    "grid.linewidth": 0.6,
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "figure.dpi": 100,
    "savefig.dpi": DPI,
    "svg.hashsalt": "voroquad",  # the same picture is the same file
}


@contextmanager
def house_style() -> Iterator[None]:
    """Draw in the project's style inside the block."""
    with mpl.rc_context(_SETTINGS):
        yield


def new_figure(height: float, width: float = WIDTH) -> Figure:
    """An empty figure, sizes in inches, outside pyplot's global state."""
    return Figure(figsize=(width, height), layout="constrained")


@dataclass(frozen=True)
class LineLabel:
    """The text beside the right end of a line."""

    text: str
    y: float  # where the line ends, in data units
    color: str


def label_line_ends(ax: Axes, x: float, labels: Sequence[LineLabel], *, size: float = 9) -> None:
    """Write labels beside the axes' right border, pushed apart where line ends are close, each tied to its own.

    x is the lines' last abscissa in data units. Limits must be final, the figure laid out afterwards.
    """
    to_axes = ax.transData + ax.transAxes.inverted()
    ends = np.array([to_axes.transform((x, label.y))[1] for label in labels])
    x_end = float(to_axes.transform((x, labels[0].y))[0])
    figure = ax.get_figure()
    assert figure is not None
    axes_points = ax.get_position().height * figure.get_figure(root=True).get_figheight() * 72
    places = spread(ends, 1.35 * size / axes_points)
    for label, end, place in zip(labels, ends, places, strict=True):
        ax.annotate(
            label.text,
            xy=(x_end, end),
            xytext=(1.04, place),
            xycoords="axes fraction",
            textcoords="axes fraction",
            va="center",
            color=label.color,
            fontsize=size,
            annotation_clip=False,
            arrowprops={
                "arrowstyle": "-",
                "color": label.color,
                "linewidth": 0.6,
                "shrinkA": 1,
                "shrinkB": 3,
                "relpos": (0, 0.5),
            },
        )


def spread(wanted: np.ndarray, gap: float) -> np.ndarray:
    """Return places at least `gap` apart, in the order of the wanted ones and closest to them in least squares.

    With places p_k = q_k + k · gap, sorted, q must not decrease: isotonic regression of wanted − k · gap.
    """
    order = np.argsort(wanted, kind="stable")
    steps = np.arange(len(wanted)) * gap
    places = np.empty(len(wanted))
    places[order] = isotonic_regression(wanted[order] - steps).x + steps
    return places
