"""Cells in discs, balls and cylinders of any size and place."""

from __future__ import annotations

import numpy as np
import pytest

import voroquad as vq


def test_halves_and_segments():
    np.testing.assert_allclose(vq.cells([[1, 3], [3, 3]], bounds=[(0, 4), (1, 5)], domain="ball").measures, 2 * np.pi)
    segment = np.pi / 3 - 3**0.5 / 4  # of the unit disc beyond half its radius
    disc = vq.cells([[0.0, 0], [1, 0]], bounds=(-1, 1), domain="ball").measures
    np.testing.assert_allclose(disc, [np.pi - segment, segment])
    cap = np.pi * 0.25 * 2.5 / 3  # πh²(3R - h)/3
    ball = vq.cells([[0.0, 0, 0], [1, 0, 0]], bounds=(-1, 1), domain="ball").measures
    np.testing.assert_allclose(ball, [4 / 3 * np.pi - cap, cap])
    box = [(9, 11), (-1, 1), (0, 4)]
    np.testing.assert_allclose(
        vq.cells([[10.0, 0, 2], [11, 0, 2]], bounds=box, domain="cylinder").measures,
        [4 * np.pi - 4 * segment, 4 * segment],
    )
    stack = [[10.0, 0, 1], [10, 0, 3.5]]
    np.testing.assert_allclose(vq.cells(stack, bounds=box, domain="cylinder").measures, [2.25 * np.pi, 1.75 * np.pi])
    turned = vq.cells(stack, bounds=box, domain="cylinder", periodic=[False, False, True])
    np.testing.assert_allclose(turned.measures, [2 * np.pi, 2 * np.pi])
    np.testing.assert_array_equal(turned.locate([[10, 0, 0.1], [10, 0, 0.5]]), [1, 0])


@pytest.mark.parametrize(
    ("shape", "d", "whole"), [("ball", 2, 4 * np.pi), ("ball", 3, 32 / 3 * np.pi), ("cylinder", 3, 16 * np.pi)]
)
def test_fill_the_domain(shape, d, whole):
    rng = np.random.default_rng(d)
    axes = 2 if shape == "cylinder" else d
    points = rng.normal(size=(2, 300, d))
    points[..., :axes] *= rng.random((2, 300, 1)) ** (1 / axes) / np.linalg.norm(
        points[..., :axes], axis=-1, keepdims=True
    )
    points = np.clip(5 + 2 * points, 3, 7)
    cells = vq.cells(points, bounds=(3, 7), domain=shape)
    np.testing.assert_allclose(cells.measures.sum(axis=1), whole, rtol=1e-12)
    np.testing.assert_array_equal(cells.measures[1], vq.cells(points[1], bounds=(3, 7), domain=shape).measures)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"domain": "cylinder"}, "domain='cylinder' needs points in d = 3, got d = 2"),
        ({"domain": "ball", "bounds": [(0, 1), (0, 2)]}, "a ball touches its box"),
        ({"domain": "ball", "periodic": True}, "axes across a ball are not periodic"),
        ({"domain": "ball"}, r"points\[1\] = \[0.95, 0.95\] is outside the ball"),
    ],
)
def test_refuses(arguments, message):
    with pytest.raises(ValueError, match=message):
        vq.cells([[0.5, 0.5], [0.95, 0.95]], **arguments)


def test_refuses_the_line():
    with pytest.raises(ValueError, match="on a line give bounds="):
        vq.cells([0.5], domain="ball")


@pytest.mark.parametrize("what", ["centroids", "polygons", "neighbours", "triangulation", "geometries"])
def test_refuses_what_curved_cells_have_not(what):
    cells = vq.cells([[0.5, 0.5]], domain="ball")
    with pytest.raises(ValueError, match=f"cells in a ball have measures but no {what}"):
        found = getattr(cells, what)
        found()


def test_cells_in_a_ball_have_no_corners():
    with pytest.raises(ValueError, match=r"cells in a ball have measures but no geometries, .* no corners"):
        vq.cells([[0.5, 0.5, 0.5]], domain="ball").geometries()


@pytest.mark.parametrize(("shape", "d"), [("ball", 2), ("ball", 3), ("cylinder", 3)])
def test_locates_places_of_the_domain_only(shape, d):
    rim, beyond = np.full(d, 1.0), np.full(d, 1.0)
    rim[:2], beyond[:2] = (1.0 + 0.6, 1.0 + 0.8), (1.7, 1.8)
    cells = vq.cells([np.full(d, 1.0), np.full(d, 1.1)], bounds=(0, 2), domain=shape)
    np.testing.assert_array_equal(cells.locate([rim, np.full(d, 1.0)]), [1, 0])
    assert cells.locate(rim.astype(np.float32)) == 1
    with pytest.raises(ValueError, match=rf"x\[1\] = \[1.7, 1.8.*\] is outside the {shape}; drop it"):
        cells.locate([rim, beyond])
    with pytest.raises(ValueError, match=r"x\[0\] = \[nan"):
        cells.locate(np.full(d, np.nan))
