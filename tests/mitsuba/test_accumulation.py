"""Sums over pixels: right, filtered as Mitsuba's film does, and the same bits on any number of threads."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from voroquad.mitsuba import accumulation
from voroquad.mitsuba.accumulation import Footprint, pixel_means


@pytest.mark.parametrize("spp", [1, 7, 16, 48, 3072])
def test_means_of_pixels(spp):
    pixels = 12
    values = np.random.default_rng(spp).random((2, pixels * spp)).astype(np.float32)
    means = pixel_means([mi.Float(v) for v in values], dr.arange(mi.UInt32, pixels * spp), spp)
    expected = values.reshape(2, pixels, spp).mean(-1, dtype=np.float64).T
    np.testing.assert_allclose(means, expected, rtol=3e-6)


def scene_dict(rfilter, **film):
    """A sphere in the sun, as a pinhole sees it."""
    look = mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": 14, "height": 10, "rfilter": {"type": rfilter}, "pixel_format": "rgb"} | film
    return {
        "type": "scene",
        "sensor": {"type": "thinlens", "aperture_radius": 0.2, "focus_distance": 2.0, "to_world": look, "film": film},
        "ball": {"type": "sphere"},
        "sun": {"type": "directional", "direction": [-1, -1, -2]},
    }


CROP = {"crop_offset_x": 3, "crop_offset_y": 2, "crop_width": 7, "crop_height": 5}


@pytest.mark.parametrize(
    ("rfilter", "film"),
    [("box", {}), ("tent", CROP), ("gaussian", {}), ("mitchell", {}), ("gaussian", CROP | {"sample_border": True})],
)
def test_filters_are_those_of_mitsubas_film(rfilter, film):
    """The same rays through our sums (`render`) and through Mitsuba's film (`sample_rays`, `sample`, splatting)."""
    scene = mi.load_dict(scene_dict(rfilter, **film))
    integrator = mi.load_dict({"type": "reweighted", "blend": "off", "nested": {"type": "direct"}})
    ours = np.array(mi.render(scene, integrator=integrator, spp=16, seed=3))
    splatted = super(type(integrator), integrator).render(scene, 0, seed=3, spp=16)
    np.testing.assert_allclose(ours, np.array(splatted), rtol=1e-3, atol=2e-4)


def test_halves_add_up():
    film = mi.load_dict(scene_dict("gaussian")["sensor"]["film"])
    footprint = Footprint(film)
    given = np.random.default_rng(1).random((10, 14, len(footprint.offsets), 2))
    half = np.indices((10, 14)).sum(0)[..., None, None] % 2
    parts = [footprint.gather(given * (half == h)) for h in (0, 1)]
    np.testing.assert_allclose(sum(parts), footprint.gather(given))


@pytest.mark.parametrize(("rfilter", "spp"), [("box", 96), ("tent", 49)])
def test_same_bits_on_any_number_of_threads(rfilter, spp):
    scene = mi.load_dict(scene_dict(rfilter, width=60, height=50))
    integrator = mi.load_dict({"type": "reweighted", "nested": {"type": "direct"}})
    before = dr.thread_count()
    images = []
    try:
        for threads in (1, 4, 4, 3):
            dr.set_thread_count(threads)
            images.append(np.array(mi.render(scene, integrator=integrator, spp=spp)).tobytes())
    finally:
        dr.set_thread_count(before)
    assert len(set(images)) == 1


@pytest.mark.parametrize("changes", [0, 3])
@pytest.mark.parametrize(
    ("rfilter", "film"), [("box", CROP), ("tent", CROP), ("gaussian", {}), ("gaussian", CROP | {"sample_border": True})]
)
def test_bands_make_the_whole(rfilter, film, changes, monkeypatch):
    """Bands of any height, the last one lower and filled up: the image of one band."""
    footprint = Footprint(mi.load_dict(scene_dict(rfilter, **film)["sensor"]["film"]))
    columns, rows = footprint.window
    taps = len(footprint.offsets)
    width = 4 + changes if footprint.reach == 0 else 3 + changes + taps * (5 + changes)
    means = np.random.default_rng(3).random((rows * columns, width))
    passes = []
    for height in (rows, 3, 1):
        monkeypatch.setattr(accumulation, "BAND_RAYS", height * columns * 16)
        bands = footprint.bands(16)
        assert [row for band in bands for row in band] == list(range(rows))
        assert {len(band) for band in bands[:-1]} <= {height}
        shape = footprint.strip_shape(16, 4, changes)
        strips = []
        for band in bands:
            of_band = means[band.start * columns : band.stop * columns]
            strips.append(np.full(shape, 99.0))
            strip = footprint.strip(of_band, 4, band)
            strips[-1][: len(strip)] = strip
        passes.append(footprint.whole(strips, bands, 4))
    for part in passes[1:]:
        for name in ("plain", "differences", "pixel_plain", "pixel_difference"):
            np.testing.assert_allclose(getattr(part, name), getattr(passes[0], name), rtol=1e-12)


def test_bands_have_samples_of_their_own(monkeypatch):
    """Below a band's border the image does not repeat that above it, and is the same image but for noise."""
    scene = mi.load_dict(scene_dict("box", width=16, height=16) | {"integrator": {"type": "direct"}})
    integrator = mi.load_dict({"type": "reweighted", "nested": {"type": "direct"}})
    whole = np.array(mi.render(scene, integrator=integrator, spp=64, seed=1))
    monkeypatch.setattr(accumulation, "BAND_RAYS", 4 * 16 * 64)
    bands = np.array(mi.render(scene, integrator=integrator, spp=64, seed=1))
    assert bands[:4].tobytes() == whole[:4].tobytes()
    assert not np.array_equal(bands[4:], whole[4:])
    np.testing.assert_allclose(bands, whole, atol=0.15)
