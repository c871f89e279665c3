"""What is nested keeps its channels: those that Mitsuba renders by it alone, in the same order."""

from __future__ import annotations

from collections.abc import Iterator

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from voroquad.mitsuba.tracing import children

pytestmark = pytest.mark.usefixtures("one_thread")

DIRECT = {"type": "direct"}
DEPTH = {"type": "aov", "aovs": "d:depth"}
#: Mitsuba renders each image by itself, so that a second one equals ours only if it takes no random numbers
TWO_IMAGES = {**DEPTH, "a": DIRECT, "b": {"type": "depth"}}
STOKES = [f"S{k}.{c}" for k in range(4) for c in "RGB"]
MOMENTS = [f"{kind}m.{c}" for kind in ("", "m2_") for c in "XYZ"]


def scene(pixel_format: str = "rgb") -> mi.Scene:
    """A glossy and a glass sphere under a lamp, seen by a tilted camera."""
    look = mi.ScalarTransform4f().look_at([0.5, 1, 4], [0.2, 0, 0], [0.3, 1, 0])
    film = {"type": "hdrfilm", "width": 12, "height": 9, "rfilter": {"type": "box"}, "pixel_format": pixel_format}
    return mi.load_dict({
        "type": "scene",
        "sensor": {"type": "perspective", "to_world": look, "film": film, "sampler": {"type": "independent"}},
        "glass": {"type": "sphere", "bsdf": {"type": "dielectric"}},
        "metal": {"type": "sphere", "center": [1.3, 0.2, 1], "radius": 0.6, "bsdf": {"type": "roughconductor"}},
        "lamp": {"type": "point", "position": [2, 3, 2]},
        "sky": {"type": "constant"},
    })  # fmt: skip


@pytest.fixture
def quiet() -> Iterator[None]:
    """Without Mitsuba's warning that it turns every film into a grey one."""
    level = mi.logger().log_level()
    mi.set_log_level(mi.LogLevel.Error)
    yield
    mi.set_log_level(level)


def assert_same_channels(nested, names, pixel_format="rgb"):
    """`plain` and `reweighted` around an integrator give its own image's channels, by these names."""
    lit = scene(pixel_format)
    alone = np.array(mi.render(lit, integrator=mi.load_dict(nested), spp=4, seed=3))
    film = lit.sensors()[0].film()
    plain = mi.load_dict({"type": "plain", "nested": nested})
    np.testing.assert_allclose(np.array(mi.render(lit, integrator=plain, spp=4, seed=3)), alone, rtol=1e-5, atol=1e-6)
    assert plain.developed_names(film) == names
    own = {"type": "reweighted", "nested": nested, "domain": "pixel", "sampler": "scene", "aovs": "lambda"}
    ours = mi.load_dict({**own, "weighted": False})
    image = np.array(mi.render(lit, integrator=ours, spp=4, seed=3))
    np.testing.assert_allclose(image[..., :-1], alone, rtol=1e-5, atol=1e-6)
    assert ours.developed_names(film) == [*names, "lambda"]
    return alone


@pytest.mark.parametrize(
    ("nested", "pixel_format", "names"),
    [
        ({**DEPTH, "a": DIRECT}, "rgb", [*"RGB", "d.T"]),
        (TWO_IMAGES, "rgba", [*"RGBA", "b.R", "b.G", "b.B", "b.A", "d.T"]),
        (TWO_IMAGES, "luminance", ["Y", "b.Y", "d.T"]),
        (DEPTH, "rgb", ["d.T"]),
        ({"type": "moment", "m": DIRECT}, "rgb", [*"RGB", *MOMENTS]),
        ({**DEPTH, "m": {**DEPTH, "a": DIRECT}, "b": {"type": "depth"}}, "rgb",
         [*"RGB", "d.T", "b.R", "b.G", "b.B", "m.a.R", "m.a.G", "m.a.B", "m.a.A", "m.d.T", "d.T.2"]),
        ({**DEPTH, "k": {"type": "moment", "m": DIRECT}}, "rgb",
         [*"RGB", *MOMENTS, *(f"k.{name}" for name in MOMENTS), "d.T"]),
    ],
)  # fmt: skip
def test_channels_are_those_of_the_nested_integrator(nested, pixel_format, names):
    assert_same_channels(nested, names, pixel_format)


@pytest.mark.usefixtures("quiet")
@pytest.mark.parametrize(
    ("nested", "names"),
    [
        ({"type": "stokes", "a": DIRECT}, STOKES),
        ({"type": "stokes", "a": {**DEPTH, "b": DIRECT}}, [*STOKES, "b.R", "b.G", "b.B", "b.A", "d.T"]),
    ],
)
def test_stokes_parameters_are_mitsubas(nested, names):
    """The linear ones differ from zero: the glass polarizes the sky, and the camera is tilted."""
    mi.set_variant("llvm_ad_mono_polarized")
    image = assert_same_channels(nested, ["Y", *names])
    assert (np.abs(image[..., 4:10]).max((0, 1)) > 0.01).all()


@pytest.mark.usefixtures("quiet")
def test_stokes_parameters_of_spectra_are_mitsubas():
    mi.set_variant("llvm_ad_spectral_polarized")
    assert_same_channels({"type": "stokes", "a": DIRECT}, [*"RGB", *STOKES])


def derivative(nested):
    """Of the sum of each channel by the radiance of the sky, backward, and the channels' sums."""
    lit = scene()
    plain = mi.load_dict({"type": "plain", "nested": nested})
    parameters = mi.traverse(lit)
    image = np.array(mi.render(lit, integrator=plain, spp=4, seed=3))
    slopes = []
    for channel in range(image.shape[-1]):
        sky = mi.Float(1)
        dr.enable_grad(sky)
        parameters["sky.radiance.value"] = sky
        parameters.update()
        gradient = np.zeros_like(image)
        gradient[..., channel] = 1
        plain.render_backward(lit, parameters, mi.TensorXf(gradient), seed=3, spp=4)
        slopes.append(dr.grad(sky)[0])
    return slopes, image.sum((0, 1))


def test_derivatives_by_channel():
    """Of colours that are linear in the sky's radiance, and of their second moments, quadratic in it."""
    slopes, sums = derivative({"type": "moment", "m": DIRECT})
    np.testing.assert_allclose(slopes, sums * np.repeat([1, 1, 2], 3), rtol=0.01)


def test_derivatives_of_aov_are_refused():
    """Mitsuba's `aov` cuts them: they would be zero without a word."""
    for nested in ({**DEPTH, "a": DIRECT}, {"type": "moment", "m": {**DEPTH, "a": DIRECT}}):
        with pytest.raises(NotImplementedError, match="nest the integrator inside it by itself"):
            derivative(nested)


def test_children_are_found():
    outer = mi.load_dict(TWO_IMAGES)
    assert [child.class_name() for child in children(outer)] == ["DirectIntegrator", "DepthIntegrator"]
    assert children(children(outer)[0]) == []
