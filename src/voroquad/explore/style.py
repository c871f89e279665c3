"""One style for all plots: colours that are readable on white and on black, and figures without decoration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.models import LinearColorMapper
from bokeh.plotting import figure

#: Colours of the two rules, which are distinct under all common kinds of colour vision
RULE_COLORS = ("#d9730d", "#3a8fc7")
MUTED = "#7d828b"
WARNING = "#c2185b"

# From small weights through 1/N to large ones: violet, the colour of the page, orange.
_LIGHT = ("#542788", "#998ec3", "#f7f7f7", "#f1a340", "#b35806")
_DARK = ("#c3b1f0", "#7b61b5", "#24272c", "#b86a1c", "#ffb75e")
_COLORS = 256


def diverging_mapper(name: str, low: float, high: float) -> LinearColorMapper:
    """Colours from `low` through 1, the neutral middle, to `high`; negative weights stand out.

    The page finds the mapper by its name and gives it the palette of the theme, in `tags`.
    """
    light, dark = (_diverging(anchors, (1 - low) / (high - low)) for anchors in (_LIGHT, _DARK))
    return LinearColorMapper(
        palette=light, low=low, high=high, nan_color=MUTED, low_color=WARNING, name=name, tags=[light, dark]
    )


def new_plot(name: str, **settings: Any) -> figure:
    """An empty figure that takes its text and line colours from the page."""
    plot = figure(
        tools="", toolbar_location=None, sizing_mode="stretch_width", name=name,
        background_fill_color=None, border_fill_color=None, outline_line_color=None, **({"min_border": 4} | settings),
    )  # fmt: skip
    plot.grid.visible = False
    plot.axis.minor_tick_line_color = None
    plot.axis.axis_label_text_font_style = "normal"
    return plot


def _diverging(anchors: Sequence[str], middle: float) -> list[str]:
    """Hex colours through the anchors, the central one at the fraction `middle`."""
    rgb = np.array([[int(anchor[k : k + 2], 16) for k in (1, 3, 5)] for anchor in anchors])
    places = [0.0, middle / 2, middle, (1 + middle) / 2, 1.0]
    t = np.linspace(0, 1, _COLORS)
    channels = np.stack([np.interp(t, places, channel) for channel in rgb.T], axis=-1).round().astype(int)
    return ["#{:02x}{:02x}{:02x}".format(*color) for color in channels]
