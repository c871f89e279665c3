"""A comparison of renderings, ready for the page."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..results.manifest import ImageComparison, Rendering
from .embed import embedded
from .errors import Errors, read_errors
from .images import PALETTE, ZERO_BITS, Pixels, pack, read_exr, viewer_plots

#: At first, errors up to so many rms errors of the baseline have a colour of their own
SCALE_IN_RMS = 3.0
REFERENCE = "reference"


@dataclass(frozen=True)
class Viewer:
    """What the template and the script show of a comparison."""

    caption: str
    baseline: str
    errors: Errors
    packed: dict[str, str]  # pixels by element id: the reference, and every rendering minus it
    keys: dict[tuple[str, int], str]  # those element ids by method and spp
    data: dict[str, Any]  # for the script
    elements: dict[str, str]  # element ids of Bokeh's plots


def make_viewer(comparison: ImageComparison, locate: Callable[[str], Path], anchor: str) -> Viewer:
    """Read the images and errors of a comparison, whose files `locate` finds.

    Raises
    ------
    ValueError
        A file is damaged, the sizes of the images differ, a rendering has no line among the errors or the baseline
        none at all.
    """
    csv = locate(comparison.csv)
    errors = read_errors(csv)
    reference = read_exr(locate(comparison.reference))
    height, width = reference.shape[:2]
    if comparison.baseline not in errors.methods:
        raise ValueError(f"{csv} has no line for {comparison.baseline!r}; make the folder again")
    for left, top, across, down in comparison.closeups:
        if not (0 <= left < left + across <= width and 0 <= top < top + down <= height):
            raise ValueError(f"closeups: {[left, top, across, down]} is not inside {width}x{height} pixels")
    packed = {f"{anchor}-{REFERENCE}": pack(reference)}
    keys, renderings = {}, []
    for number, rendering in enumerate(comparison.renderings):
        key = f"{anchor}-{number}"
        keys[rendering.method, rendering.spp] = key
        packed[key] = pack(_error(locate(rendering.exr), reference), ZERO_BITS)
        renderings.append(_described(rendering, key, errors, csv))
    scale = _scale(errors, comparison.baseline)
    plots = viewer_plots(width, height, scale)
    elements = {name: f"{anchor}-{name}" for name in plots}
    data = {
        "width": width,
        "height": height,
        "reference": f"{anchor}-{REFERENCE}",
        "renderings": renderings,
        "closeups": comparison.closeups,
        "scale": scale,
        "palette": PALETTE,
        "plots": embedded({elements[name]: plot for name, plot in plots.items()}),
    }
    return Viewer(comparison.caption, comparison.baseline, errors, packed, keys, data, elements)


def _error(path: Path, reference: Pixels) -> Pixels:
    """An image minus the reference."""
    image = read_exr(path)
    if image.shape != reference.shape:
        (h, w), (rows, columns) = image.shape[:2], reference.shape[:2]
        raise ValueError(f"{path} is {w}x{h} and the reference {columns}x{rows}; make the folder again")
    return image - reference


def _described(rendering: Rendering, key: str, errors: Errors, path: Path) -> dict[str, Any]:
    """A rendering as the script knows it."""
    cell = errors.cells.get((rendering.method, rendering.spp))
    if cell is None:
        raise ValueError(f"{path} has no line for {rendering.method!r} at {rendering.spp} spp; make the folder again")
    name = f"{rendering.method}, {rendering.spp} spp"
    mse = cell.mse if math.isfinite(cell.mse) else None  # JSON has no other numbers
    return {"key": key, "method": rendering.method, "spp": rendering.spp, "name": name, "mse": mse}


def _scale(errors: Errors, baseline: str) -> float:
    """Some rms errors of the baseline at its middle spp; of any size where it has none."""
    line = [cell for cell in errors.cells.values() if cell.method == baseline]
    mse = line[len(line) // 2].mse
    return SCALE_IN_RMS * math.sqrt(mse) if 0 < mse < math.inf else 1.0
