"""The domain that is taken where none is named."""

from __future__ import annotations

import mitsuba as mi
import pytest

from voroquad.mitsuba.default_domain import choose_domain
from voroquad.mitsuba.loading import load_scene


def chosen(scene, *, jitter=True):
    return choose_domain(scene, scene.sensors()[0], jitter=jitter)[0]


@pytest.mark.parametrize(
    ("name", "domain"),
    [
        ("depth-of-field", "lens"), ("moving-camera", "time"), ("moving-objects", "time"), ("large-light", "light"),
        ("sky", "light"), ("room", "lens"),
    ],
)  # fmt: skip
def test_scenes_have_their_domains(name, domain):
    assert chosen(load_scene(name, (8, 6))) == domain


@pytest.mark.parametrize(
    ("changes", "domain"),
    [
        ({}, "light"),
        ({"integrator": {"type": "volpath"}}, "pixel"),  # it shows no emitter sample at the first hit
        ({"integrator": {"type": "path", "max_depth": 1}}, "pixel"),
        ({"integrator": {"type": "aov", "aovs": "d:depth", "a": {"type": "path"}}}, "pixel"),
        ({"integrator": {"type": "reweighted", "domain": "pixel+light", "a": {"type": "path"}}}, "pixel+light"),
        ({"light": {"type": "point"}}, "pixel"),  # an emitter without an area
    ],
)
def test_a_plain_cornell_box(changes, domain):
    assert chosen(mi.load_dict(mi.cornell_box() | changes)) == domain


def test_only_pixels_are_left_and_they_are_not_sampled():
    scene = mi.load_dict(mi.cornell_box() | {"light": {"type": "point"}})
    with pytest.raises(ValueError, match=r"sample the pixels' area \(--jitter\)"):
        chosen(scene, jitter=False)


def test_the_command_line_says_what_was_taken(voroquad, tmp_path):
    """A scene of a sphere and a lamp without an area, seen without a lens."""
    scene = tmp_path / "scene.xml"
    scene.write_text(
        '<scene version="3.0.0"> <integrator type="direct"/> <sensor type="perspective"> <film type="hdrfilm">'
        '<integer name="width" value="8"/> <integer name="height" value="6"/> </film> </sensor>'
        '<shape type="sphere"/> <emitter type="point"/> </scene>'
    )
    run = voroquad("render", scene, "--spp", 16, "--sampler", "stratified", "-o", tmp_path / "o.exr", "--json")
    assert run.returncode == 0, run.stderr
    assert '"domain": "pixel"' in run.stdout
    assert run.stderr.startswith("voroquad: domain pixel, since there is no aperture")
    left_open = voroquad("render", scene, "--spp", 16, "-o", tmp_path / "o.exr", "--json")
    assert '"domain": null, "sampler": "owensobol"' in left_open.stdout
    assert left_open.stderr.startswith("voroquad: owensobol, as the image is too small for a pilot; --sampler names")
    refused = voroquad("compare", scene, "--spp", 16, "-o", tmp_path / "c")
    assert refused.returncode == 2
    assert refused.stderr.count("\n") == 1
    assert "--jitter" in refused.stderr
    lens = voroquad("render", scene, "--domain", "lens", "-o", tmp_path / "p.exr")
    assert lens.returncode == 2
    assert "domain 'lens' needs a sensor with a lens" in lens.stderr
