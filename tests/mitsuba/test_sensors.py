"""The moving camera: rays of the nested one, where it is at their time."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from voroquad.mitsuba.errors import one_line_errors

pytestmark = pytest.mark.usefixtures("one_thread")

POSES = [
    mi.ScalarTransform4f().look_at([0, 1, 5], [0, 0, 0], [0, 1, 0]),
    mi.ScalarTransform4f().look_at([1, 1.5, 4], [0.3, 0, 0], [0, 1, 0]),
]


def camera(kind="thinlens", pose=None, shutter=(0.0, 1.0)):
    lens = {"aperture_radius": 0.2, "focus_distance": 4.0} if kind == "thinlens" else {}
    film = {"type": "hdrfilm", "width": 16, "height": 12, "rfilter": {"type": "box"}}
    open_, close = shutter
    posed = {} if pose is None else {"to_world": pose}
    return {"type": kind, "film": film, "shutter_open": open_, "shutter_close": close} | lens | posed


def moving(**properties):
    poses = {"to_world@0": POSES[0], "to_world@1": POSES[1]}
    return mi.load_dict({"type": "moving", "camera": camera(), **poses, **properties})


@pytest.mark.parametrize("kind", ["perspective", "thinlens", "orthographic"])
@pytest.mark.parametrize("differential", [False, True])
def test_at_a_key_it_is_the_camera_in_that_pose(kind, differential):
    sensor = moving(camera=camera(kind))
    rng = np.random.default_rng(1)
    film, lens = (mi.Point2f(rng.random((2, 50)).astype(np.float32)) for _ in range(2))
    for time, pose in zip((0.0, 1.0), POSES, strict=True):
        still = mi.load_dict(camera(kind, pose))
        name = "sample_ray_differential" if differential else "sample_ray"
        (a, wa), (b, wb) = (
            getattr(s, name)(time=mi.Float(time), sample1=0.5, sample2=film, sample3=lens) for s in (sensor, still)
        )
        for part in ("o", "d", *(("o_x", "d_x", "o_y", "d_y") if differential else ())):
            np.testing.assert_allclose(np.array(getattr(a, part)), np.array(getattr(b, part)), atol=2e-5)
        np.testing.assert_allclose(np.array(a.time), time)
        np.testing.assert_array_equal(np.array(wa), np.array(wb))


def test_it_has_the_cameras_film_shutter_and_lens():
    sensor = moving(camera=camera(shutter=(0.25, 0.75)))
    assert list(sensor.film().size()) == [16, 12]
    assert (sensor.shutter_open(), sensor.shutter_open_time()) == (0.25, 0.5)
    assert sensor.needs_aperture_sample()
    assert not moving(camera=camera("perspective")).needs_aperture_sample()


def test_a_new_film_size_reaches_the_camera():
    directions = []
    for sensor in (moving(camera=camera("perspective")), mi.load_dict(camera("perspective", POSES[0]))):
        parameters = mi.traverse(sensor)
        parameters["film.size"] = [32, 8]
        parameters.update()
        assert list(sensor.film().size()) == [32, 8]
        ray, _ = sensor.sample_ray(time=mi.Float(0), sample1=0.5, sample2=mi.Point2f(0, 0), sample3=mi.Point2f(0.5))
        directions.append(np.array(ray.d))
    np.testing.assert_allclose(*directions, atol=1e-5)


POSE = mi.ScalarTransform4f()


@pytest.mark.parametrize(
    ("properties", "message"),
    [
        ({}, "needs one nested sensor"),
        ({"camera": camera()}, "two or more poses"),
        ({"camera": camera(), "to_world@0": POSE}, "two or more poses"),
        ({"camera": camera(), "to_world@0": POSE, "to_world@one": POSE}, "must be a time"),
        ({"camera": camera(), "to_world@0": POSE, "to_world@1": POSE, "fov@1": 3.0}, "two or more poses"),
        ({"camera": camera(), "to_world@0": POSE, "to_world@1": mi.ScalarTransform4f().scale(2)}, "must not scale"),
        ({"camera": camera(), "to_world@0": 1.0, "to_world@1": 2.0}, "two or more poses"),
        ({"camera": camera(), "to_world@0": POSE, "to_world@1": POSE, "fov": 3.0}, "fov"),
    ],
)
def test_bad_properties(properties, message):
    with pytest.raises(ValueError, match=message), one_line_errors():
        mi.load_dict({"type": "moving", **properties})
