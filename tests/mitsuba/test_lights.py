"""Light at the first hit: the mean of Mitsuba's path tracers, with less noise where the sample that is weighed makes
it."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from voroquad.mitsuba.errors import one_line_errors

pytestmark = pytest.mark.usefixtures("one_thread")

#: Where the sets sample the light, a rule without bias
RULE = {"domain": "light", "sampler": "stratified", "debias": "leave-one-out", "sets": 64, "blend": "off"}


def film(size=12):
    return {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}, "pixel_format": "rgba"}


def box():
    """A Cornell box with an environment, a point light, rough metal, glass and a mask: every branch of a path."""
    description = mi.cornell_box()
    description["sensor"]["film"] = film()
    look = mi.ScalarTransform4f()
    leaf = {"type": "mask", "opacity": 0.5, "leaf": {"type": "twosided", "leaf": {"type": "diffuse"}}}
    glossy = {"type": "sphere", "center": [0.3, -0.6, 0.5], "radius": 0.3}
    glass = {"type": "sphere", "center": [-0.4, -0.6, 0.6], "radius": 0.3}
    return mi.load_dict(
        description
        | {
            "sky": {"type": "constant", "radiance": 0.3},
            "lamp": {"type": "point", "position": [0.2, 0.3, 0.5], "intensity": {"type": "rgb", "value": 1.0}},
            "glossy": glossy | {"bsdf": {"type": "roughconductor", "alpha": 0.1}},
            "glass": glass | {"bsdf": {"type": "dielectric"}},
            "mask": {"type": "rectangle", "to_world": look.translate([0.5, 0.3, 0.6]).scale(0.3), "bsdf": leaf},
        }
    )


def wall():
    """A diffuse wall before a large bright rectangle, a bar between: the emitter sample makes the noise."""
    look = mi.ScalarTransform4f()
    eye = look.look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
    black = {"type": "diffuse", "reflectance": 0.0}
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {"type": "perspective", "fov": 40, "film": film(), "to_world": eye},
            "wall": {"type": "rectangle", "to_world": look.scale(4)},
            "light": {
                "type": "rectangle", "to_world": look.translate([0, 0, 5]).rotate([0, 1, 0], 180).scale(3),
                "emitter": {"type": "area", "radiance": 1.0},
            },
            "bar": {"type": "cube", "to_world": look.translate([0.3, 0, 1]).scale([0.1, 2, 0.1]), "bsdf": black},
        }
    )  # fmt: skip


def images(scene, count, spp=16, **plugin):
    return [
        np.array(mi.render(scene, integrator=mi.load_dict(plugin | redrawn(plugin, k)), spp=spp, seed=k), np.float64)
        for k in range(count)
    ]


def redrawn(plugin, k):
    return {"table_seed": k} if plugin["type"] == "reweighted" else {}


NESTED = [
    {"type": "path", "max_depth": 4},
    {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
    pytest.param({"type": "path", "max_depth": 3, "hide_emitters": True}, marks=pytest.mark.slow),
    pytest.param({"type": "direct"}, marks=pytest.mark.slow),
    pytest.param({"type": "prb", "max_depth": 3}, marks=pytest.mark.slow),
]


BY_DIRECTIONS = {"type": "direct", "emitter_samples": 0, "bsdf_samples": 1}


@pytest.mark.statistical
@pytest.mark.parametrize(("scene", "nested"), [(box, {"type": "path", "max_depth": 4}), (wall, BY_DIRECTIONS)])
def test_directions_have_the_mean_of_the_nested_integrator(scene, nested, pixel_z):
    """Of glass and rough metal too; not so the cells of uniform directions, whose weights are biased."""
    scene = scene()
    many = np.stack(images(scene, 8, 1024, **nested))[..., :3]

    def excess(**rule):
        got = images(scene, 40, type="reweighted", nested=nested, **RULE | {"domain": "direction"} | rule)
        return pixel_z([i[..., :3] for i in got], many.mean(0), many.var(0, ddof=1) / 8)

    own, largest = excess()
    assert own < 5
    assert largest < 7
    if nested is BY_DIRECTIONS:
        assert excess(sampler="uniform", debias="none")[0] > 10


@pytest.mark.statistical
@pytest.mark.parametrize("nested", NESTED)
def test_mean_is_that_of_the_nested_integrator(nested, pixel_z):
    scene = box()
    many = np.stack(images(scene, 8, 1024, **nested))
    got = images(scene, 40, type="reweighted", nested=nested, **RULE)
    excess, largest = pixel_z([i[..., :3] for i in got], many[..., :3].mean(0), many[..., :3].var(0, ddof=1) / 8)
    assert excess < 5
    assert largest < 7
    # alpha has no noise but the pixel's
    np.testing.assert_allclose(np.mean(got, 0)[..., 3], many[..., 3].mean(0), atol=0.15)


@pytest.mark.statistical
def test_a_weight_on_all_light_twice_would_show(pixel_z):
    """Negative control: the rays' own weights times N·w as well."""
    scene, nested = box(), mi.load_dict({"type": "direct"})
    many = np.stack(images(scene, 8, 1024, type="direct"))

    def image(seed):
        integrator = mi.load_dict(
            {"type": "reweighted", "nested": nested, **RULE, "sampler": "uniform", "table_seed": seed}
        )
        camera_rays = integrator.camera_rays

        def twice(sensor, sampler, *band):
            rays = camera_rays(sensor, sampler, *band)
            rays.weight = rays.weight * rays.drawn.factor
            return rays

        integrator.camera_rays = twice
        return np.array(mi.render(scene, integrator=integrator, spp=16, seed=seed), np.float64)[..., :3]

    excess, _ = pixel_z([image(k) for k in range(40)], many[..., :3].mean(0), many[..., :3].var(0, ddof=1) / 8)
    assert excess > 10


def test_paths_that_survive_the_roulette_count_for_those_that_do_not():
    """It plays from the first bounce on, or never."""
    own = {"type": "reweighted", "domain": "light", "sampler": "scene", "weighted": False}
    played, never = (
        images(box(), 1, 1024, **own, nested={"type": "path", "max_depth": 5, "rr_depth": depth})[0][..., :3].mean()
        for depth in (1, 99)
    )
    assert played == pytest.approx(never, rel=0.02)


@pytest.mark.parametrize(
    ("domain", "nested"),
    [("light", "path"), ("light", "prb"), ("direction", "path"), ("light+direction", "path")],
)
def test_the_scenes_own_samples_make_the_path_tracers_image(domain, nested):
    scene, nested = box(), {"type": nested, "max_depth": 4}
    own = {"type": "reweighted", "domain": domain, "sampler": "scene", "weighted": False, "nested": nested}
    got, expected = images(scene, 1, 16, **own)[0], images(scene, 1, 16, **nested)[0]
    np.testing.assert_allclose(got, expected, rtol=1e-4, atol=1e-5)


def test_noise_of_a_large_light():
    """2.5 × below uniform samples of the light, and below stratified ones."""
    scene = wall()
    nested = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0}
    common = {"type": "reweighted", "domain": "light", "jitter": False, "blend": "off", "nested": nested}
    truth = np.mean(images(scene, 2, 2048, samples=1024, sampler="sobol", weighted=False, **common), 0)

    def mse(**properties):
        return np.mean((np.stack(images(scene, 6, 64, **common, **properties)) - truth) ** 2)

    assert mse(sampler="uniform") < mse(sampler="uniform", weighted=False) / 2.5
    assert mse(sampler="stratified") < mse(sampler="stratified", weighted=False)


def test_noise_of_directions():
    """2 × below uniform directions: of a wall that finds its lamp by directions alone."""
    scene = wall()
    common = {"type": "reweighted", "domain": "direction", "jitter": False, "blend": "off", "nested": BY_DIRECTIONS}
    truth = np.mean(images(scene, 2, 2048, samples=1024, sampler="sobol", weighted=False, **common), 0)

    def mse(**properties):
        return np.mean((np.stack(images(scene, 6, 64, **common, **properties)) - truth) ** 2)

    assert mse(sampler="uniform") < mse(sampler="uniform", weighted=False) / 2
    assert mse(sampler="stratified") < mse(sampler="stratified", weighted=False)


def test_joint_with_the_pixel():
    """One set for the pixel and its light: weights are those of the whole ray."""
    scene = wall()
    image = images(scene, 1, 64, type="reweighted", domain="pixel+light", sampler="sobol", weighted=False,
                   nested={"type": "direct"})[0]  # fmt: skip
    truth = images(scene, 1, 1024, type="direct")[0]
    assert np.sqrt(np.mean((image - truth) ** 2)) < 0.1 * truth[..., :3].mean()


def test_a_wide_filter_divides_what_the_weights_multiply():
    """A wall in the sun is as bright everywhere, whatever the weights of the emitter samples."""
    look = mi.ScalarTransform4f()
    wide = film() | {"rfilter": {"type": "gaussian"}, "pixel_format": "rgb"}
    eye = look.look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
    scene = {"type": "scene", "sensor": {"type": "perspective", "fov": 20, "film": wide, "to_world": eye}}
    scene |= {"wall": {"type": "rectangle", "to_world": look.scale(4)}}
    scene |= {"sun": {"type": "directional", "direction": [0, 0, -1]}}
    made = images(mi.load_dict(scene), 1, type="reweighted", nested={"type": "direct"}, **RULE | {"sampler": "uniform"})
    np.testing.assert_allclose(made[0], 0.5 / np.pi, rtol=1e-5)


def test_derivatives_are_those_of_the_weighted_image():
    """The image is linear in the light's radiance: derivative = image(1) − image(0)."""
    scene = wall()
    integrator = mi.load_dict({"type": "reweighted", "nested": {"type": "path", "max_depth": 3}, **RULE})
    parameters = mi.traverse(scene)
    key = "light.emitter.radiance.value"

    def lit(value):
        parameters[key] = value
        parameters.update()
        return np.array(mi.render(scene, integrator=integrator, spp=16, seed=5))

    difference = lit(1.0) - lit(0.0)
    theta = mi.Float(1)
    dr.enable_grad(theta)
    parameters[key] = theta
    parameters.update()
    dr.set_grad(theta, 1)
    dr.enqueue(dr.ADMode.Forward, theta)
    derivative = np.array(integrator.render_forward(scene, parameters, seed=5, spp=16))
    np.testing.assert_allclose(derivative[..., :3], difference[..., :3], rtol=1e-3, atol=1e-4)


def test_derivatives_through_prb_have_equal_weights():
    """It draws light samples of its own: the weights of a set's would be noise."""
    scene = wall()
    rule = {"domain": "pixel+light", "sampler": "stratified", "order": 1, "debias": "leave-one-out", "sets": 8}
    parameters = mi.traverse(scene)
    derivatives = []
    for weighted in (True, False):
        theta = mi.Float(1)
        dr.enable_grad(theta)
        parameters["light.emitter.radiance.value"] = theta
        parameters.update()
        dr.set_grad(theta, 1)
        dr.enqueue(dr.ADMode.Forward, theta)
        nested = {"type": "prb", "max_depth": 3}
        integrator = mi.load_dict({"type": "reweighted", "nested": nested, "weighted": weighted, **rule})
        derivatives.append(np.array(integrator.render_forward(scene, parameters, seed=5, spp=16)))
    assert np.abs(derivatives[0]).max() > 0.1
    np.testing.assert_allclose(*derivatives, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(
    ("nested", "message"),
    [
        ({"type": "volpath"}, "cannot wrap VolumetricPathIntegrator"),
        ({"type": "aov", "aovs": "d:depth", "inner": {"type": "path"}}, "cannot wrap AOVIntegrator"),
        ({"type": "prb_basic"}, "cannot wrap BasicPRBIntegrator"),
        ({"type": "direct", "emitter_samples": 4}, "one emitter sample"),
        ({"type": "direct", "emitter_samples": 0, "bsdf_samples": 1}, "one emitter sample"),
        ({"type": "path", "max_depth": 1}, "greater max_depth"),
    ],
)
def test_nested_integrators_that_do_not_fit(nested, message):
    with pytest.raises(ValueError, match=message), one_line_errors():
        mi.load_dict({"type": "reweighted", "domain": "light", "nested": nested})


def test_directions_need_a_bsdf_sample():
    nested = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0}
    message = "'direction' needs .* one BSDF sample and at most one emitter"
    with pytest.raises(ValueError, match=message), one_line_errors():
        mi.load_dict({"type": "reweighted", "domain": "direction", "nested": nested})


def test_prb_is_known_after_a_change_of_variant():
    """Its base classes are those of the variant."""
    for variant in ("llvm_ad_spectral", "llvm_ad_rgb"):
        mi.set_variant(variant)
        mi.load_dict({"type": "reweighted", "domain": "light", "nested": {"type": "prb"}})


def test_a_scene_without_light():
    scene = mi.load_dict(
        {"type": "scene", "sensor": {"type": "perspective", "film": film()}, "ball": {"type": "sphere"}}
    )
    integrator = mi.load_dict({"type": "reweighted", "domain": "light", "nested": {"type": "path"}})
    with pytest.raises(ValueError, match="add one, such as an area light"), one_line_errors():
        mi.render(scene, integrator=integrator, spp=4)
