"""The pilot that chooses a setting: what it renders, what it takes, and that nothing of it is in the image."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from statistics import geometric_mean, median

import mitsuba as mi
import numpy as np
import pytest

from voroquad._support.units import LocalFile
from voroquad.mitsuba import compare as comparison
from voroquad.mitsuba import render as renderer
from voroquad.mitsuba import settling
from voroquad.mitsuba.bands import Shot
from voroquad.mitsuba.loading import load_scene, scene_path
from voroquad.mitsuba.methods import ADAPTIVE, OWEN_SOBOL, OWN, Stage
from voroquad.mitsuba.pilot import Finding, _every_pixel, best, candidates, findings, pilot_step
from voroquad.mitsuba.settling import Wanted, choose, settle


def stage(scene, domain="lens", *, jitter=True, spp=64, size=None):
    loaded = load_scene(scene, size)
    return Stage(loaded, loaded.sensors()[0], domain, jitter)


def found(method, level, spread=0.0, pixels=400):
    """A candidate with a mean variance, and with a spread over the pixels of its own."""
    noise = np.random.default_rng(abs(hash(method.name)) % 2**32 if spread else 0).standard_normal(pixels)
    return Finding(method, level * np.ones(pixels) + spread * (noise - noise.mean()))


@pytest.mark.parametrize(
    ("variances", "taken"),
    [
        ({"owensobol": (1.0, 0.0), "adaptive": (0.5, 0.1), "own": (3.0, 0.0)}, ADAPTIVE),
        ({"owensobol": (1.0, 0.0), "adaptive": (0.95, 1.0), "own": (3.0, 0.0)}, OWEN_SOBOL),  # within two errors
        ({"owensobol": (1.0, 0.0), "adaptive": (0.95, 1.0), "own": (0.85, 1.0)}, OWN),  # by one
        ({"owensobol": (0.0, 0.0), "adaptive": (0.0, 0.0), "own": (0.0, 0.0)}, OWEN_SOBOL),
        ({"owensobol": (1.0, 0.0), "adaptive": (0.0, 0.0), "own": (1.0, 0.0)}, ADAPTIVE),
    ],
)
def test_the_least_variance_is_taken_where_it_is_plain(variances, taken):
    methods = {method.name: method for method in (OWEN_SOBOL, ADAPTIVE, OWN)}
    assert best([found(methods[name], *numbers) for name, numbers in variances.items()]).method is taken


def test_one_pixel_of_large_variance_decides_nothing():
    bright = found(OWEN_SOBOL, 1.0)
    bright.variance[7] = 1e6
    assert best([bright, found(ADAPTIVE, 0.9), found(OWN, 1e9)]).method is OWEN_SOBOL
    assert best([bright, Finding(ADAPTIVE, bright.variance / 2), found(OWN, 1e9)]).method is ADAPTIVE  # as uncertain


def test_candidates_are_those_that_the_scene_can_take(ball):
    names = [method.name for method in candidates(stage(ball), [64])]
    assert names == ["owensobol", "mitsuba-multijitter", "adaptive", "weights-lens", "own"]
    assert "adaptive" not in [method.name for method in candidates(stage(ball), [16])]
    assert "weights-lens" not in [method.name for method in candidates(stage(ball), [13])]  # no such strata
    assert candidates(stage("moving-objects", "time", size=(8, 6)), [64]) == []


def wall(texels, film):
    """A wall with these texels that fills the film."""
    texture = {"type": "bitmap", "bitmap": mi.Bitmap(texels), "raw": True, "filter_type": "nearest"}
    film = {"type": "hdrfilm", "rfilter": {"type": "box"}, "pixel_format": "rgb"} | film
    return {
        "type": "scene",
        "integrator": {"type": "direct"},
        "camera": {"type": "orthographic", "film": film, "to_world": mi.ScalarTransform4f().look_at(
            [0, 0, 4], [0, 0, 0], [0, 1, 0])},
        "wall": {"type": "rectangle", "bsdf": {"type": "diffuse", "reflectance": texture}},
        "sun": {"type": "directional", "direction": [0, 0, -1]},
    }  # fmt: skip


@pytest.mark.parametrize("step", [3, 5])  # odd: pixels have a middle
def test_a_pilot_has_every_third_or_fifth_pixel_of_the_image(step):
    """Each pixel of the image shows a texel of its own, so there is no noise; the crop window and the film stay."""
    texels = np.random.default_rng(1).random((60, 60, 3)).astype(np.float32)
    film = {"width": 60, "height": 60, "crop_width": 45, "crop_height": 30, "crop_offset_x": 15, "crop_offset_y": 15}
    scene = mi.load_dict(wall(texels, film))
    sensor = scene.sensors()[0]
    whole = np.array(mi.render(scene, spp=4))
    shown = []

    class Watched(Stage):
        def integrator(self, method):
            made = super().integrator(method)
            of_image = made.image
            made.image = lambda *arguments: shown.append(of_image(*arguments)) or shown[-1]
            return made

    own = Watched(scene, sensor, "pixel", True)
    (finding,) = findings(own, [OWEN_SOBOL], 4, [1, 2], step)
    np.testing.assert_allclose(shown[0][0], whole[step // 2 :: step, step // 2 :: step], rtol=1e-4)
    assert finding.variance.shape == (30 // step * (45 // step),)
    assert finding.variance.max() < 1e-10
    np.testing.assert_array_equal(np.array(mi.render(scene, spp=4)), whole)


@pytest.mark.parametrize("stripe", [(28, 37), (30, 31), (34, 35)])
def test_adaptive_samples_go_by_the_noise_around_a_pixel_not_by_that_of_pixels_far_away(stripe):
    """A wall with a noisy stripe around column 32 of 60 of the image, or beside it; the pilot has every fifth pixel."""
    texels = np.full((60, 600, 3), 0.5, np.float32)
    first, last = (10 * column for column in stripe)
    texels[:, first:last] = np.random.default_rng(1).random((60, last - first, 1))
    scene = mi.load_dict(wall(texels, {"width": 60, "height": 60}))
    sensor = scene.sensors()[0]
    integrator = Stage(scene, sensor, "pixel", True).integrator(ADAPTIVE)
    integrator.part = 1 / 5
    integrator.sharing = replace(integrator.sharing, target=1e-3)  # none for rounding
    with _every_pixel(sensor, 5):
        counts = integrator.counts_apart(scene, sensor, 1, 32)
    assert counts.shape == (12, 12)
    assert (counts[:, 6] > 16).all()
    assert (counts[:, [0, 1, 2, 3, 4, 8, 9, 10, 11]] == 16).all()  # 5 × 5 of the pilot's own pixels reach 4 and 8


def test_a_small_image_has_no_pilot(ball):
    assert pilot_step(stage(ball, size=(32, 24)).sensor, [OWEN_SOBOL] * 5, 64) is None
    assert choose(stage(ball, size=(32, 24)), 64, 0)[1] == "owensobol, as the image is too small for a pilot"
    assert pilot_step(stage(ball, size=(160, 120)).sensor, [OWEN_SOBOL] * 5, 64) == 13
    assert pilot_step(stage(ball, size=(160, 120)).sensor, [*[OWEN_SOBOL] * 4, ADAPTIVE], 64) == 14


def test_the_choice_is_one_for_a_seed_and_no_sample_of_it_is_in_the_image(ball, tmp_path, monkeypatch):
    """The image has the bits of one by the setting that was taken, and resumes."""
    monkeypatch.setattr(settling, "candidates", lambda stage, spp: [OWEN_SOBOL, OWN])
    options = {"size": (128, 96), "seed": 3, "per_round": 16, "show_progress": False}
    summary = renderer.render(ball, tmp_path / "whole.exr", spp=48, **options)
    assert (summary["sampler"], summary["domain"]) == ("owensobol", None)
    renderer.render(ball, tmp_path / "named.exr", spp=48, sampler="owensobol", **options)
    renderer.render(ball, tmp_path / "parts.exr", spp=32, **options)
    renderer.render(ball, tmp_path / "parts.exr", spp=48, resume=True, **options)
    assert (tmp_path / "parts.exr").read_bytes() == (tmp_path / "whole.exr").read_bytes()
    assert (tmp_path / "named.exr").read_bytes() == (tmp_path / "whole.exr").read_bytes()


@pytest.mark.parametrize(("taken", "domain"), [("own", None), ("adaptive", None), ("weights-lens", "lens")])
def test_every_candidate_renders(ball, tmp_path, monkeypatch, taken, domain):
    def choose(own, spp, seed):
        return next(method for method in candidates(own, [spp]) if method.name == taken), ""

    monkeypatch.setattr(settling, "choose", choose)
    summary = renderer.render(ball, tmp_path / "o.exr", spp=64, show_progress=False)
    assert (summary["sampler"], summary["domain"]) == ("owensobol" if taken == "adaptive" else taken, domain)
    names = [field.name for field in mi.Bitmap(str(tmp_path / "o.exr")).struct_()]
    assert names == ["R", "G", "B", *{"adaptive": ["samples"], "weights-lens": ["lambda"]}.get(taken, [])]


def test_moving_objects_take_the_sampler_for_all_but_the_times():
    shot = Shot(LocalFile(scene_path("moving-objects")), mi.variant(), (8, 6), "plain", {}, 0, {})
    settled = settle(Wanted(), shot, 16, 0)
    assert settled.shot.properties["scene_sampler"] == {"type": "owensobol"}
    assert (settled.key["domain"], settled.key["sampler"]) == ("time", "stratified")
    named = settle(Wanted(domain="time"), shot, 16, 0)
    assert "scene_sampler" not in named.shot.properties


@pytest.mark.slow
def test_compare_shows_the_candidates(ball, tmp_path):
    results = comparison.compare(
        ball, tmp_path / "out", auto=True, spp=(4, 32), size=(40, 30), jitter=True, show_progress=False
    )
    (images,) = (c for s in results.sections for c in s.comparisons)
    shown = {(rendering.method, rendering.spp) for rendering in images.renderings}
    assert {method for method, spp in shown if spp == 32} >= {"owensobol", "adaptive", "the scene's own sampler"}
    assert ("adaptive", 4) not in shown
    assert " --auto " in results.command
    assert "A render at 32 samples: " in results.sections[0].text
    with pytest.raises(ValueError, match="auto has nothing to choose from where objects move"):
        comparison.compare("moving-objects", tmp_path / "no", auto=True, size=(8, 6))


def test_the_cost_of_adaptive_samples_is_what_was_measured():
    path = Path(__file__).parents[2] / "benchmarks" / "results" / "sampler_time.csv"
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    costs = [
        median(float(r["adaptive_cpu"]) / float(r["owensobol_cpu"]) for r in rows if r["scene"] == scene)
        for scene in {r["scene"] for r in rows}
    ]
    assert round(geometric_mean(costs), 2) == ADAPTIVE.cost
