"""Density compensation for MRI: what each sample of a non-Cartesian k-space trajectory stands for."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._checks import one_of, positive_int
from .cells import cells


def density_compensation(
    trajectory: ArrayLike,
    shape: tuple[int, ...] | None = None,
    *,
    rim: str = "box",
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
    rim : {"box", "ball"}
        Where the outermost cells end: at the faces of [−½, ½]^d, or at the disc or ball that the
        trajectory reaches (radial, spiral and koosh-ball data: nothing was measured beyond).
    threads : int, optional
        Number of threads; all processors by default. The result does not depend on it.

    Returns
    -------
    ndarray, (n,)
        Weights w of the reconstruction Σ_j w_j s_j exp(2πi k_j·r), in the order of
        ``trajectory.reshape(-1, d)``. They sum to the area or volume of the region. Repeated
        positions, such as the centre that all spokes cross, share their cell.

    Raises
    ------
    ValueError
        A position is not finite or outside [−½, ½]^d, d is not 2 or 3, `shape` does not have d
        axes, or with ``rim="ball"`` all positions are the origin.

    Notes
    -----
    With ``rim="ball"`` of radius R = max |k|, the cell of k ends at the plane that touches the
    ball at R k/|k|: the bisector of k and its mirror image (2R − |k|) k/|k|. The region is the
    polytope of those planes, which is the ball for a densely sampled rim.

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
    >>> w = vq.density_compensation(spokes, (128, 128), rim="ball")
    >>> bool(abs(w.sum() / (np.pi / 4) - 1) < 0.01)
    True
    """
    one_of("rim", rim, ("box", "ball"))
    positions = _positions(trajectory, shape)
    d = positions.shape[1]
    if rim == "box":
        return cells(positions + 0.5, threads=threads).measures
    images = _mirrored_in_ball(positions)
    everything = np.concatenate([positions, images])
    # Images lie up to twice as far out: cells of a box four times as wide, in units of that box
    return 4.0**d * cells(everything / 4 + 0.5, threads=threads).measures[: len(positions)]


def _positions(trajectory: ArrayLike, shape: tuple[int, ...] | None) -> NDArray[np.float64]:
    array = np.asarray(trajectory, dtype=np.float64)
    if array.ndim not in (2, 3) or array.shape[-1] not in (2, 3) or array.size == 0:
        raise ValueError(f"trajectory must have shape (shots, samples, d) or (n, d) with d = 2 or 3, got {array.shape}")
    positions = array.reshape(-1, array.shape[-1])
    outside = ~(np.abs(positions) <= 0.5).all(axis=1)
    if outside.any():
        first = int(np.argmax(outside))
        raise ValueError(
            f"sample {first} of the trajectory is {positions[first].tolist()}, not inside [-0.5, 0.5]; "
            "scale the trajectory to cycles per voxel"
        )
    if shape is not None and len([positive_int("shape", n) for n in shape]) != positions.shape[1]:
        raise ValueError(f"shape {tuple(shape)} must have as many axes as the trajectory has: {positions.shape[1]}")
    return positions


def _mirrored_in_ball(positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Images of the outer positions, mirrored in the planes that touch the ball they reach."""
    radius = np.linalg.norm(positions, axis=1)
    reach = radius.max() * (1 + 1e-9)  # beyond the outermost, which must not coincide with their images
    if reach == 0:
        raise ValueError('rim="ball" needs a trajectory that leaves the origin; use rim="box"')
    outer = radius > reach / 2
    return np.unique(positions[outer] * (2 * reach / radius[outer] - 1)[:, None], axis=0)
