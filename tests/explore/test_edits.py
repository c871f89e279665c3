"""Samples moved, added and removed by hand."""

import numpy as np
import pytest

import voroquad as vq
from voroquad.explore.edits import ADDED, EditedSet


@pytest.fixture
def edited():
    return EditedSet(vq.sample("stratified", n=16, d=2, rng=3))


def test_the_drawn_set_stays_as_it_was(edited):
    drawn = edited.drawn.points.copy()
    edited.move(3, np.array([0.5, 0.5]))
    edited.remove(0)
    np.testing.assert_array_equal(edited.drawn.points, drawn)
    assert edited.edited


def test_origins_follow_the_points(edited):
    edited.remove(4)
    index = edited.add(np.array([0.1, 0.9]))
    edited.remove(0)
    assert index == 15
    assert edited.origin.tolist() == [1, 2, 3, *range(5, 16), ADDED]
    np.testing.assert_array_equal(edited.points[:-1], edited.drawn.points[edited.origin[:-1]])


def test_places_beyond_the_box_mean_its_border(edited):
    edited.move(0, np.array([-0.5, 1.5]))
    assert edited.points[0, 0] == 0
    assert 0.999 < edited.points[0, 1] < 1
    vq.weights(edited.points)


def test_nearest_within_reach(edited):
    place = edited.points[7] + [0.01, 0]
    assert edited.nearest(place, 0.02) == 7
    assert edited.nearest(place, 0.001) is None


def test_strata_must_keep_their_points(edited):
    assert edited.samples("stratified") is edited.drawn
    edited.move(0, edited.points[1])
    with pytest.raises(ValueError, match="each of the 4 × 4 strata must hold one point"):
        edited.samples("stratified")
    assert edited.samples(None).n == 16


def test_the_last_point_stays():
    edited = EditedSet(vq.sample("uniform", n=1, d=1, rng=1))
    with pytest.raises(ValueError, match="add one before"):
        edited.remove(0)
