"""Keyframes against SciPy's interpolation of rotations."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from voroquad.mitsuba.motion import key_of_dict, make_track

pytestmark = pytest.mark.usefixtures("one_thread")

TIMES = [0.0, 0.25, 1.0]
TURNS = Rotation.from_euler("yxz", [[0, 0, 0], [80, 20, 0], [200, -30, 45]], degrees=True)
SHIFTS = np.array([[0, 1, 5], [1, 1, 5], [-2, 0.5, 4.0]])


def transforms(scale=1.0):
    matrices = np.tile(np.eye(4), (3, 1, 1))
    matrices[:, :3, :3] = TURNS.as_matrix() * scale
    matrices[:, :3, 3] = SHIFTS
    return [mi.ScalarTransform4f(m) for m in matrices]


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1)])
def test_transforms_follow_slerp_and_straight_lines(order):
    keys = list(zip(TIMES, transforms(), strict=True))
    track = make_track("to_world", [keys[k] for k in order])
    time = np.array([-1, 0, 0.1, 0.25, 0.4, 0.999, 1, 2])
    matrix = np.moveaxis(np.array(track.at(mi.Float(time)).matrix), -1, 0)
    inside = np.clip(time, 0, 1)
    np.testing.assert_allclose(matrix[:, :3, :3], Slerp(TIMES, TURNS)(inside).as_matrix(), atol=1e-5)
    shift = np.stack([np.interp(inside, TIMES, SHIFTS[:, axis]) for axis in range(3)], -1)
    np.testing.assert_allclose(matrix[:, :3, 3], shift, atol=1e-5)
    rotation, moved = track.pose(mi.Float(time))
    np.testing.assert_allclose(np.moveaxis(np.array(rotation), -1, 0), matrix[:, :3, :3], atol=1e-5)
    np.testing.assert_allclose(np.array(moved).T, matrix[:, :3, 3], atol=1e-6)


def test_scales_go_linearly_and_are_noticed():
    same = mi.ScalarTransform4f()
    track = make_track("to_world", [(0, same), (2, mi.ScalarTransform4f().scale([3, 1, 1]))])
    assert not track.rigid
    assert make_track("to_world", list(zip(TIMES, transforms(), strict=True))).rigid
    matrix = np.array(track.at(mi.Float(1.0)).matrix)[..., 0]
    np.testing.assert_allclose(matrix, np.diag([2, 1, 1, 1]), atol=1e-6)


def test_numbers_and_vectors_go_linearly():
    track = make_track("sun.irradiance.value", [(1, [1.0, 2.0, 3.0]), (0, [0.0, 0.0, 1.0])])
    got = np.array([np.array(c) for c in track.at(mi.Float([0.25, 3]))])
    np.testing.assert_allclose(got.T, [[0.25, 0.5, 1.5], [1, 2, 3]], atol=1e-6)
    assert np.array(make_track("x", [(0, 1.0), (1, 3.0)]).at(mi.Float(0.5))[0]) == pytest.approx(2)


def test_keys_that_contradict_each_other():
    with pytest.raises(ValueError, match=r"a@1 is given twice"):
        make_track("a", [(1, 2.0), (1, 3.0)])
    with pytest.raises(ValueError, match="must be transforms"):
        make_track("a", [(0, 2.0), (1, [1.0, 2.0])])
    with pytest.raises(ValueError, match="must be transforms"):
        make_track("a", [(0, 2.0), (1, mi.ScalarTransform4f())])


def test_times_are_decimals_or_fractions():
    assert [key_of_dict(f"a/b@{t}") for t in ("0.5", "1/2", "2", "-1.25")] == [
        "a/b@1/2",
        "a/b@1/2",
        "a/b@2",
        "a/b@-5/4",
    ]
    for time in ("one", "nan", "1/0", ""):
        with pytest.raises(ValueError, match=r"must be a time, such as a@0\.5"):
            key_of_dict(f"a@{time}")
