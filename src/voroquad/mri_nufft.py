"""Voronoi weights for mri-nufft: importing this module registers the density method ``"voroquad"``.

>>> import mrinufft, voroquad.mri_nufft  # doctest: +SKIP
>>> operator = mrinufft.get_operator("finufft")(trajectory, (256, 256), density="voroquad")  # doctest: +SKIP

Options of :func:`voronoi_weights` go into a dictionary:

>>> density = {"name": "voroquad", "rim": "cylinder", "units": "radians/voxel"}
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._support.arrays import Array
from ._support.checks import real_numbers
from ._support.extras import install_hint
from .geometry.density_compensation import density_compensation
from .geometry.k_space import radius_of

try:
    from mrinufft.density.utils import register_density
except ImportError as error:
    raise ImportError(f"mri-nufft is missing ({error}); {install_hint('mri')}") from None

SHORT_OF_BORDER = 0.02  # of the way to the border of k-space that a trajectory in a known unit may leave
ROUNDING = 2e-4  # relative, of what mri-nufft itself takes for positions within the border


def voronoi_weights(
    samples: ArrayLike, shape: tuple[int, ...] | None = None, *, units: str | None = None, **options: Any
) -> Array:
    """Weights (n,) of samples (shots, samples, d) or (n, d), for mri-nufft.

    Parameters
    ----------
    samples : array_like, (shots, samples, d) or (n, d), d = 2 or 3
        Sample positions.
    shape : tuple of int, (d,), optional
        Shape of the image.
    units : {"cycles/voxel", "radians/voxel", "cycles/fov"}, optional
        Unit of the positions. By default it is read off positions that reach the border of k-space to 2 %: 1/2 in
        cycles per voxel, π in radians per voxel. Operators of mri-nufft hand on positions in radians per voxel,
        whatever they were made with.
    **options
        Those of :func:`voroquad.density_compensation`, such as ``rim``.

    Returns
    -------
    ndarray, (n,)
        Weights in cycles per voxel, whatever the unit of the samples.

    Raises
    ------
    ValueError
        No unit is given and the samples do not tell it; and what :func:`voroquad.density_compensation` raises.

    Notes
    -----
    mri-nufft divides the results of ``op`` and of ``adj_op`` by ``norm_factor`` = √(2^d ∏ shape). With these weights
    ``adj_op(op(image))`` is therefore about image / norm_factor², which is image / (4N²) for N × N pixels: multiply by
    ``norm_factor ** 2``.
    """
    return density_compensation(samples, shape, units=_units_of(samples) if units is None else units, **options)


def _units_of(samples: ArrayLike) -> str:
    """The unit of positions that reach the border of k-space."""
    positions = real_numbers("samples", samples)
    largest = float(np.abs(positions).max(initial=0.0))
    reach = radius_of(positions.reshape(-1, positions.shape[-1])) if positions.ndim > 1 and positions.size else largest
    for units, border in (("cycles/voxel", 0.5), ("radians/voxel", math.pi)):
        if largest <= border * (1 + ROUNDING) and reach >= border * (1 - SHORT_OF_BORDER):
            return units
    raise ValueError(
        f"the unit of the samples cannot be inferred: coordinates up to {largest:.4g} reach neither 1/2 (cycles per "
        "voxel) nor π (radians per voxel, as mri-nufft's operators hand them on); name it, for operators as "
        "density={'name': 'voroquad', 'units': 'radians/voxel'}"
    )


register_density("voroquad")(voronoi_weights)
