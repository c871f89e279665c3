"""Errors of images against a reference."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from .methods import RenderMethod
from .render import Image, rgb, srgb

RELATIVE_FLOOR = 1e-2  # added to the squared reference in the relative MSE
#: Standard deviations of the blurs, in pixels: what an eye far away, or a denoiser, averages over
BLURS = (1.5, 3.0)


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
    blur_1_5: float  # MSE after a blur of 1.5 pixels
    blur_3: float
    seconds: float
    share: Image | None = None  # the blend's λ (height, width) in the image


@dataclass
class Reference:
    """The mean of independent rounds, and an estimate of its error."""

    image: Image
    spp: int
    rounds: int
    mse: float  # estimated from its two halves


def errors_of(image: Image, reference: Image) -> dict[str, float]:
    """MSE, relative MSE and mean ꟻLIP of an image, and its MSE after blurs."""
    squared = (image - reference) ** 2
    relative = squared / (reference**2 + RELATIVE_FLOOR)
    small, large = (blurred_mse(image - reference, sigma) for sigma in BLURS)
    return {
        "mse": float(squared.mean()), "relmse": float(relative.mean()), "flip": mean_flip(reference, image),
        "blur_1_5": small, "blur_3": large,
    }  # fmt: skip


def blurred_mse(error: Image, sigma: float) -> float:
    """MSE of the errors (height, width, channels) after a Gaussian blur of σ pixels.

    Errors of opposite signs near each other cancel in it. Of errors that are independent from pixel to pixel it leaves
    `left_by_blur`.
    """
    return float((gaussian_filter(error, sigma, axes=(0, 1)) ** 2).mean())


def left_by_blur(sigma: float) -> float:
    """The part of the MSE that a Gaussian blur leaves of independent errors: the integral of its square, 1/(4πσ²)."""
    return 1 / (4 * np.pi * sigma**2)


def mean_flip(reference: Image, image: Image) -> float:
    """Mean ꟻLIP of the images as shown (sRGB, clipped), 0 to 1."""
    import flip_evaluator

    shown = [srgb(rgb(x)).astype(np.float32) for x in (reference, image)]
    _, mean, _ = flip_evaluator.evaluate(*shown, "LDR", inputsRGB=True, applyMagma=False, computeMeanError=True)
    return float(mean)
