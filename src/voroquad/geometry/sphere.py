"""The unit sphere: maps to it from the unit square, and areas of Voronoi cells on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree, QhullError, SphericalVoronoi

from .._support.arrays import Array, Indices
from .._support.checks import real_numbers, unit_points
from .cells import cells

RESOLUTION = 1e-6  # points nearer than that count as one; also the tolerance of unit lengths, as in float32
FLAT = 1e-9  # thickness over width of a set that counts as one of a circle
ROUNDING = 1e-14  # thickness, root mean square, that tells nothing


def sphere_points(u: ArrayLike) -> Array:
    """Map points of the unit square to the unit sphere, such that areas stay in proportion.

    Parameters
    ----------
    u : array_like, (n, 2) or (sets, n, 2)
        Points of [0, 1]^2.

    Returns
    -------
    ndarray, (n, 3) or (sets, n, 3)
        Unit vectors; uniform on the sphere where `u` is uniform in the square.

    Raises
    ------
    ValueError
        A point is NaN or outside the square, or does not have two coordinates.

    See Also
    --------
    sphere_weights : what each point counts.
    scipy.stats.uniform_direction : independent uniform points.

    Notes
    -----
    z = 1 − 2u_1 and the longitude 2πu_2: a zone of the sphere has an area in proportion to its height
    (Archimedes, "On the Sphere and Cylinder").

    Examples
    --------
    >>> import voroquad as vq
    >>> vq.sphere_points([[0.0, 0.5], [0.5, 0.25]]).round(12) + 0.0
    array([[0., 0., 1.],
           [0., 1., 0.]])
    """
    square = unit_points(u, closed=True, name="u")
    if square.shape[-1] != 2:
        raise ValueError(f"u must have shape (n, 2) or (sets, n, 2), got {square.shape}")
    z, longitude = 1 - 2 * square[..., 0], 2 * np.pi * square[..., 1]
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(longitude), r * np.sin(longitude), z], axis=-1)


def sphere_weights(points: ArrayLike) -> Array:
    """Quadrature weights of points of the unit sphere: the areas of their Voronoi cells.

    Parameters
    ----------
    points : array_like, (n, 3) or (sets, n, 3)
        Unit vectors, one set or a batch. Points nearer to each other than 1e-6 share one cell equally.

    Returns
    -------
    ndarray, (n,) or (sets, n)
        The weights w of the estimate Σ_i w_i f(x_i) of the mean of f over the sphere: the areas over
        4π, which sum to 1. Times 4π they are those of ∫ f dA.

    Raises
    ------
    ValueError
        The length of a point differs from 1 by more than 1e-6; the shape is wrong; points are so close that rounding
        destroys their cells.

    See Also
    --------
    sphere_points : points of the sphere from samples of the unit square.

    Notes
    -----
    The rule has order 0: w_i = \\|V_i\\|/4π with V_i = {y : y·x_i ≥ y·x_j for all j}. The sphere has no border, and a
    rotation of the points rotates their cells. So if the joint distribution of the points is invariant under rotations,
    G is constant and hence 1. The weights are therefore *unbiased*, without correction, for independent uniform points,
    and for any set after a random rotation (`scipy.spatial.transform.Rotation.random`).

    Cells are those of `scipy.spatial.SphericalVoronoi`. The cells of points on one circle, great or small, are lunes
    that meet at the poles of the circle, with areas in proportion to the arcs of the circle. (Three or fewer points
    always lie on a circle.)

    References
    ----------
    M. Caroli, P. de Castro, S. Loriot, O. Rouiller, M. Teillaud and C. Wormser, "Robust and efficient Delaunay
    triangulations of points on or close to a sphere", 2009: what SciPy computes.

    Examples
    --------
    >>> import numpy as np, voroquad as vq
    >>> x = vq.sphere_points(vq.sample("uniform", n=1000, d=2, rng=7).points)
    >>> w = vq.sphere_weights(x)
    >>> f = np.exp(x[:, 2])  # its mean over the sphere is sinh(1)
    >>> bool(abs(w @ f - np.sinh(1)) < abs(f.mean() - np.sinh(1)) / 10)
    True
    """
    x = _unit_vectors(points)
    return np.stack([_areas(one) for one in x]) if x.ndim == 3 else _areas(x)


def _unit_vectors(points: ArrayLike) -> Array:
    x = real_numbers("points", points)
    if x.ndim not in (2, 3) or x.shape[-1] != 3 or x.size == 0:
        raise ValueError(f"points must have shape (n, 3) or (sets, n, 3) with n ≥ 1, got {x.shape}")
    length = np.linalg.norm(x, axis=-1, keepdims=True)
    astray = ~(np.abs(length[..., 0] - 1) <= RESOLUTION)
    if astray.any():
        first = tuple(int(i) for i in np.argwhere(astray)[0])
        index = first[0] if len(first) == 1 else first
        raise ValueError(
            f"points[{index}] = {x[first].tolist()} is not a unit vector; "
            "divide points by np.linalg.norm(points, axis=-1, keepdims=True) or drop it"
        )
    return x / length


def _areas(x: Array) -> Array:
    """Shares (n,) of the sphere of unit vectors (n, 3)."""
    sites, site = _sites(x)
    areas = _cell_areas(x[sites])
    return (areas / (areas.sum() * np.bincount(site)))[site]


def _sites(x: Array) -> tuple[Indices, Indices]:
    """One point (m,) of each chain of points with links of at most RESOLUTION; each point's chain (n,)."""
    # Boxes of that size first, so that a crowd in one place has few pairs
    _, first, box = np.unique(np.round(x / RESOLUTION), axis=0, return_index=True, return_inverse=True)
    links = KDTree(x[first]).query_pairs(RESOLUTION, output_type="ndarray")
    if not len(links):  # as a rule, and much faster
        return first, box.reshape(-1)
    graph = coo_array((np.ones(len(links)), links.T), shape=(len(first), len(first)))
    _, chain = connected_components(graph, directed=False)
    _, representative = np.unique(chain, return_index=True)
    return first[representative], chain[box.reshape(-1)].astype(np.intp)


def _cell_areas(x: Array) -> Array:
    """Areas (m,) of the cells of distinct unit vectors (m, 3), up to a common factor."""
    _, extent, axes = np.linalg.svd(np.linalg.qr(x - x.mean(axis=0), mode="r"))
    if len(x) <= 3 or extent[2] <= max(FLAT * extent[1], ROUNDING * len(x) ** 0.5):  # a circle about axes[2]
        turns = 0.5 + np.arctan2(x @ axes[1], x @ axes[0]) / (2 * np.pi)
        return cells(turns % 1.0, periodic=True).measures
    try:
        areas = SphericalVoronoi(x, threshold=ROUNDING).calculate_areas()
    except (ValueError, QhullError):
        raise ValueError(f"points: cells of {len(x)} points this close are lost in rounding; thin the set") from None
    return np.maximum(areas, 0.0)
