"""Voronoi cells of points on circles, lines, spheres and the like: all of them are as far from one place."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

import voroquad as vq


def on_circle(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    return 0.5 + 0.4 * np.stack([np.cos(angles), np.sin(angles)], axis=-1)


def area_to(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """What the unit square holds between angles 0 and `angle`, as its centre sees them."""
    eighth = np.pi / 4
    quarters, rest = np.divmod(angle + eighth, 2 * eighth)
    return (quarters + np.tan(rest - eighth) / 2 + 0.5) / 4


def areas_on_circle(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Exact areas of cells of points on a circle about the centre: wedges, which end halfway to the next points."""
    order = np.argsort(angles)
    turned = angles[order]
    ends = area_to((turned + np.append(turned[1:], turned[0] + 2 * np.pi)) / 2)
    areas = np.empty_like(angles)
    areas[order] = np.diff(ends, prepend=ends[-1] - 1)
    return areas


def walks(rng: np.random.Generator, sets: int, n: int) -> NDArray[np.float64]:
    """Angles on a circle, many of them close to others: steps of 1e-9 to 1, and some anywhere."""
    steps = rng.choice([-1, 1], (sets, n)) * 10.0 ** -rng.uniform(0, 9, (sets, n))
    return np.where(rng.random((sets, n)) < 0.3, rng.uniform(0, 2 * np.pi, (sets, n)), np.cumsum(steps, axis=1))


def test_four_points_of_a_circle():
    """Inverted about the first, they lie on a line, which one of them is far along."""
    points = np.array(
        [
            [0.7836896417806043, 0.781993239540228],
            [0.7904025486219748, 0.7750751892735177],
            [0.7835976678083971, 0.7820857366362894],
            [0.7908310747862595, 0.7746220783889547],
        ]
    )
    angles = np.arctan2(*(points - 0.5).T[::-1]) % (2 * np.pi)
    np.testing.assert_allclose(vq.cells(points).measures, areas_on_circle(angles), rtol=1e-8)


@pytest.mark.parametrize(("sets", "n"), [(8000, 40), (1000, 150)])
@pytest.mark.parametrize("domain", ["square", "torus", "small"])
def test_measures_of_points_on_circles_sum_to_one(sets, n, domain):
    points = on_circle(walks(np.random.default_rng(n), sets, n))
    if domain == "small":
        points = 0.3 + points / 8
    measures = vq.cells(points, periodic=domain == "torus").measures
    assert (measures >= 0).all()
    assert np.abs(measures.sum(axis=1) - 1).max() <= 1e-12


@pytest.mark.parametrize("threads", [1, 3])
def test_many_points_on_a_circle(threads):
    rng = np.random.default_rng(3)
    angles = rng.permutation(np.arange(20_000) + 0.6 * rng.random(20_000)) * (2 * np.pi / 20_000)
    measures = vq.cells(on_circle(angles), threads=threads).measures
    np.testing.assert_allclose(measures, areas_on_circle(angles), rtol=0, atol=1e-11)


def curve(kind: str, n: int) -> NDArray[np.float64]:
    rng = np.random.default_rng(5)
    t, u = rng.random((2, n))
    around = on_circle(2 * np.pi * t).T
    if kind == "sphere":
        way = rng.normal(size=(n, 3))
        return 0.5 + 0.4 * way / np.linalg.norm(way, axis=1, keepdims=True)
    shapes = {
        "tilted line": [0.485 + 0.03 * t, 0.39 + 0.017 * t],
        "parabola": [0.1 + 0.7 * t, 0.2 + 0.5 * t**2],
        "spiral": 0.5 + (t + 0.1) * (around - 0.5),
        "circle and more": np.where(u < 0.5, around, rng.random((2, n))),
        "cylinder": [*around, 0.1 + 0.8 * u],
        "cone": [*(0.5 + u * (around - 0.5)), 0.1 + 0.8 * u],
        "tilted plane": [0.485 + 0.03 * t, 0.49 + 0.03 * u, 0.4 + 0.01 * t + 0.02 * u],
        "circle in space": [*around, 0.2 + 0.3 * around[0]],
    }
    return np.stack(list(shapes[kind]), axis=-1)


PLANE = ["tilted line", "parabola", "spiral", "circle and more"]
SPACE = ["sphere", "cylinder", "cone", "tilted plane"]


@pytest.mark.parametrize(("kind", "periodic"), [*product(PLANE + SPACE, [False, True]), ("circle in space", False)])
def test_no_site_that_cuts_is_left_out(kind, periodic):
    """A cell that misses a cut is too large. From 1024 points on, nodes of the tree know how their points are bent."""
    measures = vq.cells(curve(kind, 1500), periodic=periodic).measures
    assert (measures >= 0).all()
    assert abs(measures.sum() - 1) <= 1e-12
