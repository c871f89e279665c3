"""Bodies and surfaces to integrate over: smooth maps from the unit box, with their volume elements."""

from __future__ import annotations

import math
from typing import Any, NoReturn, Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull, Delaunay, QhullError

from .._support.arrays import Array
from .._support.checks import real_numbers
from .._support.gammas import power_of_pi_over_gamma
from .._support.products import rows_times
from .corners import (
    area,
    near_one,
    neighbours_on_line,
    numbers_of_corners,
    points,
    refuse_out_of_range,
    ring,
    scaled_volume,
)
from .pieces import Part
from .regions import Region
from .round_maps import ball_of_cube, directions
from .trapezoids import trapezoids

#: Up to this dimension of the box maps are smooth, above it points are uniform (benchmarks/domain_maps.py).
SMOOTH = 3

#: Samples, by dimension, of fewer of which uniform points have less error than those of a smooth map
#: (benchmarks/domain_maps.py). In a ball the smooth map is ahead, or about as good, with any number.
FEW_IN_SIMPLEX, FEW_ON_SPHERE = {2: 24, 3: 160}, {2: 48, 3: 600}

#: A simplex with a smaller share of its polytope's volume, or a polygon of the rectangle around it, is flat by rounding
FLAT, THIN = 1e-14, 1e-15
#: How much of its convex hull a convex polytope may lack by rounding, and how much of its radius the border of a ball
HOLLOW, FAR = 1e-9, 1e-8
#: What a power of a radius is below: no area of a unit sphere, nor volume element of a map to it, is above 2^6
LARGEST_POWER = 2.0**1018


class HasUniformMap(Protocol):
    """A domain with a smooth map and one that makes points uniform."""

    @property
    def d(self) -> int:
        """Dimension of the unit box."""

    def mapped(self, u: Array, uniform: bool) -> tuple[Array, Array]:
        """Points and the volume element at u of the unit box."""


class Uniform:
    """A domain by the map that makes points uniform: constants have no error, however few the samples are."""

    empty = False

    def __init__(self, domain: HasUniformMap):
        self._domain = domain

    @property
    def d(self) -> int:
        """Dimension of the unit box."""
        return self._domain.d

    def pull_back(self, u: Array) -> tuple[Array, Array]:
        """Points x (k, n) and the volume element (n,) at u (d, n) of the unit box."""
        return self._domain.mapped(u, uniform=True)


class Simplex:
    r"""Triangle, tetrahedron, …: the convex hull of k + 1 points in R^d, k ≤ d. Where k < d it is a surface.

    Parameters
    ----------
    vertices : array_like, (k + 1, d)
        Its corners.

    Raises
    ------
    ValueError
        Too few or too many corners, or corners that span less than k dimensions.

    Notes
    -----
    For k ≤ 3 the map is x = v_0 + u_1 (v_1 − v_0) + u_1 u_2 (v_2 − v_1) + …, with the volume element
    k! \|S\| u_1^(k−1) u_2^(k−2) … u_{k−1}: which are polynomials, so smooth functions stay smooth and every rule keeps
    its rate. (No smooth map of a square onto a triangle has a constant volume element.) For larger k, and for fewer
    than 24 samples of a triangle or 160 of a tetrahedron, uniform points matter more than smoothness. There u_i is
    replaced by u_i^(1/(k−i+1)), which makes the points uniform.

    Examples
    --------
    >>> import voroquad as vq
    >>> corner = vq.Simplex([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> r = vq.quad(lambda x: x[0] * x[1] * x[2], corner, rng=7)
    >>> bool(abs(r.integral - 1 / 720) < 5 * r.standard_error)
    True
    """

    empty = False

    def __init__(self, vertices: ArrayLike):
        self.vertices = points("vertices", vertices)
        k, d = len(self.vertices) - 1, self.vertices.shape[1]
        if not 1 <= k <= d:
            raise ValueError(f"vertices must be 2 to {d + 1} points of R^{d}, got {k + 1}")
        scaled, exponent = near_one(self.vertices)
        edges, to_edges = near_one(np.diff(scaled, axis=0))
        # The product of the edges' heights over those before. The determinant of edges·edgesᵀ has half the digits.
        volume = float(np.abs(np.diag(np.linalg.qr(edges.T)[1])).prod()) / math.factorial(k)
        sizes = np.linalg.norm(edges, axis=1)
        if not volume > 1e-15 * np.prod(sizes):
            raise ValueError(f"vertices must span {k} dimensions, got {self.vertices.tolist()}; move or drop a vertex")
        self.volume = scaled_volume("vertices", volume, k * (exponent + to_edges), self.vertices.tolist())
        self._edges, self._powers = np.diff(self.vertices, axis=0), np.arange(k - 1, -1, -1.0)

    def for_cells(self) -> dict[str, Any]:
        """The arguments of :func:`voroquad.cells` for this domain."""
        if self.d < self.vertices.shape[1]:
            raise ValueError(f"domain is a surface in R^{self.vertices.shape[1]}; cells fill one of d + 1 corners")
        return {"bounds": np.sort(self.vertices[:, 0])} if self.d == 1 else {"domain": self.vertices}

    @property
    def d(self) -> int:
        """Dimension of the simplex, k."""
        return len(self.vertices) - 1

    def for_samples(self, n: int) -> Region:
        """The map for n samples."""
        return Uniform(self) if n < FEW_IN_SIMPLEX.get(self.d, 0) else self

    def pull_back(self, u: Array) -> tuple[Array, Array]:
        """Points x (d, n) and the volume element (n,) at u (k, n) of the unit box."""
        return self.mapped(u, uniform=self.d > SMOOTH)

    def mapped(self, u: Array, uniform: bool) -> tuple[Array, Array]:
        """The same by the smooth map, or by that which makes points uniform."""
        powers = self._powers[:, None]
        if uniform:
            u, element = u ** (1 / (powers + 1)), np.full(u.shape[1], self.volume)
        else:
            element = self.volume * math.factorial(self.d) * np.prod(u**powers, axis=0)
        return self.vertices[0][:, None] + rows_times(np.cumprod(u, axis=0).T, self._edges).T, element


class Triangle(Simplex):
    """Triangle in the plane or in space.

    Parameters
    ----------
    vertices : array_like, (3, d)
        Its corners, d ≥ 2.

    Examples
    --------
    >>> import voroquad as vq
    >>> r = vq.quad(lambda x: x[0] * x[1], vq.Triangle([[0, 0], [1, 0], [0, 1]]), rng=7)
    >>> round(24 * r.integral, 9)
    1.0
    """

    def __init__(self, vertices: ArrayLike):
        super().__init__(vertices)
        if self.d != 2:
            raise ValueError(f"vertices must be three points, got {len(self.vertices)}; vq.Simplex takes other numbers")


class SphereSurface:
    """The points at a distance from a centre: a circle, a sphere, … in R^d, d ≥ 2.

    Parameters
    ----------
    center : array_like, (d,)
        Its centre; the origin of space by default.
    radius : float
        Its radius.

    Raises
    ------
    ValueError
        The centre has fewer than two coordinates, or the radius is not positive.

    Notes
    -----
    Up to d = 4 the map is that of spherical coordinates: angles π u_1, …, π u_{d−2} and 2π u_{d−1}, with the volume
    element sin^(d−2)(π u_1) …, so that smooth functions stay smooth. (With cos θ in place of θ, points would be
    uniform, but smooth functions would have a square-root singularity at the poles.) Above d = 4, and for fewer than 48
    samples in d = 3 or 600 in d = 4, the angles are quantiles of these densities, so points are uniform.

    Examples
    --------
    >>> import math, voroquad as vq
    >>> r = vq.quad(lambda x: x[2] ** 2, vq.SphereSurface(), rng=7)
    >>> bool(abs(r.integral - 4 * math.pi / 3) < 5 * r.standard_error)
    True
    """

    empty = False

    def __init__(self, center: ArrayLike = (0.0, 0.0, 0.0), radius: float = 1.0):
        self.center = _center(center, 2)
        self.radius = _radius(radius, len(self.center))

    def for_cells(self) -> NoReturn:
        """There are no cells on a sphere, but their areas."""
        raise ValueError("domain is a surface; vq.sphere_weights(points) gives the areas of cells of unit vectors")

    @property
    def d(self) -> int:
        """Dimension of the surface."""
        return len(self.center) - 1

    @property
    def volume(self) -> float:
        """Length, area, …"""
        return 2 * power_of_pi_over_gamma((self.d + 1) / 2, (self.d + 1) / 2) * self.radius**self.d

    def for_samples(self, n: int) -> Region:
        """The map for n samples."""
        return Uniform(self) if n < FEW_ON_SPHERE.get(self.d, 0) else self

    def pull_back(self, u: Array) -> tuple[Array, Array]:
        """Points x (d, n) and the volume element (n,) at u (d − 1, n) of the unit box."""
        return self.mapped(u, uniform=self.d > SMOOTH)

    def mapped(self, u: Array, uniform: bool) -> tuple[Array, Array]:
        """The same by the smooth map, or by that which makes points uniform."""
        unit, element = directions(u, uniform)
        return self.center[:, None] + self.radius * unit, element * self.radius**self.d


class Ball:
    r"""The points closer to a centre than a radius: an interval, a disc, a ball, … in R^d.

    Parameters
    ----------
    center : array_like, (d,)
        Its centre; the origin of space by default.
    radius : float
        Its radius.

    Raises
    ------
    ValueError
        The centre has no coordinates, or the radius is not positive.

    Notes
    -----
    Up to d = 3 the map is x_i = R t_i (∫_0^1 Π_{j≠i} (1 − s t_j²) ds)^½ with t = 2u − 1, for which R² − \|x\|² is
    R² Π_i (1 − t_i²). In the plane x = R t_0 (1 − t_1²/2)^½ and y = R t_1 (1 − t_0²/2)^½ (Fong, *Analytical Methods for
    Squaring the Disc*, 2015). It is analytic on a neighbourhood of the box. Polar
    coordinates have a pole and an axis, near which smooth functions vary quickly with the angle; this map has none. Its
    volume element is largest at the centre and falls to 0 at the corners of the square or the edges of the cube.
    Above d = 3 points are uniform: the radius is R u_0^(1/d), and the angles are those of :class:`SphereSurface`.

    Examples
    --------
    >>> import math, voroquad as vq
    >>> r = vq.quad(lambda x: x[0] ** 2, vq.Ball([0, 0], 2), rng=7)
    >>> bool(abs(r.integral - 4 * math.pi) < 5 * r.standard_error)
    True
    """

    empty = False

    def __init__(self, center: ArrayLike = (0.0, 0.0, 0.0), radius: float = 1.0):
        self.center = _center(center, 1)
        self.radius = _radius(radius, len(self.center))

    def for_cells(self) -> dict[str, Any]:
        """The arguments of :func:`voroquad.cells` for this domain."""
        if np.finfo(float).eps * np.abs(self.center).max() > FAR * self.radius:
            raise ValueError(
                f"domain: rounding moves a border of radius {self.radius:g} about {self.center}; move all to 0"
            )
        bounds = np.column_stack([self.center - self.radius, self.center + self.radius])
        return {"bounds": bounds} if self.d == 1 else {"bounds": bounds, "domain": "ball"}

    @property
    def d(self) -> int:
        """Dimension."""
        return len(self.center)

    @property
    def volume(self) -> float:
        """Length, area, volume, …"""
        return power_of_pi_over_gamma(self.d / 2, self.d / 2 + 1) * self.radius**self.d

    def pull_back(self, u: Array) -> tuple[Array, Array]:
        """Points x (d, n) and the volume element (n,) at u (d, n) of the unit box."""
        return self.mapped(u, uniform=self.d > SMOOTH)

    def mapped(self, u: Array, uniform: bool) -> tuple[Array, Array]:
        """The same by the smooth map, or by that which makes points uniform."""
        if not uniform:
            x, element = ball_of_cube(2 * u - 1)
            element = 2**self.d * element
        else:
            unit, element = directions(u[1:], uniform=True)
            x, element = u[0] ** (1 / self.d) * unit, element / self.d
        return self.center[:, None] + self.radius * x, element * self.radius**self.d


class PolarBall(Ball):
    """A :class:`Ball` in polar or spherical coordinates, for integrands with a singularity, kink or peak at its centre.

    Parameters
    ----------
    center : array_like, (d,)
        Its centre; the origin of space by default. d ≥ 2.
    radius : float
        Its radius.

    Raises
    ------
    ValueError
        The centre has fewer than two coordinates, or the radius is not positive.

    Notes
    -----
    The radius is R u_0 and the angles are those of :class:`SphereSurface` (above d = 3 uniform on it). The volume
    element is R^d u_0^(d−1) sin^(d−2)(π u_1) … . So 1/r times it is bounded, and functions of the distance from the
    centre vary along one axis only. Other smooth functions have much more error than with :class:`Ball`, above all in
    space.

    Examples
    --------
    The mean of a Coulomb potential, 3/2:

    >>> import math, voroquad as vq
    >>> ball = vq.PolarBall()
    >>> r = vq.quad(lambda x: 1 / (x[0] ** 2 + x[1] ** 2 + x[2] ** 2) ** 0.5, ball, rng=7)
    >>> round(r.integral / ball.volume, 6)
    1.5
    """

    def __init__(self, center: ArrayLike = (0.0, 0.0, 0.0), radius: float = 1.0):
        super().__init__(_center(center, 2), radius)

    def mapped(self, u: Array, uniform: bool) -> tuple[Array, Array]:
        """As :meth:`pull_back` with smooth maps of the angles, or those that make directions uniform."""
        unit, element = directions(u[1:], uniform)
        scale = self.radius**self.d * u[0] ** (self.d - 1)
        return self.center[:, None] + self.radius * u[0] * unit, element * scale


class Polygon:
    """Polygon in the plane, convex or not, possibly with holes.

    Parameters
    ----------
    vertices : array_like, (m, 2)
        Its corners in order, clockwise or counter-clockwise.
    holes : sequence of array_like, (m_i, 2)
        Polygons that are cut out. They must lie inside and must not overlap.

    Raises
    ------
    ValueError
        Fewer than three corners, sides that cross, holes that overlap or lie outside, no area.

    Notes
    -----
    It is cut into trapezoids with two sides parallel to the y axis. Each is the image of the unit square, with the area
    element (x_1 − x_0) (y_1(x) − y_0(x)), and has its own samples, in proportion to its area. The estimate is the sum
    over the trapezoids. Neighbouring trapezoids with fewer than 16 samples each share a set, whose first coordinate
    selects the trapezoid.

    Examples
    --------
    A frame:

    >>> import voroquad as vq
    >>> frame = vq.Polygon([[0, 0], [3, 0], [3, 3], [0, 3]], holes=[[[1, 1], [2, 1], [2, 2], [1, 2]]])
    >>> r = vq.quad(lambda x: x[0] ** 2, frame, rng=7)
    >>> round(3 * r.integral, 9)  # 3 (27 − 7/3)
    74.0
    """

    def __init__(self, vertices: ArrayLike, holes: Any = ()):
        self.vertices = ring("vertices", vertices)
        self.holes = tuple(ring(f"holes[{i}]", hole) for i, hole in enumerate(holes))
        refuse_out_of_range("vertices", self.vertices)
        self.trapezoids = tuple(trapezoids([self.vertices, *self.holes]))
        self.volume = math.fsum(t.volume for t in self.trapezoids)
        expected = area(self.vertices) - math.fsum(area(hole) for hole in self.holes)
        if abs(self.volume - expected) > 1e-9 * area(self.vertices):
            raise ValueError(
                f"holes must lie inside the polygon and not overlap; outside minus holes is {expected:.6g}, but the "
                f"area within an odd number of rings {self.volume:.6g}"
            )
        if not self.volume > THIN * np.prod(np.ptp(self.vertices, axis=0)):
            raise ValueError("vertices, holes: the polygon has no area; move a vertex or drop a hole")

    @property
    def __geo_interface__(self) -> dict[str, Any]:
        """As GeoJSON, which Shapely, GeoPandas and :func:`voroquad.cells` take."""
        rings = [np.concatenate([ring, ring[:1]]).tolist() for ring in (self.vertices, *self.holes)]
        return {"type": "Polygon", "coordinates": rings}

    def parts(self) -> list[Part]:
        """The trapezoids, each with its share of the samples."""
        return [Part(t, t.volume / self.volume) for t in self.trapezoids]


class Polytope:
    """Polytope of R^d as a union of simplices.

    Parameters
    ----------
    vertices : array_like, (m, d)
        Points.
    simplices : array_like of int, (k, d + 1), optional
        Indices of the corners of simplices that do not overlap, such as those of a tetrahedral mesh. By default they
        are those of the Delaunay triangulation, whose union is the convex hull of the points.

    Raises
    ------
    ValueError
        The points span less than d dimensions, an index is out of range, or one of the given simplices is flat.

    Notes
    -----
    Each :class:`Simplex` has its own samples, in proportion to its volume. The estimate is the sum over the simplices.

    Examples
    --------
    >>> import voroquad as vq
    >>> octahedron = vq.Polytope([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    >>> r = vq.quad(lambda x: x[0] ** 2, octahedron, rng=7)
    >>> bool(abs(r.integral - 2 / 15) < 5 * r.standard_error), round(3 * octahedron.volume, 12)
    (True, 4.0)
    """

    def __init__(self, vertices: ArrayLike, simplices: ArrayLike | None = None):
        self.vertices = points("vertices", vertices)
        d = self.vertices.shape[1]
        if simplices is None:
            scaled = near_one(self.vertices)[0]
            try:
                found = neighbours_on_line(scaled) if d == 1 else Delaunay(scaled).simplices
            except (QhullError, ValueError) as error:
                raise ValueError(f"vertices must be {d + 1} points or more that span {d} dimensions") from error
            volumes = np.abs(np.linalg.det(np.diff(scaled[found], axis=1)))
            corners = self.vertices[found[volumes > FLAT * volumes.sum()]]
        else:
            corners = self.vertices[numbers_of_corners(simplices, self.vertices)]
        self.simplices = tuple(Simplex(c) for c in corners)
        refuse_out_of_range("vertices", self.vertices)
        self.volume = math.fsum(s.volume for s in self.simplices)

    @property
    def d(self) -> int:
        """Dimension."""
        return int(self.vertices.shape[1])

    def for_cells(self) -> dict[str, Any]:
        """The arguments of :func:`voroquad.cells` for this domain, if it is convex."""
        corners = np.unique(np.concatenate([s.vertices for s in self.simplices]), axis=0)
        if self.d == 1:
            hull_volume, arguments = float(np.ptp(corners)), {"bounds": corners[[0, -1], 0]}
        else:
            scaled, exponent = near_one(corners)
            hull = ConvexHull(scaled)
            hull_volume, arguments = math.ldexp(hull.volume, self.d * exponent), {"domain": corners[hull.vertices]}
        if abs(hull_volume - self.volume) > HOLLOW * hull_volume:
            raise ValueError(
                f"domain is a Polytope of volume {self.volume:.6g}, its convex hull has {hull_volume:.6g}; cells need "
                "a convex one, or in the plane a vq.Polygon"
            )
        return arguments

    def parts(self) -> list[Part]:
        """The simplices, each with its share of the samples."""
        return [Part(s, s.volume / self.volume) for s in self.simplices]


def _center(given: ArrayLike, least: int) -> Array:
    center = real_numbers("center", given)
    if center.ndim != 1 or center.size < least or not np.isfinite(center).all():
        raise ValueError(f"center must be {least} or more finite coordinates (d,), got {given!r}")
    return center


def _radius(given: float, d: int) -> float:
    radius = real_numbers("radius", given)
    if radius.ndim or not 0 < radius < math.inf:
        raise ValueError(f"radius must be a positive number, got {given!r}")
    with np.errstate(over="ignore", under="ignore"):
        power = float(radius**d)
    if not 0 < power < LARGEST_POWER:
        raise ValueError(f"radius must have a {d}-th power that is a positive number, got {given!r}; take other units")
    return float(radius)
