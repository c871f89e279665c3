"""Renders on two workers: the bits of one process."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from voroquad._support.units import InProcess
from voroquad.cluster import OnDask, Store
from voroquad.mitsuba import accumulation
from voroquad.mitsuba.render import render

SCENE = """<scene version="3.0.0">
    <integrator type="path"> <integer name="max_depth" value="3"/> </integrator>
    <sensor type="thinlens">
        <float name="aperture_radius" value="0.3"/> <float name="focus_distance" value="3"/>
        <transform name="to_world"> <lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/> </transform>
        <film type="hdrfilm">
            <integer name="width" value="20"/> <integer name="height" value="18"/> <rfilter type="{rfilter}"/>
        </film>
    </sensor>
    <shape type="sphere">
        <bsdf type="diffuse">
            <texture type="bitmap" name="reflectance"> <string name="filename" value="../maps/chequers.png"/> </texture>
        </bsdf>
    </shape>
    <emitter type="directional"> <vector name="direction" value="-1, -1, -2"/> </emitter>
    <emitter type="constant"/>
</scene>"""


@pytest.fixture
def scene(tmp_path, request):
    """A scene with a file beside it."""
    (tmp_path / "scene").mkdir()
    (tmp_path / "maps").mkdir()
    chequers = np.kron(np.indices((4, 4)).sum(0) % 2, np.ones((4, 4)))[..., None].repeat(3, -1)
    mi.Bitmap((255 * chequers).astype(np.uint8)).write(str(tmp_path / "maps/chequers.png"))
    path = tmp_path / "scene" / "ball.xml"
    path.write_text(SCENE.format(rfilter=request.param))
    return path


def low_bands():
    from voroquad.mitsuba import accumulation

    accumulation.BAND_RAYS = 5 * 20 * 16


def usual_bands():
    from voroquad.mitsuba import accumulation

    accumulation.BAND_RAYS = 2**23


@pytest.mark.parametrize("scene", ["box", "gaussian"], indirect=True)
def test_a_render_has_the_same_bits(client, scene, tmp_path, monkeypatch):
    """Three rounds of four bands, with a file that the scene names, then again from the units that are kept."""
    monkeypatch.setattr(accumulation, "BAND_RAYS", 5 * 20 * 16)
    options = {"spp": 48, "per_round": 16, "seed": 4, "show_progress": False}
    here = render(scene, tmp_path / "here.exr", **options)
    client.run(low_bands)
    store = Store(str(tmp_path / "store"))
    try:
        there = render(scene, tmp_path / "there.exr", pool=OnDask(client, store), **options)
    finally:
        client.run(usual_bands)
    again = render(scene, tmp_path / "again.exr", pool=InProcess(store), **options)
    images = {name: (tmp_path / f"{name}.exr").read_bytes() for name in ("here", "there", "again")}
    assert images["here"] == images["there"] == images["again"]
    assert here | {"output": ""} == there | {"output": ""} == again | {"output": ""}
    assert not list(tmp_path.glob("*there*.npz"))
    with pytest.raises(ValueError, match=r"keeps units of another run \(seed is 5, was 4\)"):
        render(scene, tmp_path / "other.exr", pool=InProcess(store), **options | {"seed": 5})


@pytest.mark.parametrize("scene", ["box"], indirect=True)
def test_a_scene_that_changed_is_another_run(scene, tmp_path):
    options = {"spp": 4, "show_progress": False, "pool": InProcess(Store(str(tmp_path / "store")))}
    render(scene, tmp_path / "o.exr", **options)
    mi.Bitmap(np.zeros((4, 4, 3), np.uint8)).write(str(tmp_path / "maps/chequers.png"))
    with pytest.raises(ValueError, match=r"keeps units of another run \(file .*chequers.png is"):
        render(scene, tmp_path / "o.exr", **options)
