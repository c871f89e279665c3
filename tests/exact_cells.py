"""Measures of cells by exact arithmetic: each cell is an intersection of half-spaces with whole coefficients."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

Row = tuple[int, ...]  # a half-space a·y ≤ c as (*a, c)


def exact_measures(points: np.ndarray, periodic: bool | list[bool], bounds: np.ndarray | None = None) -> np.ndarray:
    """Cell measures from exact half-spaces with whole coefficients, in the box (d, 2), by default the unit box."""
    d = points.shape[1]
    wraps = np.broadcast_to(periodic, (d,)).tolist()
    exact = [[Fraction(c) for c in point] for point in points.tolist()]
    box = [[Fraction(end) for end in side] for side in ([[0, 1]] * d if bounds is None else bounds.tolist())]
    unit = 2 * math.lcm(*(c.denominator for point in exact + box for c in point))
    sites = [tuple(int(c * unit) for c in point) for point in exact]
    sides = [[int(end * unit) for end in side] for side in box]
    turns = list(
        itertools.product(*([lo - hi, 0, hi - lo] if w else [0] for (lo, hi), w in zip(sides, wraps, strict=True)))
    )
    distinct = set(sites)
    measure = {}
    for site in distinct:
        half_spaces, reach = [], []
        for axis, (lo, hi) in enumerate(sides):
            to_faces = [(hi - lo) // 2] * 2 if wraps[axis] else [site[axis] - lo, hi - site[axis]]
            reach.append(to_faces)
            for side, to_face in zip((-1, 1), to_faces, strict=True):
                half_spaces.append([side * (a == axis) for a in range(d)] + [to_face])
        for other, turn in itertools.product(distinct - {site}, turns):
            q = [b + t - a for a, b, t in zip(site, other, turn, strict=True)]
            farthest = sum(max(-c * below, c * above) for c, (below, above) in zip(q, reach, strict=True))
            if sum(c * c for c in q) < 2 * farthest:  # else it misses the box
                half_spaces.append([*(2 * c for c in q), sum(c * c for c in q)])
        measure[site] = polytope_measure(half_spaces, unit)
    return np.array([measure[site] / sites.count(site) for site in sites])


def polytope_measure(half_spaces: list[list[int]], unit: int) -> float:
    """Length, area or volume, in units, of all y with a·y ≤ c for each row [*a, c]; a bounded set.

    The volume is a sum over faces, a d-th of height times area, and so on for the faces
    (J. B. Lasserre, "An analytical expression and an algorithm for the volume of a convex
    polyhedron in R^n", J. Optim. Theory Appl. 39, 1983). A face is measured where it is projected
    along a coordinate axis; only lengths are rounded.
    """
    rows = set()
    for row in half_spaces:
        if any(row[:-1]):
            divisor = math.gcd(*row)
            rows.add(tuple(c // divisor for c in row))
        elif row[-1] < 0:
            return 0.0  # no y at all
    if len(half_spaces[0]) == 2:
        a, c = least_fraction([(a, c) for a, c in rows if a > 0])
        b, e = least_fraction([(-a, c) for a, c in rows if a < 0])
        length = c * b + e * a  # from −e/b to c/a, times a b
        return length / (a * b * unit) if length > 0 else 0.0
    total = 0.0
    for face in rows:
        axis = max(range(len(face) - 1), key=lambda k: abs(face[k]))
        pivot = face[axis]
        sign = 1 if pivot > 0 else -1
        on_face = [
            [abs(pivot) * row[k] - sign * row[axis] * face[k] for k in range(len(face)) if k != axis]
            for row in rows
            if row != face
        ]
        if area := polytope_measure(on_face, unit):
            total += face[-1] / (abs(pivot) * unit) * area
    return total / (len(half_spaces[0]) - 1)


def least_fraction(ends: list[tuple[int, int]]) -> tuple[int, int]:
    """The least of the fractions c/a, each given as (a, c) with a > 0."""
    least = ends[0]
    for a, c in ends[1:]:
        if c * least[0] < least[1] * a:
            least = (a, c)
    return least


class ExactSites:
    """Points as whole numbers of a unit, and the half-spaces between them.

    Parameters
    ----------
    points : ndarray, (n, d)
        Points of a domain.
    others : sequence of arrays
        Numbers that the domain is made of: its corners, offsets or periods, in the same unit.
    """

    def __init__(self, points: np.ndarray, *others: Any):
        given = [Fraction(c) for array in (points, *others) for c in np.ravel(np.asarray(array, dtype=object)).tolist()]
        self.unit = 2 * math.lcm(*(c.denominator for c in given))
        self.sites = self.whole(points)

    def whole(self, numbers: Any) -> list[Row]:
        """Rows of numbers in units."""
        return [tuple(int(Fraction(c) * self.unit) for c in row) for row in np.asarray(numbers, dtype=object).tolist()]

    def bisectors(self, site: Row, shifts: Sequence[Row] = ()) -> list[list[int]]:
        """Of all y, relative to a site, that are no farther from it than from other sites and images of all."""
        d = len(site)
        images = {
            tuple(b + t - a for a, b, t in zip(site, other, shift, strict=True))
            for other in set(self.sites)
            for shift in ([(0,) * d, *shifts])
        } - {(0,) * d}
        return [[*(2 * c for c in q), sum(c * c for c in q)] for q in images]

    def measures(self, of_site: Any) -> np.ndarray:
        """The measure (n,) of each point, if points that coincide share that of their site."""
        found = {site: of_site(site) for site in set(self.sites)}
        return np.array([found[site] / self.sites.count(site) for site in self.sites])


def exact_measures_within(points: np.ndarray, normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Cell measures in the bounded domain of all x with normals (m, d) @ x ≤ offsets (m,), both whole.

    Points may lie outside, where rounding has put them.
    """
    exact = ExactSites(points)
    rows = [[*map(int, a), int(b)] for a, b in zip(normals, offsets, strict=True)]

    def of_site(site: Row) -> float:
        walls = [[*a, b * exact.unit - sum(x * y for x, y in zip(a, site, strict=True))] for *a, b in rows]
        return polytope_measure([*walls, *exact.bisectors(site)], exact.unit)

    return exact.measures(of_site)


def exact_areas_in_polygon(points: np.ndarray, rings: Sequence[np.ndarray]) -> np.ndarray:
    """Cell areas in a polygon (m, 2) and its holes: outer rings counter-clockwise, holes clockwise.

    What the polygon has of a cell is a sum of what triangles from one corner to all edges have of it, with the signs of
    the triangles.
    """
    exact = ExactSites(points, *rings)
    corners = [exact.whole(ring) for ring in rings]
    apex = corners[0][0]

    def of_site(site: Row) -> float:
        bisectors, total = exact.bisectors(site), 0.0
        for ring in corners:
            for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
                sides, sign = triangle(apex, a, b, site)
                if sign:
                    total += sign * polytope_measure([*sides, *bisectors], exact.unit)
        return total

    return exact.measures(of_site)


def triangle(a: Row, b: Row, c: Row, origin: Row) -> tuple[list[list[int]], int]:
    """Half-planes of a triangle, relative to an origin, and the sign of its area."""
    double = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    sign = (double > 0) - (double < 0)
    sides = []
    for p, q in ((a, b), (b, c), (c, a)):
        normal = (sign * (q[1] - p[1]), -sign * (q[0] - p[0]))  # to the right of the way around it
        sides.append([*normal, normal[0] * (p[0] - origin[0]) + normal[1] * (p[1] - origin[1])])
    return sides, sign


def exact_measures_on_lattice(points: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Cell measures of points that lattice vectors repeat: reduced ones, and points of the cell that they span."""
    d = len(vectors)
    exact = ExactSites(points, vectors)
    rows = exact.whole(vectors)
    counts = sorted(itertools.product(range(-2, 3), repeat=d), key=lambda k: sum(map(abs, k)))[1:]
    shifts = [tuple(sum(k * row[a] for k, row in zip(count, rows, strict=True)) for a in range(d)) for count in counts]
    # No place of a cell is farther from its site than half the diagonal of a box that its images make
    reach2 = d * max(sum(c * c for c in row) for row in rows)

    def of_site(site: Row) -> float:
        near = [row for row in exact.bisectors(site, shifts) if row[-1] <= reach2]
        return polytope_measure(near, exact.unit)

    return exact.measures(of_site)
