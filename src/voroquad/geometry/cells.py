"""Voronoi cells of points in a box or on a torus."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._support.checks import one_of, point_array, thread_count
from .bounds import Bounds, Periodic
from .convex import from_half_spaces, from_vertices
from .diagram import Cells
from .lattice import Lattice
from .lattice_cells import LatticeCells, LineCells
from .regions import RegionCells, is_region, region_of
from .round_cells import RoundCells

#: What `domain` can be
DOMAINS = "vertices (k, d), half-spaces (A, b), a polygon, a vq.Ball, vq.Simplex or vq.Polytope, 'ball' or 'cylinder'"


def cells(
    points: ArrayLike,
    *,
    bounds: ArrayLike | None = None,
    periodic: Periodic = False,
    domain: Any = None,
    cell: ArrayLike | None = None,
    threads: int | None = None,
) -> Cells:
    """Voronoi cells of points in a box, on a torus or lattice, or in another domain.

    Parameters
    ----------
    points : array_like, (n,), (n, d) or (sets, n, d), d = 1, 2 or 3
        Points of the domain. Points that coincide share their cell equally.
    bounds : array_like, (d, 2) or (2,), optional
        Lower and upper end of each side of the box, in the units of the points; a single pair applies to all axes. By
        default the unit box [0, 1]^d.
    periodic : bool or sequence of bool, (d,)
        False: cells end at the faces of the box. True: opposite faces are identified, as on a torus, and the upper end
        of an axis is its lower end. A single value for all axes, or one for each: ``[False, True]``.
    domain : optional
        The domain that the cells fill, if it is not a box:

        * an array of vertices (k, d), d = 2 or 3: the convex hull of these points, all of which must lie on its border;
        * a pair ``(A, b)`` of normals (m, d) and offsets (m,): the convex polygon or polytope of all x with A x ≤ b;
        * a polygon or multipolygon, with or without holes, of Shapely, GeoPandas or anything that has
          ``__geo_interface__``, such as :class:`voroquad.Polygon`, d = 2; needs the extra ``geo``. Such cells have
          `measures`, `centroids`, `locate`, `neighbours`, `geometries` and `plot`;
        * a :class:`voroquad.Ball`, d = 1 to 3, :class:`voroquad.Simplex` or convex :class:`voroquad.Polytope`;
        * ``"ball"``: the disc or ball that touches the sides of `bounds`, which must be equal; ``"cylinder"``, d = 3:
          the same in the first two axes, between the ends of the third, which may be periodic. Such cells have
          `measures` and `locate`, those of a disc also `plot`.
    cell : array_like, (d, d), optional
        Lattice vectors, one in each row, that repeat the points: the cells of a triclinic crystal. Points may lie
        anywhere within 2⁴² periods of the origin, in single precision within 2¹³. The vectors need not be reduced.
    threads : int, optional
        Number of threads; by default all processors, or what the environment variable
        VOROQUAD_NUM_THREADS says. The result does not depend on it.

    Returns
    -------
    Cells
        With ``measures`` (n,) or (sets, n), ``centroids`` (n, d), ``neighbours()``, ``locate(x)``, ``intervals()`` for
        d = 1, ``polygons()`` for d = 2, ``polyhedra()`` for d = 3 and ``triangulation()`` for both, all in the
        coordinates of the points. Each is computed on demand.

    Raises
    ------
    ValueError
        A point is NaN or outside the domain, d is not 1, 2 or 3, or arguments do not fit d or each other.
    ImportError
        Shapely is not installed, and `domain` needs it.

    Notes
    -----
    The cell of x_i is the set of all y no farther from x_i than from any other point,
    V_i = {y : \\|y − x_i\\| ≤ \\|y − x_j\\| for all j}. It is cut out by the half-spaces
    (x_j − x_i)·(y − x_i) ≤ \\|x_j − x_i\\|²/2 of the neighbours, nearest first, until every
    corner of the cell is closer than half the distance to all points not yet seen.

    Distances are Euclidean in the units of the points. Scaling each axis of a box that is not a cube to [0, 1] changes
    distances, and hence cells; give `bounds` instead.

    Points outside the box by no more than the rounding of their own type (float32 or float64) are moved onto its
    faces; on periodic axes they are wrapped.

    Examples
    --------
    >>> import voroquad as vq
    >>> vq.cells([0.25, 0.5, 0.75]).measures
    array([0.375, 0.25 , 0.375])
    >>> vq.cells([[0.25, 0.5], [0.75, 0.5]]).polygons()[0]
    array([[0.5, 1. ], [0. , 1. ], [0. , 0. ], [0.5, 0. ]])
    >>> vq.cells([[1.0, 0.5], [2.0, 0.5]], bounds=[(0, 4), (0, 1)]).measures
    array([1.5, 2.5])
    >>> vq.cells([[1.0, 0.5], [2.0, 0.5]], bounds=[(0, 4), (0, 1)], periodic=[True, False]).measures
    array([2., 2.])
    >>> vq.cells([[0.5, 0.25], [0.5, 1.0]], domain=[(0, 0), (2, 0), (0, 2)]).measures.round(6)
    array([1.054688, 0.945312])
    >>> vq.cells([[0.0, 0.0], [0.5, 0.3]], cell=[(1, 0), (0.5, 1)]).measures
    array([0.5, 0.5])
    """
    array = point_array(points)
    n, d = array.shape[-2:]
    if d > 3:
        remedy = "pass points.T if they are (d, n)" if n <= 3 else "weights(points) counts them by probes"
        raise ValueError(f"cells are computed for d = 1, 2 and 3, got d = {d}, points of shape {array.shape}; {remedy}")
    if domain is None and cell is None:
        box, crew = Bounds(d, bounds, periodic), thread_count(threads)
        return Cells(box.copied_to_core(points, crew), box, crew)
    if cell is not None:
        refuse_with("cell", bounds=bounds is not None, domain=domain is not None, periodic=np.any(periodic))
        return _of_lattice(points, d, Lattice(cell), thread_count(threads))
    if is_of_quad(domain):
        refuse_with("domain", bounds=bounds is not None, periodic=np.any(periodic))
        return cells(points, **shape_of(domain, d), threads=threads)
    if isinstance(domain, str):
        one_of("domain", domain, ("ball", "cylinder"))
        return RoundCells(points, Bounds(d, bounds, periodic), domain, thread_count(threads))
    refuse_with("domain", bounds=bounds is not None, periodic=np.any(periodic))
    if is_region(domain):
        return RegionCells(points, region_of(domain), thread_count(threads))
    if not isinstance(domain, list | tuple) and np.asarray(domain).dtype == object and np.ndim(domain) == 0:
        raise ValueError(f"domain must be {DOMAINS}, got {domain!r}")
    is_pair = isinstance(domain, tuple) and len(domain) == 2 and np.ndim(domain[0]) == 2
    convex = from_half_spaces(domain[0], domain[1], d) if is_pair else from_vertices(domain, d)
    crew = thread_count(threads)
    return Cells(convex.copied_to_core(points, crew), convex, crew)


def is_of_quad(domain: Any) -> bool:
    """Whether a domain is one that :func:`voroquad.quad` integrates over, and knows what it is for cells."""
    return hasattr(domain, "for_cells") and not isinstance(domain, type)


def shape_of(domain: Any, d: int) -> dict[str, Any]:
    """What `cells` takes for points in d dimensions and a domain of :func:`voroquad.quad`.

    ValueError if the domain has other dimensions, or cells cannot end at its border.
    """
    if domain.d != d:
        raise ValueError(f"domain is a {type(domain).__name__} with d = {domain.d}, the points have d = {d}")
    arguments: dict[str, Any] = domain.for_cells()
    return arguments


def _of_lattice(points: ArrayLike, d: int, lattice: Lattice, threads: int) -> Cells:
    if lattice.d != d:
        raise ValueError(f"cell has {lattice.d} lattice vectors, the points have d = {d}")
    if d == 1:
        return LineCells(points, lattice, threads)
    return LatticeCells(lattice.wrapped(lattice.read("points", points)), lattice, threads)


def refuse_with(name: str, **others: bool | np.bool_) -> None:
    """Raise ValueError if, beside the argument `name`, others are given that say where cells end."""
    for other, is_given in others.items():
        if is_given:
            raise ValueError(f"{name}= says where cells end; leave out {other}=")
