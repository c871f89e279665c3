"""Moving objects: slices see the scene as it is at their time, and leave it as it was."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from voroquad.mitsuba.errors import one_line_errors

pytestmark = pytest.mark.usefixtures("one_thread")

T = mi.ScalarTransform4f
BALL = {
    "ball/to_world@0": T().translate([-0.5, 0, 0]).scale(0.6),
    "ball/to_world@1": T().translate([0.4, 0.3, 0]).scale(0.6),
}
BOX = {"box/to_world@0": T(), "box/to_world@1": T().translate([0.3, 0, 0]).rotate([0, 1, 0], 40)}
LAMP = {"sun/irradiance/value@0": 1.0, "sun/irradiance/value@1": 3.0}


def scene_dict(rfilter="box"):
    film = {"type": "hdrfilm", "width": 17, "height": 12, "rfilter": {"type": rfilter}, "pixel_format": "rgb"}
    eye = T().look_at([0, 1, 6], [0, 0, 0], [0, 1, 0])
    camera = {
        "type": "perspective",
        "fov": 35,
        "film": film,
        "to_world": eye,
        "shutter_open": 0.0,
        "shutter_close": 1.0,
    }
    return {
        "type": "scene",
        "sensor": camera,
        "ball": {"type": "sphere"},
        "box": {"type": "cube", "to_world": T().translate([1.2, -0.5, 0]).scale(0.4)},
        "floor": {"type": "rectangle", "to_world": T().translate([0, -1, 0]).rotate([1, 0, 0], -90).scale(5)},
        "sun": {"type": "directional", "direction": [-1, -2, -1], "irradiance": 1.0},
    }


def plugin(motion=BALL | BOX | LAMP, **properties):
    nested = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0}
    return mi.load_dict(
        {"type": "reweighted", "domain": "time", "jitter": False, "blend": "off", "nested": nested}
        | motion
        | properties
    )


def image(scene, integrator, spp=16, seed=0):
    return np.array(mi.render(scene, integrator=integrator, spp=spp, seed=seed), dtype=np.float64)


def by_hand(times):
    """The mean of still images of the scene at these times, the ball, box and sun put in place one by one."""
    nested = {"type": "plain", "jitter": False, "nested": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0}}
    images = []
    for t in times:
        description = scene_dict()
        description["ball"]["to_world"] = T().translate([-0.5 + 0.9 * t, 0.3 * t, 0]).scale(0.6)
        description["box"]["to_world"] = (
            T().translate([0.3 * t, 0, 0]).rotate([0, 1, 0], 40 * t).translate([1.2, -0.5, 0]).scale(0.4)
        )
        description["sun"]["irradiance"] = 1 + 2 * t
        images.append(image(mi.load_dict(description), mi.load_dict(nested), 1))
    return np.mean(images, 0)


def test_slices_are_the_scene_at_their_times():
    """Regular sets: every pixel sees the times (i + ½)/8; a sphere, a mesh and a number move."""
    got = image(mi.load_dict(scene_dict()), plugin(sampler="regular", weighted=False), 8)
    np.testing.assert_allclose(got, by_hand((np.arange(8) + 0.5) / 8), rtol=1e-3, atol=2e-4)


def test_pixels_take_sets_of_the_half_of_a_checkerboard_they_lie_in(monkeypatch):
    integrator, halves = plugin(), []
    rows = type(integrator)._rows

    def noted(self, rng, half, spp):
        halves.append(half)
        return rows(self, rng, half, spp)

    monkeypatch.setattr(type(integrator), "_rows", noted)
    image(mi.load_dict(scene_dict()), integrator, 4)
    sides = range(integrator.interleave)
    assert halves == [(x + y) % 2 for y in sides for x in sides]


@pytest.mark.parametrize(("order", "together"), [("morton", True), ("none", False)])
def test_the_times_of_a_square_of_pixels_are_parts_of_one_set(monkeypatch, order, together):
    """Every pixel has one in each quarter of the time, the four of a square one in each sixteenth."""
    integrator, times = plugin(sampler="sobol", weighted=False), []
    kind = type(integrator)
    slices = kind._slices

    def noted(self, *arguments):
        *others, rows = arguments
        rows = list(rows)
        times.append([float(row[0]) for row in rows])
        return slices(self, *others, rows)

    monkeypatch.setattr(kind, "_slices", noted)
    description = scene_dict()
    description["sensor"]["sampler"] = {"type": "owensobol", "order": order}
    for seed in range(3):
        times.clear()
        mi.render(mi.load_dict(description), integrator=integrator, spp=4, seed=seed)
        drawn = np.array(times)
        assert drawn.shape == (4, 4)
        assert all(sorted(row) == [0, 1, 2, 3] for row in (drawn * 4).astype(int).tolist())
        if together:
            assert sorted((drawn * 16).astype(int).ravel()) == list(range(16))
            assert (np.argsort(drawn, axis=0)[:, 0] != np.argsort(drawn, axis=0)[:, 1:].T).any()
    assert together or len(set((drawn * 16).astype(int).ravel())) < 16


def test_designs_that_have_no_set_for_a_square_of_pixels_give_each_its_own():
    """Orthogonal arrays have 25 points, but not 100."""
    integrator = plugin(sampler="orthogonal", weighted=False)
    description = scene_dict()
    description["sensor"]["sampler"] = {"type": "owensobol", "order": "morton"}
    found = image(mi.load_dict(description), integrator, 25)
    np.testing.assert_allclose(found, by_hand((np.arange(25) + 0.5) / 25), atol=0.2)
    assert integrator._shared_times(mi.load_dict(description["sensor"]["sampler"]), 25, 0) == []


def test_times_that_pixels_share_are_unbiased():
    """Each time is uniform: the mean of f over images is its integral; that of the least time of a run is not."""
    integrator = plugin(sampler="sobol", weighted=False)
    own = mi.load_dict({"type": "owensobol", "sample_count": 4})
    integrator._n = 4
    drawn = np.array([integrator._shared_times(own, 8, seed) for seed in range(4000)])[..., 0]  # (seeds, pixels, spp)
    assert drawn.shape == (4000, 4, 8)
    f = (drawn**2).mean(-1)  # of each pixel
    z = (f.mean(0) - 1 / 3) / (f.std(0, ddof=1) / np.sqrt(len(f)))
    assert (np.abs(z) < 4).all()
    least = (np.sort(drawn, axis=1)[:, 0] ** 2).mean(-1)
    assert abs(least.mean() - 1 / 3) / (least.std(ddof=1) / np.sqrt(len(least))) > 4


def test_a_scene_is_left_as_it_was():
    scene = mi.load_dict(scene_dict())
    still = mi.load_dict({"type": "direct"})
    before = image(scene, still)
    image(scene, plugin())
    np.testing.assert_array_equal(image(scene, still), before)


def test_weights_lower_the_noise():
    scene = mi.load_dict(scene_dict())
    truth = image(scene, plugin(), 64)

    def mse(**properties):
        return np.mean([(image(scene, plugin(table_seed=k, **properties), 8, k) - truth) ** 2 for k in range(2)])

    assert mse(sampler="uniform") < mse(sampler="uniform", weighted=False) / 3


@pytest.mark.slow
def test_blend_wide_filters_and_lambda():
    """With pixel jitter and a wide filter: the image is that of many rays, whatever λ."""
    scene = mi.load_dict(scene_dict("tent"))
    common = {"jitter": True, "blend": "auto", "aovs": "lambda"}
    got = np.mean([image(scene, plugin(table_seed=k, **common), 8, k) for k in range(4)], 0)
    truth = image(scene, plugin(jitter=True, sampler="sobol", weighted=False), 64, 9)
    assert got.shape == (12, 17, 4)
    assert np.sqrt(np.mean((got[..., :3] - truth) ** 2)) < 0.05 * truth.max()
    assert (got[..., 3] >= 0).all()


def test_any_parameter_from_python():
    """A deformation no keyframe describes: the vertices of a mesh, as a function of time."""
    scene = mi.load_dict(scene_dict())
    start = np.array(mi.traverse(scene)["box.vertex_positions"])

    def taller(time):
        y = np.zeros_like(start)
        y[1::3] = 0.5
        return mi.Float(start) + time * mi.Float(y)

    integrator = plugin({}, slices=True, sampler="regular", weighted=False)
    integrator.motion["box.vertex_positions"] = taller
    got = image(scene, integrator, 2)
    stills = []
    for t in (0.25, 0.75):
        parameters = mi.traverse(scene)
        parameters["box.vertex_positions"] = taller(mi.Float(t))
        parameters.update()
        stills.append(image(scene, mi.load_dict({"type": "plain", "jitter": False, "nested": {"type": "direct"}}), 1))
    np.testing.assert_allclose(got, np.mean(stills, 0), rtol=1e-3, atol=2e-4)


def test_from_xml():
    integrator = mi.load_string("""
    <integrator type="reweighted" version="3.0.0">
        <string name="domain" value="time"/> <integrator type="direct"/>
        <transform name="ball/to_world@0"> <translate x="1"/> </transform>
        <transform name="ball/to_world@1"> <translate x="2"/> </transform>
    </integrator>""")
    assert "ball.to_world" in str(integrator)
    assert image(mi.load_dict(scene_dict()), integrator, 4).mean() > 0


def test_same_bits_on_any_number_of_threads():
    scene, integrator = mi.load_dict(scene_dict()), plugin(BALL)
    before, images = dr.thread_count(), []
    try:
        for threads in (1, 3):
            dr.set_thread_count(threads)
            images.append(image(scene, integrator, 6).tobytes())
    finally:
        dr.set_thread_count(before)
    assert images[0] == images[1]


@pytest.mark.parametrize(
    ("properties", "message"),
    [
        (
            {"boll/to_world@0": T(), "boll/to_world@1": T()},
            "no parameter 'boll.to_world' to move; near it are ball.to_world",
        ),
        ({"domain": "lens"}, "set domain to 'time'"),
        ({"sampler": "scene", "debias": "none"}, "sampler 'scene' has no table"),
        ({"sun/irradiance/value@0": 1.0}, "'sun.irradiance.value' has a value at one time only"),
        ({"interleave": 3}, "interleave must be an even number"),
        ({"shutter": 0.0}, "shutter_close"),
    ],
)
def test_bad_input(properties, message):
    description = scene_dict()
    description["sensor"]["shutter_close"] = properties.get("shutter", 1.0)
    given = {k: v for k, v in properties.items() if k != "shutter"}
    with pytest.raises(ValueError, match=message), one_line_errors():
        image(mi.load_dict(description), plugin(BALL | given))


def test_no_derivatives():
    with pytest.raises(NotImplementedError, match="moving objects"):
        plugin().render_forward(None, None)
