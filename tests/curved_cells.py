"""Measures of cells in discs, balls and cylinders by other formulas than the core's.

In a disc the boundary of a cell is walked around with 60 digits. In space the areas of slices are integrated between
all heights at which their shape changes.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator

import mpmath as mp
import numpy as np

DIGITS = 60


# ---------------------------------------------------------------------- discs


def areas_in_disc(points: np.ndarray, centre: np.ndarray, radius: float) -> np.ndarray:
    """Areas (n,) of the parts of cells in a disc; points that coincide share."""
    with mp.workdps(DIGITS):
        sites = [tuple(mp.mpf(float(c)) - mp.mpf(float(m)) for c, m in zip(p, centre, strict=True)) for p in points]
        area = {site: float(_area_in_disc(site, set(sites) - {site}, mp.mpf(float(radius)))) for site in set(sites)}
        return np.array([area[site] / sites.count(site) for site in sites])


def _area_in_disc(site: tuple, others: set, radius: mp.mpf) -> mp.mpf:
    x, y = site
    to_rim = max(radius**2 - x * x - y * y, mp.mpf(0))
    lines = [(2 * (u - x), 2 * (v - y), (u - x) ** 2 + (v - y) ** 2) for u, v in others]

    def on_rim(c: mp.mpf, s: mp.mpf) -> mp.mpf:
        along = x * c + y * s
        return mp.sqrt(along**2 + to_rim) - along

    angles = sorted({_turn(a) for a in _angles(site, lines, radius)})
    total = mp.mpf(0)
    for first, last in zip(angles, [*angles[1:], angles[0] + 2 * mp.pi], strict=True):
        if last - first < mp.mpf(10) ** (10 - DIGITS):
            continue
        (c, s), (c1, s1), (c2, s2) = (mp.cos_sin(t) for t in ((first + last) / 2, first, last))
        distance, line = min(
            ((b / (p * c + q * s), (p, q, b)) for p, q, b in lines if p * c + q * s > 0), default=(mp.inf, None)
        )
        if line is not None and distance < on_rim(c, s):
            p, q, b = line
            r1, r2 = b / (p * c1 + q * s1), b / (p * c2 + q * s2)
            total += r1 * r2 * mp.sin(last - first) / 2
        else:
            r1, r2 = on_rim(c1, s1), on_rim(c2, s2)
            p1, p2 = (x + r1 * c1, y + r1 * s1), (x + r2 * c2, y + r2 * s2)
            turn = _turn(mp.atan2(p2[1], p2[0]) - mp.atan2(p1[1], p1[0]))
            turn = mp.mpf(0) if turn > 2 * mp.pi - mp.mpf(10) ** -12 else turn
            total += (radius**2 * turn + x * p1[1] - y * p1[0] + p2[0] * y - p2[1] * x) / 2
    return total


def _turn(angle: mp.mpf) -> mp.mpf:
    """The same direction, from 0 to 2π."""
    return angle - 2 * mp.pi * mp.floor(angle / (2 * mp.pi))


def _angles(site: tuple, lines: list, radius: mp.mpf) -> Iterator[mp.mpf]:
    """Directions from a site in which the border of its cell may change from one line to another or to the rim."""
    x, y = site
    for k in range(4):  # so that no part turns by more than a right angle, and those along the rim if it is on it
        yield (mp.atan2(y, x) if x or y else mp.mpf(0)) + k * mp.pi / 2
    for (p, q, b), (u, v, e) in itertools.combinations(lines, 2):
        cross = (p * e - u * b, q * e - v * b)
        if any(cross):
            yield mp.atan2(cross[0], -cross[1])
            yield mp.atan2(-cross[0], cross[1])
    for p, q, b in lines:
        length = mp.hypot(p, q)
        from_centre = (b + p * x + q * y) / length
        if abs(from_centre) < radius:
            half = mp.sqrt(radius**2 - from_centre**2)
            for side in (-half, half):
                yield mp.atan2(
                    from_centre * q / length + side * p / length - y, from_centre * p / length - side * q / length - x
                )


# ---------------------------------------------------------------------- balls and cylinders


def volumes_in_round(
    points: np.ndarray, radius: float, ends: tuple[float, float] | None = None, period: float | None = None
) -> np.ndarray:
    """Volumes (n,) in the ball about the origin, or in the cylinder about the third axis between two ends.

    With a period the cylinder's ends are one, and points have images beyond them.
    """
    shifts = [np.zeros(3)] if period is None else [np.array([0, 0, k * period]) for k in (-1.0, 0.0, 1.0)]
    sites, site, copies = np.unique(points, axis=0, return_inverse=True, return_counts=True)
    found = []
    for at in sites:
        images = np.concatenate([sites + shift for shift in shifts])
        q = images - at
        q = q[np.any(q != 0, axis=1)]
        planes = np.column_stack([2 * q, (q**2).sum(axis=1) + 2 * q @ at])
        low, high = (-radius, radius) if ends is None else ends
        low, high = (low, high) if period is None else (at[2] - period / 2, at[2] + period / 2)
        found.append(_volume(planes, radius, low, high, ball=ends is None))
    return (np.array(found) / copies)[site.ravel()]


def _volume(planes: np.ndarray, radius: float, low: float, high: float, *, ball: bool) -> float:
    heights = np.array([h for h in _heights(planes, radius, low, high, ball=ball) if low < h < high])
    heights = np.unique(np.concatenate([[low], heights, [high]]))
    total = 0.0
    for a, b in itertools.pairwise(heights):

        def rate(t: float, a: float = a, b: float = b) -> float:
            h = a + (b - a) * math.sin(math.pi / 2 * t) ** 2  # smooth where areas start as a root of the height
            disc = math.sqrt(max(radius**2 - h**2, 0.0)) if ball else radius
            return (b - a) * math.pi / 2 * math.sin(math.pi * t) * _slice(planes, h, disc)

        total += _integral(rate, 0.0, 1.0)
    return total


NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)


def _integral(f: Callable[[float], float], a: float, b: float, whole: float | None = None) -> float:
    """By Gauss's rule on halves, until halves no longer change it."""
    middle = (a + b) / 2
    whole = _gauss(f, a, b) if whole is None else whole
    left, right = _gauss(f, a, middle), _gauss(f, middle, b)
    if abs(left + right - whole) < 1e-14 or b - a < 1e-6:
        return left + right
    return _integral(f, a, middle, left) + _integral(f, middle, b, right)


def _gauss(f: Callable[[float], float], a: float, b: float) -> float:
    return (b - a) / 2 * sum(w * f(a + (b - a) / 2 * (x + 1)) for x, w in zip(NODES, WEIGHTS, strict=True))


def _heights(planes: np.ndarray, radius: float, low: float, high: float, *, ball: bool) -> Iterator[float]:
    """Where the shape of a slice may change."""
    caps = np.array([[0, 0, 1.0, low], [0, 0, 1.0, high]])
    for three in itertools.combinations(np.concatenate([planes, caps]), 3):
        a = np.array([p[:3] for p in three])
        if abs(np.linalg.det(a)) > 1e-12 * np.prod(np.linalg.norm(a, axis=1)):
            yield float(np.linalg.solve(a, [p[3] for p in three])[2])
    axes = slice(0, 3 if ball else 2)
    for p, q in itertools.combinations(planes, 2):
        along = np.cross(p[:3], q[:3])
        if not np.any(along):
            continue
        start = np.linalg.lstsq(np.array([p[:3], q[:3]]), np.array([p[3], q[3]]), rcond=None)[0]
        roots = np.roots(
            [(along[axes] ** 2).sum(), 2 * (along[axes] @ start[axes]), (start[axes] ** 2).sum() - radius**2]
        )
        yield from (float(start[2] + t * along[2]) for t in roots.real)
    for p in planes:
        length, across = np.linalg.norm(p[:3]), math.hypot(p[0], p[1])
        if ball:
            n, h = p[:3] / length, p[3] / length
            reach = math.sqrt(max(radius**2 - h**2, 0.0)) * across / length
            yield from (h * n[2] - reach, h * n[2] + reach)
        elif p[2]:
            yield from ((p[3] - radius * across) / p[2], (p[3] + radius * across) / p[2])
        if not across and p[2]:
            yield p[3] / p[2]


def _slice(planes: np.ndarray, height: float, radius: float) -> float:
    """The area at a height of what a disc has of the intersection of half-spaces."""
    corners = [(-radius, -radius), (radius, -radius), (radius, radius), (-radius, radius)]
    for a, b, c, d in planes.tolist():
        e = d - c * height
        inside = [e - a * x - b * y for x, y in corners]
        clipped = []
        for i, (x, y) in enumerate(corners):
            here, before, (u, v) = inside[i], inside[i - 1], corners[i - 1]
            if (here >= 0) != (before >= 0):
                share = before / (before - here)
                clipped.append((u + share * (x - u), v + share * (y - v)))
            if here >= 0:
                clipped.append((x, y))
        corners = clipped
    return sum(_sector(*corners[i - 1], *corners[i], radius) for i in range(len(corners)))


def _sector(x: float, y: float, u: float, v: float, radius: float) -> float:
    """The signed area that a disc about the origin has of the triangle from there to two corners."""
    dx, dy = u - x, v - y
    length2 = dx * dx + dy * dy
    if length2 == 0:
        return 0.0
    middle, cross = -(x * dx + y * dy) / length2, x * v - y * u
    inner = radius**2 / length2 - (cross / length2) ** 2
    if inner <= 0:
        return radius**2 / 2 * math.atan2(cross, x * u + y * v)
    root = math.sqrt(inner)
    first, last = max(0.0, middle - root), min(1.0, middle + root)
    if first >= last:
        return radius**2 / 2 * math.atan2(cross, x * u + y * v)
    p, q = (x + first * dx, y + first * dy), (x + last * dx, y + last * dy)
    arcs = math.atan2(x * p[1] - y * p[0], x * p[0] + y * p[1]) + math.atan2(q[0] * v - q[1] * u, q[0] * u + q[1] * v)
    return (cross * (last - first) + radius**2 * arcs) / 2
