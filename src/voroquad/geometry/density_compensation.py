"""Density compensation for MRI: what each sample of a non-Cartesian k-space trajectory stands for."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._support.checks import one_of, positive_int, refuse_lossy, thread_count
from .cells import cells

ROUNDING = 1e-6  # how far a position of a trajectory in float32 may miss the face it is on


def density_compensation(
    trajectory: ArrayLike,
    shape: tuple[int, ...] | None = None,
    *,
    rim: str = "auto",
    threads: int | None = None,
) -> NDArray[np.float64]:
    """Voronoi weights of k-space samples.

    Parameters
    ----------
    trajectory : array_like, (shots, samples, d) or (n, d), d = 2 or 3
        Sample positions in [−½, ½]^d, in cycles per voxel.
    shape : tuple of int, (d,), optional
        Shape of the image. Weights do not depend on it; it is checked against d, and makes the
        function callable wherever (trajectory, shape) is passed.
    rim : {"auto", "box", "ball"}
        Where the outermost cells end: at the faces of [−½, ½]^d, or at the disc or ball around the
        origin that the trajectory reaches (radial, spiral and koosh-ball data: nothing was measured
        beyond). By default the box for trajectories that fill its corners, else the ball.
    threads : int, optional
        Number of threads; all processors by default. The result does not depend on it.

    Returns
    -------
    ndarray, (n,)
        Weights w of the reconstruction Σ_j w_j s_j exp(2πi k_j·r), in the order of
        ``trajectory.reshape(-1, d)``. They sum to the area or volume of the box or ball. Repeated
        positions, such as the centre that all spokes cross, share their cell.

    Raises
    ------
    ValueError
        A position is not finite or outside [−½, ½]^d, d is not 2 or 3, `shape` does not have d
        axes, or with ``rim="ball"`` all positions are the origin.

    Notes
    -----
    The ball has the radius R = max \\|k\\|, and the weights are the exact areas or volumes of the
    cells' parts in it. A trajectory fills corners where R > 1.2 max_a \\|k_a\\|; for a full square or
    cube that ratio is √d. Planes of a stack are best weighed each on its own.

    References
    ----------
    V. Rasche, R. Proksa, R. Sinkus, P. Börnert and H. Eggers, "Resampling of data between
    arbitrary grids using convolution interpolation", IEEE Trans. Med. Imaging 18 (1999).

    Examples
    --------
    >>> import numpy as np, voroquad as vq
    >>> angle = np.pi * np.arange(64) / 64
    >>> radius = (np.arange(128) - 64) / 128
    >>> spokes = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None]
    >>> w = vq.density_compensation(spokes, (128, 128))
    >>> bool(abs(w.sum() - np.pi / 4) < 1e-12)
    True
    """
    one_of("rim", rim, ("auto", "box", "ball"))
    positions = _positions(trajectory, shape)
    largest = float(np.abs(positions).max())
    radius = largest * float(np.linalg.norm(positions / (largest or 1.0), axis=1).max())  # no square underflows
    if rim == "auto":
        rim = "ball" if 0 < radius <= 1.2 * largest else "box"
    if rim == "box":
        return cells(np.clip(positions + 0.5, 0, 1), threads=threads).measures
    if radius == 0:
        raise ValueError('rim="ball" needs a trajectory that leaves the origin; use rim="box"')
    in_unit_box = np.clip(positions / (2 * radius) + 0.5, 0, 1)
    return (2 * radius) ** positions.shape[1] * _core.measures_in_ball(in_unit_box[None], thread_count(threads))


def _positions(trajectory: ArrayLike, shape: tuple[int, ...] | None) -> NDArray[np.float64]:
    refuse_lossy("trajectory", trajectory)
    array = np.asarray(trajectory, dtype=np.float64)
    if array.ndim not in (2, 3) or array.shape[-1] not in (2, 3) or array.size == 0:
        raise ValueError(f"trajectory must have shape (shots, samples, d) or (n, d) with d = 2 or 3, got {array.shape}")
    positions = array.reshape(-1, array.shape[-1])
    outside = ~(np.abs(positions) <= 0.5 + ROUNDING).all(axis=1)
    if outside.any():
        first = int(np.argmax(outside))
        raise ValueError(
            f"sample {first} of the trajectory is {positions[first].tolist()}, not inside [-0.5, 0.5]; "
            "scale the trajectory to cycles per voxel"
        )
    if shape is not None and np.ndim(shape) != 1:
        raise ValueError(f"shape must have a number for each axis, such as (64,) * {positions.shape[1]}, got {shape!r}")
    if shape is not None and len([positive_int("shape", n) for n in shape]) != positions.shape[1]:
        raise ValueError(f"shape {tuple(shape)} must have as many axes as the trajectory has: {positions.shape[1]}")
    return positions
