"""Errors of images against a reference."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .methods import RenderMethod
from .render import Image, rgb, srgb

RELATIVE_FLOOR = 1e-2  # added to the squared reference in the relative MSE


@dataclass
class MeasuredImages:
    """Images of one method at one spp against the reference: the first of them, and means over all."""

    method: RenderMethod
    spp: int
    image: Image
    mse: float
    mse_error: float  # standard error over the images; NaN for one
    relmse: float
    flip: float
    seconds: float
    share: Image | None = None  # the blend's λ (height, width) in the image


@dataclass
class Reference:
    """The mean of independent rounds and what is known of its error."""

    image: Image
    spp: int
    rounds: int
    mse: float  # estimated from its two halves


def errors_of(image: Image, reference: Image) -> dict[str, float]:
    """MSE, relative MSE and mean ꟻLIP of an image."""
    squared = (image - reference) ** 2
    relative = squared / (reference**2 + RELATIVE_FLOOR)
    return {"mse": float(squared.mean()), "relmse": float(relative.mean()), "flip": mean_flip(reference, image)}


def mean_flip(reference: Image, image: Image) -> float:
    """Mean ꟻLIP of the images as shown (sRGB, clipped), 0 to 1."""
    import flip_evaluator

    shown = [srgb(rgb(x)).astype(np.float32) for x in (reference, image)]
    _, mean, _ = flip_evaluator.evaluate(*shown, "LDR", inputsRGB=True, applyMagma=False, computeMeanError=True)
    return float(mean)
