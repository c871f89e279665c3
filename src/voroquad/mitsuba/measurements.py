"""Errors of images against a reference."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from .._support.arrays import Array
from .methods import RenderMethod
from .render import Image, rgb, srgb

RELATIVE_FLOOR = 1e-2  # added to the squared reference in the relative MSE
#: Standard deviations of the blurs, in pixels: what an eye far away, or a denoiser, averages over
BLURS = (1.5, 3.0)
#: Bands of frequencies of a spectrum
SPECTRUM_BANDS = 16


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


def error_spectrum(error: Image, bands: int = SPECTRUM_BANDS) -> tuple[Array, Array]:
    """Power of the errors (height, width, channels) of an image by spatial frequency, mean over directions.

    Parameters
    ----------
    error : ndarray, (height, width, channels)
        Image minus reference.
    bands : int
        Bands of frequencies at most; those in which the image has no frequency are left out.

    Returns
    -------
    frequencies, powers : ndarray, (bands,)
        Cycles per pixel, the means of the bands, up to 1/2; and mean squares of the coefficients of the discrete
        Fourier transform over the number of pixels, mean of the channels. Errors that are independent from pixel to
        pixel have the MSE at all frequencies. The mean error, of frequency 0, is left out.
    """
    height, width = error.shape[:2]
    power = (np.abs(np.fft.fft2(error, axes=(0, 1))) ** 2).mean(-1) / (height * width)
    frequency = np.hypot(np.fft.fftfreq(height)[:, None], np.fft.fftfreq(width))
    known = (frequency > 0) & (frequency <= 0.5)
    band = np.minimum((frequency[known] * 2 * bands).astype(int), bands - 1)
    number = np.bincount(band, minlength=bands)
    sums = (np.bincount(band, values, bands) for values in (frequency[known], power[known]))
    of_band, power_of_band = (total[number > 0] / number[number > 0] for total in sums)
    return of_band, power_of_band


def mean_flip(reference: Image, image: Image) -> float:
    """Mean ꟻLIP of the images as shown (sRGB, clipped), 0 to 1."""
    import flip_evaluator

    shown = [srgb(rgb(x)).astype(np.float32) for x in (reference, image)]
    _, mean, _ = flip_evaluator.evaluate(*shown, "LDR", inputsRGB=True, applyMagma=False, computeMeanError=True)
    return float(mean)
