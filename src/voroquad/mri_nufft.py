"""Voronoi weights for mri-nufft: importing this module registers the density method ``"voroquad"``.

>>> import mrinufft, voroquad.mri_nufft  # doctest: +SKIP
>>> operator = mrinufft.get_operator("finufft")(trajectory, (256, 256), density="voroquad")  # doctest: +SKIP
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .geometry.density_compensation import density_compensation

try:
    from mrinufft.density.utils import register_density
except ImportError as error:
    raise ImportError(f"mri-nufft is missing ({error}); install it with: pip install 'voroquad[mri]'") from None


def voronoi_weights(samples: ArrayLike, shape: tuple[int, ...] | None = None, **options: Any) -> NDArray[np.float64]:
    """Weights (n,) of samples (shots, samples, d) or (n, d) in either of mri-nufft's units.

    Positions within [−½, ½] are cycles per voxel, others radians per voxel, in [−π, π]. `shape`
    and `options` are those of :func:`voroquad.density_compensation`, which does not guess.
    """
    positions = np.asarray(samples, dtype=np.float64)
    if np.abs(positions).max(initial=0) > 0.5 + 1e-4:  # mri-nufft's own test
        positions = positions / (2 * np.pi)
    return density_compensation(positions, shape, **options)


register_density("voroquad")(voronoi_weights)
