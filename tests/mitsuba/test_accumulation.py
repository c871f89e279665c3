"""Sums over pixels: right, filtered as Mitsuba's film does, and the same bits on any number of threads."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from mitsuba.python.ad.integrators.common import ADIntegrator

from voroquad.mitsuba import accumulation
from voroquad.mitsuba.accumulation import Contributions, Footprint, Layout, Pass, pixel_means
from voroquad.mitsuba.plain import band_seed


@pytest.mark.parametrize("spp", [1, 7, 16, 48, 3072])
def test_means_of_pixels(spp):
    pixels = 12
    values = np.random.default_rng(spp).random((2, pixels * spp)).astype(np.float32)
    means = pixel_means([mi.Float(v) for v in values], dr.arange(mi.UInt32, pixels * spp), spp)
    expected = values.reshape(2, pixels, spp).mean(-1, dtype=np.float64).T
    np.testing.assert_allclose(means, expected, rtol=3e-6)


@pytest.mark.parametrize("spp", [24, 64])
def test_two_threads_that_share_a_pixel_add_it_as_one_does(spp):
    """Of few rays each thread takes a half, and the border is inside a pixel."""
    pixels = 333
    start = mi.Float(np.random.default_rng(spp).random(pixels * spp).astype(np.float32))
    before, means = dr.thread_count(), []
    for threads in (1, 2, 2, 2):
        dr.set_thread_count(threads)
        _, values = dr.while_loop(  # long enough for both threads to begin
            (mi.UInt32(0), mi.Float(start)), lambda k, _: k < 10000, lambda k, x: (k + 1, 3.9 * x * (1 - x))
        )
        means.append(pixel_means([values], dr.arange(mi.UInt32, pixels * spp), spp))
    dr.set_thread_count(before)
    for own in means[1:]:
        np.testing.assert_array_equal(own, means[0])


def test_another_number_of_pixels_costs_no_compilation():
    """Adaptive images have another one for each seed. In all there are eight kernels for pixels by an octave."""
    kernels = []
    for pixels in (2048, 2043, 1999):
        rays = dr.arange(mi.UInt32, pixels * 16)
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            means = pixel_means([mi.Float(rays & 15), mi.Float(rays >> 4)], rays, 16)
            kernels.append({kernel["hash"] for kernel in dr.kernel_history() if "hash" in kernel})
        np.testing.assert_array_equal(means, np.transpose([np.full(pixels, 7.5), np.arange(pixels)]))
    assert kernels[0] == kernels[1] == kernels[2]


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


def columns_of_rays(layout):
    """The columns of a ray that brings 1 to 4 channels, 5 to 7 as the change, … under a filter of weights 1."""
    number = iter(range(1, 99))
    values = Contributions([next(number) for _ in range(4)])
    if layout.weights:
        values.change, values.noise, values.excess = (
            [next(number) for _ in range(3)], [next(number) for _ in range(3)], next(number),
        )  # fmt: skip
    if layout.partly:
        values.weighted = [next(number) for _ in range(3)]
    return layout.row(values, [1] * layout.taps)


@pytest.mark.parametrize("taps", [0, 9])
@pytest.mark.parametrize(("weights", "partly"), [(False, False), (True, False), (True, True)])
def test_layout_reads_what_it_writes(taps, weights, partly):
    """Each column of a ray, box filter or not, is found again where `Pass` looks for it."""
    layout = Layout(4, weights, partly, taps)
    row = np.array([np.array(column, np.float64).ravel()[0] for column in columns_of_rays(layout)])
    own, plain, change = layout.taps_of(row) if taps else (row, None, None)
    if taps:
        assert own.shape == (layout.own,)
        assert plain.shape == (taps, layout.plain)
        assert change.shape == (taps, layout.changes)
        strip = np.concatenate([own, plain[0], *([change[0], -change[0]] if weights else [])])
    else:
        strip = row
    assert strip.shape == (layout.of_strip,)
    done = accumulation._pass(np.tile(strip, (2, 2, 1)), layout)
    np.testing.assert_array_equal(done.plain[0, 0], [1, 2, 3, 4])
    np.testing.assert_array_equal(done.pixel_plain[0, 0], [1, 2, 3])
    if not weights:
        return
    np.testing.assert_array_equal(done.differences[0, 0, 0], [5, 6, 7])
    np.testing.assert_array_equal(done.pixel_difference[0, 0], [5, 6, 7])
    np.testing.assert_array_equal(done.pixel_noise[0, 0], [8, 9, 10])
    if taps:
        np.testing.assert_array_equal(done.differences[1, 0, 0], [-5, -6, -7])
        np.testing.assert_array_equal(done.excess[:, 0, 0], [11, -11])
        assert (done.weighted is not None) == partly
    if taps and partly:
        np.testing.assert_array_equal(done.weighted[0, 0], [12, 13, 14])


CROP = {"crop_offset_x": 3, "crop_offset_y": 2, "crop_width": 7, "crop_height": 5}


@pytest.mark.parametrize(
    ("rfilter", "film"),
    [("box", {}), ("tent", CROP), ("gaussian", {}), ("mitchell", {}), ("gaussian", CROP | {"sample_border": True})],
)
def test_filters_are_those_of_mitsubas_film(rfilter, film):
    """The same rays through our sums (`render`) and through Mitsuba's film (`sample_rays`, `sample`, splatting).

    The film divides by the sum of the filter's values alone.
    """
    scene = mi.load_dict(scene_dict(rfilter, **film))
    integrator = mi.load_dict({"type": "reweighted", "blend": "off", "nested": {"type": "direct"}})
    done = integrator.render_pass(scene, scene.sensors()[0], 3, 16)
    splatted = np.array(ADIntegrator.render(integrator, scene, 0, seed=3, spp=16))
    np.testing.assert_allclose(done.plain + done.differences.sum(0), splatted, rtol=1e-3, atol=2e-4)
    if rfilter != "box":
        ours = np.array(mi.render(scene, integrator=integrator, spp=16, seed=3))
        np.testing.assert_allclose(ours * (1 + done.excess.sum(0)[..., None]), splatted, rtol=1e-3, atol=2e-4)


def test_a_wide_filter_divides_by_the_weights_of_what_they_multiply():
    """Where what the weights multiply is 2 everywhere, the image is that and the rest, whatever weights and λ."""
    rng = np.random.default_rng(1)
    excess, share = rng.uniform(-0.3, 0.3, (2, 4, 5)), rng.random((2, 4, 5))
    colours = np.full((4, 5, 3), 5.0)
    changes = 2 * np.repeat(excess[..., None], 3, -1)
    nothing = np.zeros_like(colours)
    done = Pass(colours, changes, nothing, nothing, nothing, excess, nothing + 2)
    np.testing.assert_allclose(done.blended(share), 5)
    # Where they multiply all of it, the weighted part is the image
    done = Pass(colours, 2.5 * changes, nothing, nothing, nothing, excess)
    np.testing.assert_allclose(done.blended(share), 5)
    # The rest is what the sum of weights does not touch; the weighted part is divided by it
    changes, weighted = rng.uniform(-1, 1, (2, 4, 5, 3)), rng.random((4, 5, 3))
    done = Pass(colours, changes, nothing, nothing, nothing, excess, weighted)
    expected = 5 - weighted + (weighted + changes.sum(0)) / (1 + excess.sum(0)[..., None])
    np.testing.assert_allclose(done.blended(np.ones_like(share)), expected)


def test_changes_belong_to_the_half_of_their_pixel():
    """The first half has the pixels of which row and column add up to an even number, also in a band below."""
    footprint = Footprint(mi.load_dict(scene_dict("gaussian")["sensor"]["film"]))
    layout = footprint.layout(3, weights=True)
    columns, _ = footprint.window
    for row, column in ((0, 4), (1, 4), (2, 5)):
        means = np.zeros((4, columns, layout.own + layout.taps * (layout.plain + layout.changes)))
        means[row, column] = 1
        _, _, halves = layout.split(footprint.strip(means, layout, range(3, 7)))
        assert [half.any() for half in halves] == [(3 + row + column) % 2 == h for h in (0, 1)]


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


@pytest.mark.parametrize(("weights", "partly"), [(False, False), (True, False), (True, True)])
@pytest.mark.parametrize(
    ("rfilter", "film"), [("box", CROP), ("tent", CROP), ("gaussian", {}), ("gaussian", CROP | {"sample_border": True})]
)
def test_bands_make_the_whole(rfilter, film, weights, partly, monkeypatch):
    """Bands of any height, the last one lower and filled up: the image of one band."""
    footprint = Footprint(mi.load_dict(scene_dict(rfilter, **film)["sensor"]["film"]))
    columns, rows = footprint.window
    layout = footprint.layout(4, weights=weights, partly=partly)
    means = np.random.default_rng(3).random((rows * columns, len(columns_of_rays(layout))))
    passes = []
    for height in (rows, 3, 1):
        monkeypatch.setattr(accumulation, "BAND_RAYS", height * columns * 16)
        bands = footprint.bands(16)
        assert [row for band in bands for row in band] == list(range(rows))
        assert {len(band) for band in bands[:-1]} <= {height}
        shape = footprint.strip_shape(16, layout)
        strips = []
        for band in bands:
            of_band = means[band.start * columns : band.stop * columns]
            strips.append(np.full(shape, 99.0))
            strip = footprint.strip(of_band, layout, band)
            strips[-1][: len(strip)] = strip
        passes.append(footprint.whole(strips, bands, layout))
    for part in passes[1:]:
        for name in ("plain", "differences", "pixel_plain", "pixel_difference", "pixel_noise", "excess", "weighted"):
            first, own = getattr(passes[0], name), getattr(part, name)
            assert (own is None) == (first is None)
            if own is not None:
                np.testing.assert_allclose(own, first, rtol=1e-12)


def test_each_band_of_each_image_has_a_seed_of_its_own():
    assert band_seed(5, 0) == 5
    assert len({band_seed(seed, number) for seed in range(20) for number in range(20)}) == 400


def test_bands_have_samples_of_their_own(monkeypatch):
    """Below a band's border the image does not repeat that above it, and is the same image but for noise."""
    scene = mi.load_dict(scene_dict("box", width=16, height=16) | {"integrator": {"type": "direct"}})
    integrator = mi.load_dict({"type": "reweighted", "blend": "off", "nested": {"type": "direct"}})
    whole = np.array(mi.render(scene, integrator=integrator, spp=64, seed=1))
    monkeypatch.setattr(accumulation, "BAND_RAYS", 4 * 16 * 64)
    bands = np.array(mi.render(scene, integrator=integrator, spp=64, seed=1))
    assert bands[:4].tobytes() == whole[:4].tobytes()
    assert not np.array_equal(bands[4:], whole[4:])
    np.testing.assert_allclose(bands, whole, atol=0.15)
