"""Means of many renders with default settings against the truth, domain by domain, image by image.

Each scene is the hardest for its domain: all light comes through a narrow part of it, at its border.
"""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import voroquad as vq

pytestmark = pytest.mark.usefixtures("one_thread")

T = mi.ScalarTransform4f
SPP = 16
TRUTH_SPP = 1024


FILM = {"type": "hdrfilm", "width": 32, "height": 32, "rfilter": {"type": "box"}, "pixel_format": "rgb"}


def lens():
    """An evenly bright sky, and a disc before the lens that leaves its rim: light comes through half of the lens."""
    camera = {"type": "thinlens", "aperture_radius": 1.0, "focus_distance": 100.0, "fov": 10, "film": FILM}
    stop = {"type": "disk", "to_world": T().translate([0, 0, 0.05]).rotate([0, 1, 0], 180).scale(0.7)}
    black = {"type": "diffuse", "reflectance": 0.0}
    scene = {"sensor": camera, "stop": stop | {"bsdf": black}, "sky": {"type": "constant"}}
    return scene, {"type": "direct"}


def time():
    """A camera that passes a lamp within the first 3 % of the exposure, under an evenly bright sky."""
    camera = {"type": "perspective", "film": FILM, "fov": 10, "shutter_open": 0.0, "shutter_close": 1.0}
    poses = {f"to_world@{t}": T().translate([x, 0, 0]) for t, x in ((0, 0.0), (1, 200.0))}
    lamp = {"type": "rectangle", "to_world": T().translate([0, 0, 10]).rotate([0, 1, 0], 180).scale(6)}
    scene = {"sensor": {"type": "moving", "camera": camera, **poses}, "sky": {"type": "constant"}}
    scene["lamp"] = lamp | {"emitter": {"type": "area", "radiance": 10.0}}
    return scene, {"type": "direct"}


def light():
    """A floor and a ball under a sky with a sun at the zenith, a border of the square that lights are drawn from."""
    sky = np.full((32, 64, 3), 0.5, np.float32)
    sky[:2] = 5
    camera = {"type": "perspective", "film": FILM, "fov": 30}
    camera["to_world"] = T().look_at([0, 3, 6], [0, 0, 0], [0, 1, 0])
    floor = {"type": "rectangle", "to_world": T().rotate([1, 0, 0], -90).scale(10)}
    ball = {"type": "sphere", "radius": 0.7, "center": [0, 0.7, 0]}
    scene = {"sensor": camera, "floor": floor, "ball": ball, "sky": {"type": "envmap", "bitmap": mi.Bitmap(sky)}}
    return scene, {"type": "direct"}


def pixel():
    """A wall with bright stripes where pixels begin, as wide as a fifth of them."""
    stripes = np.full((1, 5 * 32, 3), 0.1, np.float32)
    stripes[:, ::5] = 1
    texture = {"type": "bitmap", "bitmap": mi.Bitmap(stripes), "raw": True, "filter_type": "nearest"}
    camera = {"type": "orthographic", "film": FILM, "to_world": T().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])}
    wall = {"type": "rectangle", "bsdf": {"type": "diffuse", "reflectance": texture}}
    scene = {"sensor": camera, "wall": wall, "sun": {"type": "directional", "direction": [0, 0, -1]}}
    return scene, {"type": "direct"}


def wavelength():
    """A lamp with lines at the ends of the spectrum."""
    lines = [(360, 8.0), (366, 8.0), (372, 0.1), (824, 0.1), (830, 8.0)]
    camera = {"type": "perspective", "film": FILM, "to_world": T().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])}
    lamp = {"type": "directional", "direction": [0, 0, -1], "irradiance": {"type": "spectrum", "value": lines}}
    scene = {"sensor": camera, "wall": {"type": "rectangle", "to_world": T().scale(9)}, "lamp": lamp}
    return scene, {"type": "direct"}


CASES = {case.__name__: case for case in (lens, time, light, pixel, wavelength)}


class Case:
    """A scene, and the truth of its mean radiance with its standard error."""

    def __init__(self, name):
        mi.set_variant("llvm_ad_spectral" if name == "wavelength" else "llvm_ad_rgb")
        scene, self._nested = CASES[name]()
        self._scene = mi.load_dict({"type": "scene", **scene})
        self._domain = name
        truth = self.levels(range(1000, 1008), TRUTH_SPP, sampler="stratified", weighted=False, blend="off")
        self.truth, self.error = np.mean(truth), np.std(truth, ddof=1) / np.sqrt(len(truth))

    def levels(self, seeds, spp, **properties):
        """Mean radiance of renders."""
        plugin = {"type": "reweighted", "domain": self._domain, "nested": self._nested, **properties}
        integrator = mi.load_dict(plugin)
        return [float(np.mean(mi.render(self._scene, integrator=integrator, spp=spp, seed=k))) for k in seeds]

    def z(self, count, **properties):
        """How many standard errors the mean of renders is from the truth, and a standard error over the truth."""
        means = self.levels(range(5000, 5000 + count), SPP, **properties)
        error = np.hypot(self.error, np.std(means, ddof=1) / np.sqrt(count))
        return (np.mean(means) - self.truth) / error, error / self.truth


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("name", "count", "power"),
    [("lens", 32, 0.003), ("light", 32, 0.002), ("wavelength", 32, 0.0001)]
    + [pytest.param(name, 200, 0.0012, marks=pytest.mark.slow) for name in CASES],
)
def test_default_settings_are_unbiased(name, count, power, tmp_path):
    """Within six standard errors of the truth, which are as small as `power` says; the weights of cells are far off."""
    case = Case(name)
    z, error = case.z(count, sets=1024)
    assert abs(z) < 6
    assert error < power
    biased = {"order": 0, "debias": "none", "sets": 1024}
    if name == "wavelength":  # the plug-in weighs wavelengths on their circle; here on an interval
        vq.SampleTable.make("stratified", SPP, 1, 4096, rng=1).save(tmp_path / "t.npz")
        biased = {"table": str(tmp_path / "t.npz")}
    z_of_control, _ = case.z(32, **biased, blend="off")
    assert abs(z_of_control) > 8


@pytest.mark.statistical
def test_wavelengths_of_owensobol_fill_one_period(monkeypatch):
    """A path carries four wavelengths, a quarter of the range apart: the samples tell strata of a quarter apart.

    That is unbiased, unlike a fifth of the range, and has less noise than strata of the whole range.
    """
    from voroquad.mitsuba import plain

    case = Case("wavelength")
    scene, nested = case._scene, case._nested
    own = {"type": "owensobol", "width": 32, "height": 32, "order": "none"}
    images = {}
    for name, of_period in (("quarter", plain.within_period), ("fifth", lambda v: v / 5), ("whole", lambda v: v)):
        monkeypatch.setattr(plain, "within_period", of_period)
        integrator = mi.load_dict({"type": "plain", "nested": nested, "all_else": own})
        seeds = range(16)
        images[name] = np.array([np.array(mi.render(scene, integrator=integrator, spp=SPP, seed=k)) for k in seeds])
    z = {}
    for name, made in images.items():
        means = made.reshape(len(made), -1).mean(1)
        error = np.hypot(case.error, np.std(means, ddof=1) / np.sqrt(len(means)))
        z[name] = (means.mean() - case.truth) / error
    assert abs(z["quarter"]) < 6
    assert abs(z["fifth"]) > 8
    assert images["quarter"].var(0).mean() < images["whole"].var(0).mean() / 2
