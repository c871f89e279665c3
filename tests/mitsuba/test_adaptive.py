"""Adaptive sampling: the same samples as without, as many as were shared out, and the true image in the mean."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from voroquad.mitsuba import accumulation
from voroquad.mitsuba import render as renderer
from voroquad.mitsuba.allocation import KINDS, Sharing
from voroquad.mitsuba.errors import one_line_errors
from voroquad.mitsuba.loading import load_scene

OWN = {"type": "owensobol", "order": "none"}


def plain(**properties):
    return mi.load_dict({"type": "plain", "nested": {"type": "direct"}} | properties)


def render(scene, integrator, spp=64, seed=0):
    return np.array(mi.render(scene, integrator=integrator, spp=spp, seed=seed), dtype=np.float64)


@pytest.mark.parametrize("rfilter", ["box", "gaussian"])
@pytest.mark.parametrize("seed", [0, 7])
def test_pixels_have_the_samples_that_they_have_with_as_many_everywhere(rfilter, seed):
    """Also in an image whose pilot is that of another seed."""
    scene = mi.load_dict({
        "type": "scene",
        "sensor": {"type": "perspective", "film": {
            "type": "hdrfilm", "width": 16, "height": 12, "rfilter": {"type": rfilter}}},
        "ball": {"type": "sphere", "center": [0.7, 0, 4]},
        "sun": {"type": "directional", "direction": [1.0, -1.0, 2.0]},
    })  # fmt: skip
    adaptive = plain(adaptive="absolute", aovs="samples", at_most=128, pilot_seed=0)
    image = render(scene, adaptive, seed=seed)
    samples = image[..., 3]
    assert 40 < samples.mean() <= 64
    assert len(np.unique(samples)) > 2
    reach = 0 if rfilter == "box" else 2
    sampler = mi.load_dict(OWN)
    sampler.cross(16)
    for n in (16, 32, 64, 128):
        same = samples == n
        for y, x in np.argwhere(same):  # the filter reaches pixels with as many samples only
            around = samples[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1]
            same[y, x] = (around == n).all()
        whole = render(scene, plain(scene_sampler=sampler), spp=n, seed=seed)
        np.testing.assert_allclose(image[same][:, :3], whole[same], rtol=1e-5, atol=1e-7)


def test_an_image_takes_two_wavefronts(ball, monkeypatch):
    """The pilot's, and the rest: what a wavefront costs beside its rays would add up."""
    wavefronts = []

    def noted(values, index, spp):
        wavefronts.append(len(index))
        return accumulation.pixel_means(values, index, spp)

    monkeypatch.setattr("voroquad.mitsuba.adaptive.pixel_means", noted)
    scene = load_scene(ball, size=(16, 12))
    samples = render(scene, plain(adaptive="absolute", aovs="samples"))[..., 3]
    assert len(np.unique(samples)) > 2
    assert wavefronts == [16 * 16 * 12, samples.sum() - 16 * 16 * 12]


def test_blocks_of_the_pilot_are_consecutive(ball, monkeypatch):
    """Only so are they nets; the samples after the pilot's need no order."""
    orders = []
    kind = type(plain(adaptive="absolute"))
    make = kind._sampler_of

    def noted(self, sensor, spp):
        own = make(self, sensor, spp)
        seed = own.seed
        own.seed = lambda *arguments: (orders.append(own.consecutive), seed(*arguments))
        return own

    monkeypatch.setattr(kind, "_sampler_of", noted)
    render(load_scene(ball, size=(16, 12)), plain(adaptive="absolute"))
    assert list(dict.fromkeys(orders)) == [True, False]


def test_bands_and_chunks_do_not_change_the_bits(ball, monkeypatch):
    scene = load_scene(ball)
    adaptive = {"adaptive": "relative", "aovs": "samples"}
    whole = render(scene, plain(**adaptive))
    monkeypatch.setattr(accumulation, "BAND_RAYS", 5 * 32 * 64)
    np.testing.assert_array_equal(render(scene, plain(**adaptive)), whole)


def test_a_scene_that_changes_gets_a_pilot_of_its_own(ball):
    scene = load_scene(ball, size=(16, 12))
    parameters = mi.traverse(scene)
    key = next(name for name in parameters.keys() if name.endswith("irradiance.value"))  # noqa: SIM118
    integrator = plain(adaptive="absolute", aovs="samples")
    before = render(scene, integrator)
    parameters[key] = parameters[key] * 0.5
    parameters.update()
    np.testing.assert_allclose(render(scene, integrator)[..., :3], before[..., :3] / 2, rtol=1e-5)


@pytest.fixture(scope="module")
def measured(ball):
    """A scene, its image with many samples, and images of 32 everywhere."""
    scene = load_scene(ball, size=(16, 12))
    truth = np.mean([render(scene, plain(scene_sampler=OWN), 2048, 100 + k) for k in range(4)], 0)
    equal = np.stack([render(scene, plain(scene_sampler=OWN), 32, seed) for seed in range(16)])
    return scene, truth, equal


@pytest.mark.statistical
@pytest.mark.parametrize("kind", KINDS)
def test_it_is_unbiased_and_better(measured, kind):
    """Over seeds, against many samples everywhere; then the mean squared error, which is not what `relative` lowers."""
    scene, truth, equal = measured
    integrator = plain(adaptive=kind, at_least=8)
    images = np.stack([render(scene, integrator, 32, seed) for seed in range(48)])
    level = images.mean((1, 2, 3)) - truth.mean()
    assert abs(level.mean() / (level.std(ddof=1) / np.sqrt(len(level)))) < 5.5
    assert kind == "relative" or ((images - truth) ** 2).mean() < 0.8 * ((equal - truth) ** 2).mean()


def test_rounds_share_a_pilot_and_go_on_with_the_same_bits(ball, tmp_path):
    options = {"sharing": Sharing("absolute"), "seed": 5, "per_round": 32, "show_progress": False}
    summary = renderer.render(ball, tmp_path / "whole.exr", spp=96, **options)
    assert (summary["spp"], summary["rounds"], summary["domain"]) == (96, 3, None)
    renderer.render(ball, tmp_path / "parts.exr", spp=64, **options)
    renderer.render(ball, tmp_path / "parts.exr", spp=96, resume=True, **options)
    assert (tmp_path / "parts.exr").read_bytes() == (tmp_path / "whole.exr").read_bytes()
    names = [field.name for field in mi.Bitmap(str(tmp_path / "whole.exr")).struct_()]
    assert names == ["R", "G", "B", "samples", "variance.R", "variance.G", "variance.B"]


@pytest.mark.parametrize(
    ("properties", "message"),
    [
        ({"adaptive": "more"}, "unknown adaptive 'more'; choose one of off, balanced, absolute, relative"),
        ({"adaptive": "absolute", "at_least": 12}, "at_least must be a power of two, 2 or more, got 12; take 16"),
        (
            {"adaptive": "absolute", "at_most": 48},
            "at_most must be at_least=16 times a power of two, or 0, got 48; take 256",
        ),
        ({"adaptive": "absolute", "target": -1.0}, "target must be a number of at least 0, got -1"),
        (
            {"adaptive": "absolute", "s": {"type": "independent"}},
            "needs the sampler 'owensobol', whose sequences go on",
        ),
        ({"at_least": 16}, "at_least"),
    ],
)
def test_wrong_properties_are_refused(properties, message):
    with pytest.raises((ValueError, RuntimeError), match=message), one_line_errors():
        plain(**properties)


def test_a_pilot_needs_something_to_share_out(ball, tmp_path):
    with pytest.raises(ValueError, match="more samples per pixel than the 16 of its pilot, got 16; take 64, or a sma"):
        renderer.render(ball, tmp_path / "o.exr", sharing=Sharing(), spp=16)
