"""A denoised image, by Intel's Open Image Denoise on the processor (extra ``denoise``)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._support.arrays import Array
from .._support.extras import install_hint


def check_denoiser() -> None:
    """Raise ImportError if the denoiser is not installed."""
    try:
        import mitsuba_oidn  # noqa: F401
    except ImportError as error:
        hint = install_hint("denoise")
        raise ImportError(f"denoising needs Open Image Denoise ({error}); {hint}", name="mitsuba_oidn") from None


def denoised(image: Array, channels: Sequence[str]) -> Array:
    """The colours of an image without its noise, and with the denoiser's bias.

    Parameters
    ----------
    image : ndarray, (height, width, channels)
        Linear radiance, then other channels. Values that are not finite count as 0.
    channels : sequence of str
        Their names. If ``albedo.R``, …, ``normal.Z`` are among them, they guide the denoiser.

    Returns
    -------
    ndarray, (height, width, 3) or, of a grey image, (height, width, 1)
    """
    import mitsuba_oidn

    def layer(*names: str) -> Array | None:
        if not set(names) <= set(channels):
            return None
        picked = image[..., [channels.index(name) for name in names]]
        return np.ascontiguousarray(np.where(np.isfinite(picked), picked, 0), dtype=np.float32)

    colours = layer("R", "G", "B")
    colours = layer(channels[0]) if colours is None else colours
    albedo, normal = layer("albedo.R", "albedo.G", "albedo.B"), layer("normal.X", "normal.Y", "normal.Z")
    found = mitsuba_oidn.denoise(colours, albedo, normal if albedo is not None else None, hdr=True)
    return np.asarray(found, np.float64).reshape(*image.shape[:2], -1)
