"""The pixels of a comparison, packed small for the page, and the plots that show them."""

from __future__ import annotations

import base64
import os
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .._support.extras import install_hint

try:
    import OpenEXR
    from bokeh.models import (
        BoxAnnotation,
        ColorBar,
        ColumnDataSource,
        CrosshairTool,
        LinearColorMapper,
        PanTool,
        Range1d,
        Span,
        WheelZoomTool,
    )
    from bokeh.palettes import RdBu11, interp_palette
    from bokeh.plotting import figure
except ImportError as error:
    raise ImportError(f"reports need Bokeh and OpenEXR; {install_hint('study')}") from error

Pixels = NDArray[np.float32]

#: Low bits of a packed error that are zero: eight significant bits stay, and it is a fifth smaller
ZERO_BITS = 3
#: Brighter pixels become that; a float16 that no rounding of its low bits turns into infinity
LARGEST = 65024.0
#: The closest view, in pixels of the image across
CLOSEST = 8

#: Blue below the reference, white equal, red above
PALETTE = interp_palette(RdBu11, 255)


def read_exr(path: Path) -> Pixels:
    """The colours (height, width, 3) of an EXR image; grey is repeated."""
    try:
        channels = OpenEXR.File(os.fspath(path)).channels()
    except RuntimeError as error:
        raise ValueError(f"{path} is no readable EXR image ({error}); make it again") from None
    for name in ("RGB", "RGBA", "Y"):
        if name in channels:
            pixels = np.asarray(channels[name].pixels, dtype=np.float32)
            return pixels[..., :3] if pixels.ndim == 3 else np.repeat(pixels[..., None], 3, axis=-1)
    raise ValueError(f"{path} has no colours, but the channels {', '.join(channels)}")


def pack(pixels: Pixels, zero_bits: int = 0) -> str:
    """Pixels (height, width, 3) as text: float16 by channel, all low bytes then all high ones, deflated, base64.

    Parameters
    ----------
    pixels : ndarray, shape (height, width, 3)
        Values beyond ±65024 become that.
    zero_bits : int
        Low bits of each number to round away, at most 4. The relative error is then at most
        2^(zero_bits − 11) + 2^−11 (in the range of a normal float16, from 6·10⁻⁵ up).
    """
    half = np.clip(pixels, -LARGEST, LARGEST).astype(np.float16)
    bits = np.moveaxis(half, -1, 0).ravel().view(np.uint16)
    step = 1 << zero_bits
    bits = (bits + np.uint16(step // 2)) & np.uint16(0x10000 - step)
    in_planes = bits.astype("<u2").view(np.uint8).reshape(-1, 2).T.tobytes()
    return base64.b64encode(zlib.compress(in_planes)).decode("ascii")


def viewer_plots(width: int, height: int, scale: float) -> dict[str, figure]:
    """Plots for the image, its error and the errors' colours; the first two share their view and their crosshair.

    The page's script puts the pixels into the sources "pixels" (rgba) and "errors" (image minus reference).
    """
    x = Range1d(start=0, end=width, bounds=(0, width), min_interval=min(CLOSEST, width))
    y = Range1d(start=0, end=height, bounds=(0, height), min_interval=min(CLOSEST, width) * height / width)
    mapper = LinearColorMapper(palette=PALETTE, low=-scale, high=scale, name="mapper")
    pixels = ColumnDataSource({"image": [np.zeros((1, 1), dtype=np.uint32)]}, name="pixels")
    errors = ColumnDataSource({"image": [np.zeros((1, 1), dtype=np.float32)]}, name="errors")
    cross = tuple(Span(dimension=d, line_color="#808080", line_alpha=0.7) for d in ("width", "height"))
    window = BoxAnnotation(
        name="window", visible=False, fill_alpha=0, line_color="white", line_width=1.5, line_alpha=1,
        left=0, right=width, bottom=0, top=height,
    )  # fmt: skip

    image = _stage("image", x, y, cross)
    image.image_rgba("image", source=pixels, x=0, y=0, dw=width, dh=height)
    image.add_layout(window)
    error = _stage("error", x, y, cross)
    error.image("image", source=errors, x=0, y=0, dw=width, dh=height, color_mapper=mapper)
    return {"image": image, "error": error, "colors": _color_bar(mapper)}


def _stage(name: str, x: Range1d, y: Range1d, cross: tuple[Span, Span]) -> figure:
    """A plot that is nothing but its frame, of the image's shape."""
    pan, wheel = PanTool(name="pan"), WheelZoomTool(name="wheel", maintain_focus=False)
    plot = figure(
        name=name, x_range=x, y_range=y, aspect_ratio=x.end / y.end, sizing_mode="scale_width", min_border=0,
        tools=[pan, wheel, CrosshairTool(overlay=cross)], active_drag=None, toolbar_location=None,
        outline_line_color=None, background_fill_color=None, border_fill_color=None,
    )  # fmt: skip
    plot.axis.visible = False
    plot.grid.visible = False
    return plot


def _color_bar(mapper: LinearColorMapper) -> figure:
    """A plot that is nothing but the bar of a mapper's colours."""
    plot = figure(
        name="colors", x_range=Range1d(), y_range=Range1d(), height=44,
        sizing_mode="stretch_width", min_border=0, toolbar_location=None, tools=[],
        outline_line_color=None, background_fill_color=None, border_fill_color=None,
    )  # fmt: skip
    plot.axis.visible = False
    plot.grid.visible = False
    bar = ColorBar(
        name="bar", color_mapper=mapper, orientation="horizontal", location=(0, 0), height=12, padding=2,
        background_fill_color=None, bar_line_color=None,
    )  # fmt: skip
    plot.add_layout(bar, "below")
    return plot
