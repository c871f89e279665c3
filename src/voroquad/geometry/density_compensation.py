"""Density compensation for MRI: weights for the samples of a non-Cartesian k-space trajectory."""

from __future__ import annotations

from collections.abc import Sized
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._support.arrays import Array
from .._support.checks import one_of, real_numbers, thread_count
from .bounds import Bounds, Periodic, type_of
from .cells import cells, is_of_quad, refuse_with, shape_of
from .k_space import (
    UNITS,
    Trajectory,
    cylinder_axis,
    radius_of,
    read_trajectory,
    refuse_uncovered,
    rim_of,
)
from .regions import is_region, region_of


def density_compensation(
    trajectory: ArrayLike,
    shape: tuple[int, ...] | None = None,
    *,
    rim: str = "auto",
    bounds: ArrayLike | None = None,
    periodic: Periodic = False,
    domain: Any = None,
    cell: ArrayLike | None = None,
    units: str = "cycles/voxel",
    threads: int | None = None,
) -> Array:
    """Voronoi weights of k-space samples.

    Parameters
    ----------
    trajectory : array_like, (shots, samples, d) or (n, d), d = 2 or 3
        Sample positions. In cycles per voxel k-space is the box [−½, ½]^d. A plane may be given with a third coordinate
        that is the same for all samples; it is treated as two-dimensional, unless `bounds`, `periodic`, `domain` or
        `cell` is given for three axes.
    shape : tuple of int, (d,), optional
        Shape of the image. It is needed for positions in ``"cycles/fov"``; otherwise it is only checked against d, so
        that the function can be called wherever (trajectory, shape) is passed.
    rim : {"auto", "box", "ball", "cylinder"}
        The domain in which the outermost cells end. ``"box"``: at the faces of [−½, ½]^d, or of `bounds`. ``"ball"``:
        at the disc or ball around the origin that the trajectory reaches (radial, spiral and koosh-ball data: nothing
        was measured beyond). ``"cylinder"``, d = 3: at the disc that the trajectory reaches in two axes; along the
        third, k-space is periodic from −½ to ½ (stacks of stars or spirals). ``"auto"``: the one that the trajectory
        fills, see Notes.
    bounds : array_like, (d, 2) or (2,), optional
        Ends of k-space on each axis, in the units of the trajectory, if less than the whole of [−½, ½] was measured.
        Cells end there. For ``"box"``, and for the axis of a ``"cylinder"``.
    periodic : bool or sequence of bool, (d,)
        Which axes of a box are periodic, by default none: grids with a line at −½ and none at ½.
    domain, cell : optional
        Another domain in place of `rim`, in the units of the trajectory: a convex polygon or polytope, also as a
        :class:`voroquad.Simplex` or :class:`voroquad.Polytope`, a polygon with holes, or the lattice vectors (d, d) by
        which k-space repeats, as in :func:`voroquad.cells`.
    units : {"cycles/voxel", "radians/voxel", "cycles/fov"}
        Unit of the positions: within [−½, ½], within [−π, π], or within [−N/2, N/2] for an image of N voxels along
        the axis, as in BART; ``"cycles/fov"`` (per field of view) needs `shape`.
    threads : int, optional
        Number of threads; all processors by default. The result does not depend on it.

    Returns
    -------
    ndarray, (n,)
        Weights w of the reconstruction Σ_j w_j s_j exp(2πi k_j·r), in the order of ``trajectory.reshape(-1, d)``, with
        k in cycles per voxel. They sum to the area or volume, in those units, of the domain that `rim` names. Samples
        at the same position, such as the centre that all spokes cross, share their cell.

    Raises
    ------
    ValueError
        A position is not finite or outside k-space, d is not 2 or 3, `shape` does not have d axes; with
        ``rim="ball"`` or ``"cylinder"`` all positions are the origin or on the axis; with ``"cylinder"`` an axis that
        is covered in part only, without `bounds`; with ``"auto"`` samples of a line or of a tilted plane in space;
        two arguments say where cells end.

    Notes
    -----
    The ball has the radius R = max \\|k\\|. The weights are the exact areas or volumes of the parts of the cells inside
    the ball or the cylinder. ``"auto"`` chooses the ball if R ≤ 1.2 max_a \\|k_a\\|; for a full square or cube that
    ratio is √d. In three dimensions it chooses the cylinder if the ratio is at most 1.2 in two of the axes only, or if
    the samples lie in a few planes that each fill a disc of the same radius. Otherwise it chooses the box.

    The cells of a stack are three-dimensional. If the planes are rotated against each other, it may be better to weight
    each plane by itself: pass the two coordinates of each plane.

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
    >>> grid = np.stack(np.meshgrid(*[np.arange(-2, 2) / 4] * 2), axis=-1)
    >>> vq.density_compensation(grid, periodic=True)[:3]
    array([0.0625, 0.0625, 0.0625])
    """
    one_of("rim", rim, ("auto", "box", "ball", "cylinder"))
    given = read_trajectory(trajectory, shape, units)
    if domain is not None or cell is not None:
        name = "domain" if cell is None else "cell"
        two = cell is not None and domain is not None
        refuse_with(name, rim=rim != "auto", bounds=bounds is not None, periodic=np.any(periodic), domain=two)
        return _in_domain(given, type_of(trajectory), domain, cell, threads)
    axes, all_axes = np.asarray(periodic, dtype=object), given.d
    wraps = bool(np.any(axes))
    if not ((wraps and axes.size == 3) or _rows(bounds) == 3 or (rim == "cylinder" and bounds is not None)):
        given = given.in_plane()
    if wraps:
        _refuse_periodic(rim)
        bounds = np.array([(-0.5, 0.5)] * given.d) * given.per_unit[:, None] if bounds is None else bounds
    if bounds is None:
        if rim == "cylinder" and given.d < all_axes:
            rim = "ball"
        others = " or ".join(repr(unit) for unit in UNITS if unit != units)
        sides = np.tile([-0.5, 0.5], (given.d, 1))
        given.refuse_outside(sides, f"say units={others} if it is in these, or scale it")
        rim = rim_of(given.positions) if rim == "auto" else rim
    else:
        sides = Bounds(given.d, bounds).sides / given.per_unit[:, None]
        given.refuse_outside(sides, "widen bounds= or drop the sample")
        rim = "box" if rim == "auto" else rim
    if rim == "box":
        inside = np.clip(given.positions, *sides.T)
        return cells(inside, bounds=sides, periodic=periodic, threads=threads).measures
    if rim == "cylinder":
        return _in_cylinder(given.positions, None if bounds is None else sides, thread_count(threads))
    if bounds is not None:
        raise ValueError("bounds= is for rim='box' and 'cylinder'; the ball ends where the trajectory does")
    return _in_ball(given.positions, thread_count(threads))


def _refuse_periodic(rim: str) -> None:
    if rim == "ball":
        raise ValueError("rim='ball' has no periodic axes; leave out periodic=, or give rim='box'")
    if rim == "cylinder":
        raise ValueError("rim='cylinder' is periodic along its axis unless bounds= gives its ends; leave out periodic=")


def _rows(bounds: Any) -> int:
    """How many rows bounds have; a single pair counts as two, numbers and None as none."""
    return len(bounds) if isinstance(bounds, Sized) and np.iterable(bounds) else 0


def _in_domain(
    given: Trajectory, dtype: np.dtype[Any], domain: Any, cell: ArrayLike | None, threads: int | None
) -> Array:
    """Weights in a domain or on a lattice that is given in the units of the trajectory."""
    if cell is not None:
        vectors = real_numbers("cell", cell)
        given = _as_given(given, "cell", vectors, "one lattice vector in each row (d, d)")
        if vectors.shape != (given.d, given.d):
            raise ValueError(f"cell has shape {vectors.shape}; give d = {given.d} lattice vectors, one in each row")
        return cells(given.positions.astype(dtype), cell=vectors / given.per_unit, threads=threads).measures
    if is_of_quad(domain):
        if domain.d != given.d:
            given = given.in_plane()
        shape = shape_of(domain, given.d)
        domain = shape.get("domain", domain)
    if isinstance(domain, str):
        raise ValueError(_of_name(domain))
    if is_region(domain):
        given = given.in_plane()
        if given.d != 2:
            raise ValueError("domain is a polygon, the trajectory has d = 3; pass its two coordinates in the plane")
        region = region_of(domain)
        import shapely

        scaled: Any = shapely.transform(region, lambda corners: corners / given.per_unit)
    elif isinstance(domain, tuple) and len(domain) == 2 and np.ndim(domain[0]) == 2:
        normals = real_numbers("domain[0]", domain[0])
        given = _as_given(given, "domain[0]", normals, "normals (m, d)")
        scaled = normals * given.per_unit, domain[1]
    else:
        vertices = real_numbers("domain", domain)
        given = _as_given(given, "domain", vertices, "vertices (k, d)")
        scaled = vertices / given.per_unit
    return cells(given.positions.astype(dtype), domain=scaled, threads=threads).measures


def _as_given(given: Trajectory, name: str, array: Array, what: str) -> Trajectory:
    """The trajectory on as many axes as the rows of an array have; ValueError if it has not."""
    two = given if array.shape[-1:] == (3,) else given.in_plane()
    if array.ndim != 2 or array.shape[1] != two.d:
        raise ValueError(f"{name} has shape {array.shape}; the trajectory has d = {two.d} and needs {what}")
    return two


def _of_name(domain: str) -> str:
    if domain in ("ball", "cylinder"):
        return f"domain={domain!r}: say rim={domain!r}, the one that the trajectory reaches"
    return (
        f"unknown domain {domain!r}; a disc or ball is rim='ball', a cylinder rim='cylinder', "
        "and domain= takes vertices, half-spaces or a polygon"
    )


def _in_ball(positions: Array, threads: int) -> Array:
    radius = radius_of(positions)
    if radius == 0:
        raise ValueError('rim="ball" needs a trajectory that leaves the origin; use rim="box"')
    box = Bounds(positions.shape[1], (-radius, radius))
    inside = box.to_core(np.clip(positions, -radius, radius))
    centre = np.zeros(box.d)
    measures = _core.measures_in_ball(inside[None], *box.in_core, centre, box.length_in_core(radius), threads)
    return box.measures_from_core(measures)


def _in_cylinder(positions: Array, sides: Array | None, threads: int) -> Array:
    """Weights in the cylinder about the axis that fits best; its ends are those of `sides`, else it is periodic."""
    if positions.shape[1] != 3:
        raise ValueError('rim="cylinder" needs a trajectory in space, d = 3; a disc in the plane is rim="ball"')
    axis = cylinder_axis(positions)
    order = [*np.delete(np.arange(3), axis), axis]
    radius = radius_of(positions[:, order[:2]])
    if radius == 0:
        raise ValueError('rim="cylinder" needs a trajectory that leaves the axis; use rim="box"')
    if sides is None:
        refuse_uncovered(positions, axis)
    ends = (-0.5, 0.5) if sides is None else sides[axis]
    box = Bounds(3, [(-radius, radius), (-radius, radius), ends], [False, False, sides is None])
    inside = box.to_core(np.clip(positions[:, order], *box.sides.T))
    centre = np.zeros(2)
    measures = _core.measures_in_cylinder(inside[None], *box.in_core, centre, box.length_in_core(radius), threads)
    return box.measures_from_core(measures)
