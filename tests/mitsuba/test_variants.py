"""Every variant that the guide names renders every domain; the others are refused."""

from __future__ import annotations

import re
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from voroquad.mitsuba.errors import one_line_errors

pytestmark = pytest.mark.usefixtures("one_thread")

GUIDE = Path(__file__).resolve().parents[2] / "docs" / "mitsuba.md"
NAMED = re.findall(r"`(\w+)`", re.search(r"<!-- list: variants -->(.*?)<!-- end -->", GUIDE.read_text(), re.S)[1])
PATH = {"type": "path", "max_depth": 3}


def scene(sampler="independent"):
    """Spheres of glass, metal and plaster under a lamp and a sky, with a lens and an open shutter."""
    look = mi.ScalarTransform4f().look_at([0, 1, 5], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": 8, "height": 6, "rfilter": {"type": "box"}}
    camera = {"type": "thinlens", "aperture_radius": 0.3, "focus_distance": 4.0, "shutter_close": 1.0}
    return mi.load_dict({
        "type": "scene",
        "sensor": {**camera, "to_world": look, "film": film, "sampler": {"type": sampler}},
        "ground": {"type": "sphere", "center": [0, -101, 0], "radius": 100, "bsdf": {"type": "diffuse"}},
        "glass": {"type": "sphere", "center": [-1, 0, 0], "bsdf": {"type": "dielectric"}},
        "metal": {"type": "sphere", "center": [1, 0, 0], "bsdf": {"type": "roughconductor", "alpha": 0.2}},
        "lamp": {"type": "point", "position": [2, 3, 2]},
        "sky": {"type": "constant"},
    })  # fmt: skip


def image(scene, integrator, spp, seed=0):
    return np.array(mi.render(scene, integrator=mi.load_dict(integrator), spp=spp, seed=seed), dtype=np.float64)


def test_the_guide_names_all_variants_that_compile_for_the_processor():
    assert sorted(NAMED) == sorted(name for name in mi.variants() if name.startswith("llvm"))


@pytest.mark.parametrize("variant", NAMED)
@pytest.mark.parametrize(
    "domains", [["light"], pytest.param(["lens", "time", "pixel"], marks=pytest.mark.slow)], ids=" ".join
)
def test_every_domain_renders(variant, domains):
    """The samples of the scene's own, with equal weights, make the path tracer's image: ray by ray the same paths."""
    level = mi.logger().log_level()
    mi.set_log_level(mi.LogLevel.Error)  # no warning that films are grey
    mi.set_variant(variant)
    lit = scene()
    truth = image(lit, PATH, 64, seed=1)
    for domain in domains + (["wavelength"] if mi.is_spectral and "light" in domains else []):
        own = {"type": "reweighted", "nested": PATH, "domain": domain}
        equal = image(lit, {**own, "sampler": "scene", "weighted": False}, 64, seed=1)
        np.testing.assert_allclose(equal, truth, rtol=1e-4, atol=1e-5)
        weighted = image(lit, {**own, "debias": "auto"}, 64)
        assert weighted.mean() == pytest.approx(truth.mean(), rel=0.05)
    mi.set_log_level(level)


def test_derivatives_of_prb_are_not_those_of_polarized_light():
    mi.set_variant("llvm_ad_mono_polarized")
    with (
        pytest.raises(ValueError, match=r"'light' cannot wrap 'prb' in llvm_ad_mono_polarized.* nest 'path'"),
        one_line_errors(),
    ):
        mi.load_dict({"type": "reweighted", "domain": "light", "nested": {"type": "prb"}})


@pytest.mark.parametrize("plugin", ["plain", "reweighted", "moving", "owensobol"])
def test_scalar_variants_are_told_what_they_need(plugin):
    for variant in (name for name in mi.variants() if name.startswith("scalar")):
        mi.set_variant(variant)
        with pytest.raises(RuntimeError, match=rf"{plugin} needs a variant that compiles; call mitsuba\.set_variant"):
            mi.load_dict({"type": plugin})


@pytest.mark.parametrize(
    ("variant", "message"),
    [
        ("scalar_rgb", "unknown variant 'scalar_rgb'; choose one of llvm_ad_rgb,"),
        ("nonsense", "unknown variant 'nonsense'; choose one of llvm_ad_rgb,"),
        ("cuda_ad_rgb", "needs an NVIDIA GPU"),
    ],
)
@pytest.mark.parametrize("command", ["render", "compare"])
def test_the_command_line_refuses_other_variants(voroquad, tmp_path, command, variant, message):
    if variant.startswith("cuda") and dr.has_backend(dr.JitBackend.CUDA):
        pytest.skip("this machine has a GPU")
    run = voroquad(command, "depth-of-field", "--variant", variant, "-o", tmp_path / "o.exr")
    assert run.returncode == 2
    assert message in run.stderr
    assert run.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
