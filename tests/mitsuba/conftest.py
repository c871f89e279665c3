"""Every test starts in the rgb variant, whatever the one before it left."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import voroquad.mitsuba  # noqa: F401  (registers the plug-ins)


@pytest.fixture
def one_thread() -> Iterator[None]:
    """Small renders wait less beside other tests. Not for what writes images: Mitsuba's EXR writer needs two."""
    before = dr.thread_count()
    dr.set_thread_count(1)
    yield
    dr.set_thread_count(before)


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


BALL = """<scene version="3.0.0">
    <integrator type="direct"/>
    <sensor type="thinlens">
        <float name="aperture_radius" value="0.3"/> <float name="focus_distance" value="3"/>
        <transform name="to_world"> <lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/> </transform>
        <film type="hdrfilm">
            <integer name="width" value="32"/> <integer name="height" value="24"/> <rfilter type="box"/>
        </film>
    </sensor>
    <shape type="sphere"/>
    <emitter type="directional"> <vector name="direction" value="-1, -1, -2"/> </emitter>
</scene>"""


@pytest.fixture(scope="session")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene that compiles fast: a sphere in the sun, out of focus."""
    path = tmp_path_factory.mktemp("scene") / "ball.xml"
    path.write_text(BALL)
    return path
