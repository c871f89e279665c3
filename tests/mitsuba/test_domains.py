"""Each domain: the sets sample it, the weights lower its noise, and nothing else changes."""

from __future__ import annotations

import dataclasses

import mitsuba as mi
import numpy as np
import pytest

from voroquad.mitsuba.domains import CameraSample, find_domain
from voroquad.mitsuba.errors import one_line_errors

pytestmark = pytest.mark.usefixtures("one_thread")

BOX = {"type": "box"}
FILM = {"type": "hdrfilm", "width": 16, "height": 12, "rfilter": BOX, "pixel_format": "rgb"}


def image(scene, spp=16, seed=0, **properties):
    integrator = mi.load_dict({"type": "reweighted", "nested": {"type": "direct"}, **properties})
    return np.array(mi.render(scene, integrator=integrator, spp=spp, seed=seed), dtype=np.float64)


def moving_scene(shutter_close=1.0):
    """A camera that passes a chequered wall in the sun: a ray's radiance is a function of time and pixel."""
    camera = {"type": "perspective", "film": FILM, "shutter_open": 0.0, "shutter_close": shutter_close, "fov": 50}
    look = mi.ScalarTransform4f()
    checks = {"type": "checkerboard", "to_uv": look.scale(6)}
    wall = {"type": "rectangle", "to_world": look.scale(3), "bsdf": {"type": "diffuse", "reflectance": checks}}
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {
                "type": "moving",
                "camera": camera,
                "to_world@0": look.look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
                "to_world@1": look.look_at([0.4, 0.1, 4], [0.2, 0, 0], [0.1, 1, 0]),
            },
            "wall": wall,
            "sun": {"type": "directional", "direction": [0, -1, -2]},
        }
    )


#: Spectrum of a lamp: two lines on a weak continuum
LAMP = [(360, 0.1), (540, 0.1), (546, 8.0), (552, 0.1), (605, 0.1), (611, 6.0), (617, 0.1), (830, 0.1)]


def lamp_scene():
    """A wall under a spiky lamp, no other noise."""
    look = mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
    lamp = {"type": "directional", "direction": [0, 0, -1], "irradiance": {"type": "spectrum", "value": LAMP}}
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {"type": "perspective", "to_world": look, "film": FILM},
            "wall": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(9)},
            "lamp": lamp,
        }
    )


def mse(scene, truth, spp=64, count=4, **properties):
    return np.mean([(image(scene, spp, k, table_seed=k, **properties) - truth) ** 2 for k in range(count)])


def test_time():
    scene = moving_scene()
    common = {"domain": "time", "jitter": False, "blend": "off"}
    truth = image(scene, 4096, sampler="stratified", **common)
    uniform = mse(scene, truth, sampler="uniform", weighted=False, **common)
    assert mse(scene, truth, sampler="uniform", **common) < uniform / 10
    assert mse(scene, truth, sampler="stratified", **common) < mse(
        scene, truth, sampler="stratified", weighted=False, **common
    )


@pytest.fixture
def spectral():
    mi.set_variant("llvm_ad_spectral")


@pytest.mark.usefixtures("spectral")
def test_wavelength():
    """Uniform 10 ×, stratified u (as Mitsuba's samplers draw it) 2 × above weighted sets."""
    scene = lamp_scene()
    common = {"domain": "wavelength", "jitter": False, "blend": "off"}
    truth = image(scene, 4096, sampler="stratified", **common)
    plain = {"type": "plain", "jitter": False, "nested": {"type": "direct"}}

    def of_mitsuba(sampler):
        integrator = mi.load_dict(plain | {"own": {"type": sampler}})
        images = [np.array(mi.render(scene, integrator=integrator, spp=64, seed=k)) for k in range(4)]
        return np.mean((np.stack(images) - truth) ** 2)

    assert mse(scene, truth, sampler="uniform", **common) < of_mitsuba("independent") / 10
    assert mse(scene, truth, sampler="stratified", **common) < of_mitsuba("multijitter") / 2


@pytest.mark.usefixtures("spectral")
def test_the_scenes_own_wavelengths():
    """What Mitsuba's sampler draws for u is weighed at 4u on the circle."""
    scene = lamp_scene()
    common = {"domain": "wavelength", "jitter": False, "blend": "off"}
    truth = image(scene, 4096, sampler="stratified", **common)
    own = common | {"sampler": "scene", "own": {"type": "multijitter"}}
    assert mse(scene, truth, **own) < mse(scene, truth, weighted=False, **own) / 2


def test_the_scenes_own_times():
    scene = moving_scene()
    common = {"domain": "time", "jitter": False, "blend": "off"}
    truth = image(scene, 4096, sampler="stratified", **common)
    own = common | {"sampler": "scene", "debias": "none", "own": {"type": "independent"}}
    assert mse(scene, truth, **own) < mse(scene, truth, weighted=False, **own) / 10


@pytest.mark.usefixtures("spectral")
def test_wavelengths_are_weighed_on_a_circle():
    """A function of the wavelength seen alike by all four: exact weights on the circle sum up the whole spectrum."""
    scene = lamp_scene()
    common = {"domain": "wavelength", "jitter": False, "blend": "off", "sampler": "uniform"}
    images = [image(scene, 64, k, table_seed=k, **common) for k in range(40)]
    truth = image(scene, 4096, domain="wavelength", jitter=False, blend="off")
    z = (np.mean(images, 0) - truth) / (np.std(images, 0, ddof=1) / np.sqrt(40))
    # 192 pixels of independent sets: the mean z² of 39 degrees of freedom is 39/37 ± .11
    assert abs(np.mean(z**2) - 39 / 37) < 0.6


def test_pixel():
    scene = moving_scene(shutter_close=0.0)
    common = {"domain": "pixel", "sampler": "uniform"}
    truth = image(scene, 8192, domain="pixel", sampler="sobol", weighted=False, samples=64)
    assert mse(scene, truth, blend="off", **common) < mse(scene, truth, weighted=False, **common) / 2


@pytest.mark.parametrize("blend", ["off", "auto"])
def test_pixel_and_time_jointly(blend):
    """Three dimensions, one set: below the same samples unweighted."""
    scene = moving_scene()
    joint = {"domain": "pixel+time", "sampler": "uniform"}
    truth = image(scene, 8192, **joint | {"sampler": "sobol", "weighted": False, "samples": 64})
    assert mse(scene, truth, blend=blend, **joint) < mse(scene, truth, weighted=False, **joint) / 1.3


def test_four_dimensions():
    """The weights sum to one as all do, those of cells that are counted by probes too."""
    lens = {"type": "thinlens", "aperture_radius": 0.1, "focus_distance": 3.0, "film": FILM}
    scene = mi.load_dict({"type": "scene", "sensor": lens, "sky": {"type": "constant"}})
    for properties in ({"sampler": "sobol", "weighted": False}, {"sets": 8, "debias": "none"}, {}):
        np.testing.assert_allclose(image(scene, 81, domain="pixel+lens", **properties), 1, rtol=1e-4)


def test_joint_coordinates_come_in_the_order_of_their_names():
    """As `place` takes them: what is placed is read again."""
    domain, drawn = find_domain("pixel+time"), CameraSample(*[None] * len(dataclasses.fields(CameraSample)))
    domain.place(drawn, [mi.Float(0.1), mi.Float(0.2), mi.Float(0.3)])
    np.testing.assert_allclose(np.concatenate(domain.coordinates(drawn)), [0.1, 0.2, 0.3])
    assert drawn.time == 0.3


def test_names():
    assert find_domain("pixel+time").dimension == 3
    assert find_domain("wavelength").periodic
    with pytest.raises(ValueError, match="unknown domain 'wind'"):
        find_domain("pixel+wind")
    with pytest.raises(ValueError, match="twice"):
        find_domain("lens+lens")


@pytest.mark.parametrize(
    ("domain", "message"),
    [
        ("lens", "use a 'thinlens' sensor"),
        ("time", "set its shutter_open and shutter_close"),
        ("wavelength", "llvm_ad_spectral"),
        ("pixel+time", "set its shutter_open and shutter_close"),
    ],
)
def test_a_scene_without_the_domain(domain, message):
    scene = mi.load_dict({"type": "scene", "sensor": {"type": "perspective", "film": FILM}})
    with pytest.raises(ValueError, match=message), one_line_errors():
        image(scene, domain=domain)


def test_pixel_centres_leave_the_domain_pixel_nothing():
    with pytest.raises(ValueError, match="jitter must be true"), one_line_errors():
        mi.load_dict({"type": "reweighted", "domain": "pixel", "jitter": False, "nested": {"type": "direct"}})
