"""Extra channels of a render that are asked for, and its denoised image."""

from __future__ import annotations

import sys

import mitsuba as mi
import numpy as np
import pytest

from voroquad.mitsuba import render as renderer


def test_channels_that_are_asked_for(tmp_path):
    """A grey plane seen from above: its albedo, its normal, its distance; and the samples of a round."""
    scene = tmp_path / "scene.xml"
    scene.write_text("""<scene version="3.0.0"> <integrator type="path"/> <sensor type="orthographic">
        <transform name="to_world"> <lookat origin="0, 5, 0" target="0, 0, 0" up="0, 0, 1"/> </transform>
        <film type="hdrfilm"> <integer name="width" value="8"/> <integer name="height" value="6"/> </film> </sensor>
        <shape type="rectangle"> <transform name="to_world"> <rotate x="1" angle="-90"/> </transform>
        <bsdf type="diffuse"> <rgb name="reflectance" value="0.25, 0.5, 0.75"/> </bsdf> </shape>
        <emitter type="constant"/> </scene>""")
    aovs = ("albedo", "normal", "depth", "variance", "samples")
    options = {"spp": 32, "per_round": 16, "aovs": aovs, "show_progress": False}
    for sampler in ("owensobol", "stratified"):  # the domain 'light' cannot have them: the pixels are sampled
        renderer.render(scene, tmp_path / "o.exr", sampler=sampler, **options)
        bitmap = mi.Bitmap(str(tmp_path / "o.exr"))
        names = [field.name for field in bitmap.struct_()]
        level = dict(zip(names, np.array(bitmap, np.float64).mean((0, 1)), strict=True))
        assert [level[f"albedo.{c}"] for c in "RGB"] == pytest.approx([0.25, 0.5, 0.75], rel=1e-3)
        assert [level[f"normal.{c}"] for c in "XYZ"] == pytest.approx([0, 1, 0], abs=1e-3)
        assert level["depth.T"] == pytest.approx(5, abs=0.02)  # from the near plane on
        assert level["samples"] == 16
        assert {"variance.R", "variance.G", "variance.B"} < set(names)
    renderer.render(scene, tmp_path / "parts.exr", sampler="owensobol", **options)
    with pytest.raises(ValueError, match=r"channels is None, was \['albedo', 'normal', 'depth'\]"):
        renderer.render(scene, tmp_path / "parts.exr", sampler="owensobol", resume=True, **options | {"aovs": ()})


@pytest.mark.parametrize(
    ("out", "options", "message"),
    [
        ("o.exr", {"aovs": ["colour"]}, "unknown aov 'colour'; choose one of albedo, normal, depth, variance, samples"),
        ("o.png", {"aovs": ["depth"]}, r"aov=depth needs an image with channels; write to a file .exr, got '.*o.png'"),
        ("o.exr", {"aovs": ["variance"]}, "aov=variance needs two rounds or more; take --round 8, or fewer samples"),
    ],
)
def test_channels_that_an_image_cannot_have(ball, tmp_path, out, options, message):
    with pytest.raises(ValueError, match=message):
        renderer.render(ball, tmp_path / out, spp=16, **options)
    assert list(tmp_path.iterdir()) == []


def test_a_denoised_image_is_beside_the_image(ball, tmp_path):
    """It has less error than the image, which is the one without."""
    pytest.importorskip("mitsuba_oidn")
    options = {"spp": 16, "sampler": "owensobol", "size": (64, 48), "show_progress": False}
    renderer.render(ball, tmp_path / "truth.exr", **options | {"spp": 1024})
    renderer.render(ball, tmp_path / "plain.exr", **options)
    renderer.render(ball, tmp_path / "o.exr", denoise=True, **options)
    truth, noisy, clean = (
        np.array(mi.Bitmap(str(tmp_path / f"{name}.exr")), np.float64) for name in ("truth", "o", "o.denoised")
    )
    truth = truth[..., :3]
    assert (tmp_path / "plain.exr").read_bytes() == (tmp_path / "o.exr").read_bytes()
    assert ((clean - truth) ** 2).mean() < 0.7 * ((noisy - truth) ** 2).mean()


def test_a_denoiser_that_is_missing_is_told_before_work(ball, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mitsuba_oidn", None)
    with pytest.raises(ImportError, match=r"denoising needs Open Image Denoise .*pip install '\.\[denoise\]'"):
        renderer.render(ball, tmp_path / "o.exr", spp=16, denoise=True)
    assert list(tmp_path.iterdir()) == []
