"""Every test starts in the rgb variant, whatever the one before it left."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import mitsuba as mi
import numpy as np
import pytest

import voroquad.mitsuba  # noqa: F401  (registers the plug-ins)


@pytest.fixture(autouse=True)
def rgb():
    if mi.variant() != "llvm_ad_rgb":
        mi.set_variant("llvm_ad_rgb")


@pytest.fixture(scope="session")
def pixel_z() -> Callable[..., tuple[float, float]]:
    """How far the mean of independent images is from the truth: the excess of Σ z², and the largest |z|.

    z-scores are per pixel and channel; pixels without noise are left out. Σ z² of m pixels (t-distributed with n − 1
    degrees of freedom) has the mean m (n − 1) / (n − 3) and the standard deviation √(2m) · 1.1, times √3 as the
    channels go together. The excess is in those: below 5 for a correct program.
    """

    def excess(images: Sequence[np.ndarray], truth: np.ndarray, truth_variance: np.ndarray) -> tuple[float, float]:
        stack = np.stack(images)
        n = len(stack)
        mean, variance = stack.mean(0), stack.var(0, ddof=1) / n
        z = ((mean - truth) / np.sqrt(variance + truth_variance + 1e-12))[variance > 1e-9]
        spread = 1.1 * np.sqrt(3) * np.sqrt(2 / len(z))
        return float(abs(np.mean(z**2) * (n - 3) / (n - 1) - 1) / spread), float(np.abs(z).max())

    return excess
