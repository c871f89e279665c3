"""The sampler ``owensobol``: nets in pixels and squares of pixels, the same bits however an image is cut, no bias."""

from __future__ import annotations

import itertools

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from voroquad.mitsuba import accumulation
from voroquad.mitsuba.errors import one_line_errors
from voroquad.mitsuba.generators import upper_digits

pytestmark = pytest.mark.usefixtures("one_thread")

GENERATORS = ["joe-kuo", "sz"]
WIDTH, HEIGHT = 8, 4
SIZE = {"width": WIDTH, "height": HEIGHT}
INTEGRATORS = ["path", "direct", "volpath", "volpathmis", "ptracer", "prb", "prb_basic", "prbvolpath"]


def sampler(**properties):
    return mi.load_dict({"type": "owensobol", "sample_count": 16} | properties)


def draw(own, dimensions, seed=0, pixels=WIDTH * HEIGHT, spp=None):
    """Coordinates (dimensions, pixels, spp), drawn two at a time."""
    spp = spp or own.sample_count()
    own.seed(seed, pixels * spp)
    values = [np.array(axis) for _ in range(dimensions // 2) for axis in own.next_2d()]
    return np.array(values).reshape(dimensions, pixels, spp)


def is_net(points):
    """Does every elementary interval of the area of a point have one of the points (2, n)?"""
    n = points.shape[1]
    for rows in (1 << k for k in range(n.bit_length())):
        boxes = (points[0] * rows).astype(int) + rows * (points[1] * (n // rows)).astype(int)
        if len(set(boxes)) < n:
            return False
    return True


# ---------------------------------------------------------------------- how samples are spread


@pytest.mark.parametrize("spp", [1, 2, 8, 16, 64])
@pytest.mark.parametrize("order", ["morton", "none"])
@pytest.mark.parametrize("generators", GENERATORS)
def test_each_pixel_has_a_net(generators, order, spp):
    drawn = draw(sampler(sample_count=spp, order=order, generators=generators, **SIZE), 2)
    assert all(is_net(drawn[:, pixel]) for pixel in range(drawn.shape[1]))


@pytest.mark.parametrize("generators", GENERATORS)
@pytest.mark.parametrize("order", ["morton", "none"])
@pytest.mark.parametrize("spp", [16, 32])
def test_points_of_a_row_or_a_column_of_cells_are_evenly_spaced(generators, order, spp):
    """In rows and columns of cells of each pixel, up to the place in an n-th of the interval; the control in all."""
    drawn = draw(sampler(sample_count=spp, order=order, generators=generators, **SIZE), 2)
    upper = upper_digits(spp.bit_length() - 1)
    for axis in (0, 1):
        place = (drawn[axis] * spp).astype(int) % (spp >> upper[axis])
        row = (drawn[1 - axis] * (1 << upper[1 - axis])).astype(int)
        for pixel in range(WIDTH * HEIGHT):
            assert all(len(set(place[pixel, row[pixel] == k])) == 1 for k in range(1 << upper[1 - axis]))
    jittered = draw(mi.load_dict({"type": "stratified", "sample_count": 16}), 2)[0, 0]
    assert len(set((jittered * 16).astype(int) % 4)) > 1


def test_a_pair_begins_at_an_even_coordinate():
    """Of whichever number of single coordinates before it: else its two belong to two pairs, and make no net."""
    own = sampler(**SIZE)
    own.seed(0, WIDTH * HEIGHT * 16)
    own.next_1d()
    pair = np.array(own.next_2d()).reshape(2, -1, 16)
    assert all(is_net(pair[:, pixel]) for pixel in range(WIDTH * HEIGHT))


@pytest.mark.parametrize("spp", [2, 4, 8])
@pytest.mark.parametrize("generators", GENERATORS)
def test_squares_of_pixels_have_a_net_together(generators, spp):
    """2 × 2, 4 × 4 and, of the whole of a square image, 8 × 8 pixels."""
    drawn = draw(sampler(sample_count=spp, generators=generators, width=8, height=8), 4, pixels=64)
    image = drawn.reshape(4, 8, 8, spp)
    for side in (2, 4, 8):
        for y, x in itertools.product(range(0, 8, side), repeat=2):
            points = image[:, y : y + side, x : x + side].reshape(4, -1)
            assert is_net(points[:2])
            assert generators == "joe-kuo" or is_net(points[2:])


def test_blocks_of_eight_by_eight_pixels_have_scrambles_of_their_own():
    """Each block is a net with one place in each interval; those of two blocks are not the same ones, nor one net."""
    drawn = draw(sampler(sample_count=4, width=16, height=8), 2, pixels=128)
    blocks = [drawn.reshape(2, 8, 16, 4)[:, :, k : k + 8].reshape(2, -1) for k in (0, 8)]
    assert all(map(is_net, blocks))
    places = [np.sort(block[0]) * 256 % 1 for block in blocks]
    assert abs(np.corrcoef(*places)[0, 1]) < 0.3
    assert not is_net(np.concatenate(blocks, 1))


@pytest.mark.parametrize("control", [{"type": "owensobol", "order": "none"}, {"type": "independent"}])
def test_without_the_order_they_do_not(control):
    own = mi.load_dict({"sample_count": 4} | control)
    assert not is_net(draw(own, 2, pixels=64).reshape(2, -1))


@pytest.mark.parametrize("spp", [3, 6, 20])
def test_any_number_of_samples_is_the_beginning_of_a_net(spp):
    full = 1 << (spp - 1).bit_length()
    drawn = draw(sampler(sample_count=spp, **SIZE), 2)
    for pixel in range(WIDTH * HEIGHT):
        strata = (drawn[0, pixel] * full).astype(int)
        assert len(set(strata)) == spp


@pytest.mark.parametrize("order", ["morton", "none"])
def test_pairs_beyond_the_joint_coordinates_are_as_good(order):
    """The first coordinates come again, in another order: no pair of old and new ones lies on a diagonal."""
    own = sampler(sample_count=64, order=order, **SIZE)
    own.seed(0, WIDTH * HEIGHT * 64)
    first = np.array(own.next_2d())
    for _ in range(127):
        own.next_2d()
    again = np.array(own.next_2d()).reshape(2, -1, 64)
    assert all(is_net(again[:, pixel]) for pixel in range(WIDTH * HEIGHT))
    boxes = (first[0].reshape(-1, 64)[0] * 8).astype(int) + 8 * (again[0, 0] * 8).astype(int)
    assert len(set(boxes)) > 24  # 8 on a diagonal; 41 on average if independent


# ---------------------------------------------------------------------- uniform and unbiased


@pytest.mark.statistical
@pytest.mark.parametrize("spp", [1, 3, 16])
@pytest.mark.parametrize("order", ["morton", "none"])
@pytest.mark.parametrize("generators", GENERATORS)
def test_every_sample_of_every_pixel_is_uniform(generators, order, spp):
    """Over seeds: means of x, x², and of the product of two coordinates."""
    own = sampler(sample_count=spp, generators=generators, order=order, width=4, height=3)
    seeds = 1024
    x = np.stack([draw(own, 4, seed, pixels=12) for seed in range(seeds)]).astype(np.float64)
    moments = [(x, 1 / 2, 1 / 12), (x**2, 1 / 3, 4 / 45), (x[:, 0] * x[:, 1], 1 / 4, 7 / 144)]
    for values, mean, variance in moments:
        z = (values.mean(0) - mean) / np.sqrt(variance / seeds)
        assert np.abs(z).max() < 5.8
        assert z.shape[-1] > 1 or abs(np.mean(z**2) - 1) < 5


@pytest.mark.statistical
def test_other_seeds_give_other_numbers():
    """Numbers of seeds next to each other, of a render and of the sampler, are not correlated."""
    drawn = [draw(sampler(seed=own, **SIZE), 2, seed) for own in range(2) for seed in range(128)]
    for shift in (1, 128):
        correlations = [np.corrcoef(a.ravel(), b.ravel())[0, 1] for a, b in zip(drawn, drawn[shift:], strict=False)]
        assert abs(np.mean(correlations)) < 5 * np.std(correlations) / np.sqrt(len(correlations))
        assert max(correlations) < 0.99


# ---------------------------------------------------------------------- the same bits


def test_a_seed_compiles_once():
    own = sampler(**SIZE)
    kernels = []
    for seed in (1, 2, 3):
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            draw(own, 2, seed)
            kernels.append([kernel.get("cache_hit", True) for kernel in dr.kernel_history()])
    assert all(kernels[1] + kernels[2])


@pytest.mark.parametrize("order", ["morton", "none"])
@pytest.mark.parametrize("spp", [12, 16])
def test_passes_have_the_samples_of_one_go(order, spp):
    whole = draw(sampler(sample_count=spp, order=order, **SIZE), 2, seed=5)
    own = sampler(sample_count=spp, order=order, **SIZE)
    own.seed(5, WIDTH * HEIGHT * 4)
    for start in range(0, spp, 4):
        np.testing.assert_array_equal(np.array(own.next_2d()).reshape(2, -1, 4), whole[..., start : start + 4])
        own.advance()
        own.schedule_state()


@pytest.mark.parametrize("order", ["morton", "none"])
def test_bands_of_rows_have_the_samples_of_one_go(order):
    whole = draw(sampler(order=order, **SIZE), 2, seed=5)
    own = sampler(order=order)
    for rows in (range(1), range(1, 4)):
        own.cover(WIDTH, HEIGHT, rows)
        drawn = draw(own, 2, seed=5, pixels=WIDTH * len(rows))
        np.testing.assert_array_equal(drawn, whole[:, rows.start * WIDTH : rows.stop * WIDTH])


def test_beyond_the_samples_that_were_asked_for_come_others():
    own = sampler(sample_count=4, **SIZE)
    own.seed(0, WIDTH * HEIGHT * 4)
    first = np.array(own.next_1d())
    own.advance()
    assert (np.array(own.next_1d()) != first).mean() > 0.99


@pytest.mark.parametrize("size", [(2**16 + 9, 3), (3, 2**16 + 9), (2**19, 2**19)])
def test_images_of_more_than_two_to_the_sixteen_pixels_a_side(size):
    """Rows of their last pixels: each has a net of its own, and neighbours do not share them."""
    width, height = size
    rows = max(1, 2**7 // width)
    own = sampler(sample_count=4)
    own.cover(width, height, range(height - rows, height))
    drawn = draw(own, 2, pixels=width * rows)[:, -64:]
    assert all(is_net(drawn[:, pixel]) for pixel in range(64))
    assert len({drawn[:, pixel].tobytes() for pixel in range(64)}) == 64


def test_a_clone_goes_on_by_itself():
    own = sampler(**SIZE)
    own.seed(3, WIDTH * HEIGHT * 16)
    own.next_2d()
    other = own.clone()
    np.testing.assert_array_equal(np.array(own.next_2d()), np.array(other.next_2d()))
    np.testing.assert_array_equal(np.array(own.next_1d()), np.array(other.next_1d()))
    assert str(own) == str(other)
    assert other.wavefront_size() == own.wavefront_size()


# ---------------------------------------------------------------------- in renders


def box(integrator, own, **camera):
    """A floor and a ball under a lamp: small, and compiled fast."""
    look = mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", **SIZE, "rfilter": {"type": "box"}}
    white = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.7}}
    lamp = mi.ScalarTransform4f().translate([0, 2, 1]).rotate([1, 0, 0], 90).scale(0.7)
    depth = {} if integrator == "direct" else {"max_depth": 3}
    return mi.load_dict({
        "type": "scene",
        "integrator": {"type": integrator} | depth,
        "sensor": {"type": "perspective", "fov": 50.0, "to_world": look, "film": film, "sampler": own} | camera,
        "floor": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(2), "bsdf": white},
        "ball": {"type": "sphere", "center": [0.3, 0, 0.5], "radius": 0.5, "bsdf": white},
        "lamp": {"type": "rectangle", "to_world": lamp, "emitter": {"type": "area", "radiance": 5.0}},
    })  # fmt: skip


OWN = {"type": "owensobol", **SIZE}


def levels(scene, spp, seeds):
    """Means of images of these seeds."""
    return np.array([np.array(mi.render(scene, spp=spp, seed=seed), dtype=np.float64).mean() for seed in seeds])


def z_score(a, b):
    return (a.mean() - b.mean()) / np.sqrt(a.var(ddof=1) / len(a) + b.var(ddof=1) / len(b))


@pytest.mark.statistical
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_renders_have_the_mean_of_independent_samples(integrator):
    truth = levels(box(integrator, {"type": "independent"}), 512, range(32))
    own = levels(box(integrator, OWN), 16, range(64))
    # A t of some 32 degrees of freedom; a few per cent of light too much would show
    assert abs(z_score(own, truth)) < 5.5
    assert abs(z_score(own * {"ptracer": 1.25, "prb_basic": 1.3}.get(integrator, 1.04), truth)) > 5.5
    assert own.std() < levels(box(integrator, {"type": "independent"}), 16, range(32)).std()


@pytest.mark.parametrize("variant", [name for name in mi.variants() if name.startswith("llvm")])
def test_every_variant_that_compiles_renders(variant):
    level = mi.logger().log_level()
    mi.set_log_level(mi.LogLevel.Error)  # no warning that films are grey
    mi.set_variant(variant)
    truth = levels(box("path", {"type": "independent"}), 1024, range(2))
    assert levels(box("path", OWN), 64, range(2)).mean() == pytest.approx(truth.mean(), rel=0.02)
    mi.set_log_level(level)


@pytest.mark.parametrize(
    ("integrator", "mode"),
    [
        ("prb", "forward"),
        ("prb", "backward"),
        ("prb_basic", "forward"),
        ("prb_basic", "backward"),
        ("prbvolpath", "backward"),
    ],
)
def test_both_passes_of_a_derivative_see_the_samples_of_the_image(integrator, mode):
    """The image is linear in the light: its derivative by a factor of it is the image of the same samples."""
    scene = box(integrator, OWN)
    image = np.array(mi.render(scene, spp=16, seed=2)).sum()
    parameters = mi.traverse(scene)
    factor = mi.Float(1)
    dr.enable_grad(factor)
    key = "lamp.emitter.radiance.value"
    parameters[key] = parameters[key] * factor
    parameters.update()
    total = dr.sum(mi.render(scene, parameters, spp=16, seed=1, seed_grad=2), axis=None)
    if mode == "forward":
        dr.forward(factor)
        slope = dr.grad(total).array[0]
    else:
        dr.backward(total)
        slope = dr.grad(factor)[0]
    assert slope == pytest.approx(image, rel=1e-4)


def test_xml_and_dict_are_one(tmp_path):
    text = """<sampler type="owensobol" version="3.0.0">
        <integer name="sample_count" value="16"/> <integer name="width" value="8"/> <integer name="height" value="4"/>
        <string name="order" value="morton"/> <string name="generators" value="joe-kuo"/>
        <integer name="seed" value="7"/>
    </sampler>"""
    properties = {**SIZE, "order": "morton", "generators": "joe-kuo", "seed": 7}
    np.testing.assert_array_equal(draw(mi.load_string(text), 4), draw(sampler(**properties), 4))


@pytest.mark.parametrize(
    ("properties", "message"),
    [
        ({"order": "hilbert"}, "unknown order 'hilbert'; choose one of morton, none"),
        ({"generators": "halton"}, "unknown generators 'halton'; choose one of joe-kuo, sz, auto"),
        ({"width": 8}, "width and height must be those of the image in pixels, or both 0, got 8 and 0"),
        ({"width": -8, "height": -4}, "or both 0, got -8 and -4"),
        ({"width": 8.5, "height": 4}, "width must be a whole number, got 8.5"),
        ({"seed": "x"}, "seed"),
        ({"sample_count": 0}, "sample_count must be a whole number of at least 1, got 0"),
        ({"samples": 4}, "samples"),
    ],
)
def test_wrong_properties_are_refused(properties, message):
    with pytest.raises((ValueError, RuntimeError), match=message), one_line_errors():
        sampler(**properties)


def test_a_wrong_size_is_refused():
    own = sampler(width=7, height=4)
    with pytest.raises(ValueError, match=r"width=7 and height=4 are not the size of an image of 512 samples; give"):
        own.seed(0, WIDTH * HEIGHT * 16)
    own.seed(0, 1)  # what Mitsuba does after a render


# ---------------------------------------------------------------------- in the plug-ins of this package


def plugin(kind, **properties):
    return mi.load_dict({"type": kind, "nested": {"type": "direct"}} | properties)


@pytest.mark.parametrize("kind", [
    ("plain", {}),
    ("reweighted", {"domain": "pixel", "sampler": "scene", "weighted": False}),
])  # fmt: skip
def test_plugins_set_the_size(kind):
    """Without a size in the scene, their images are those of a scene that has it."""
    name, properties = kind
    images = [
        np.array(mi.render(box("direct", own), integrator=plugin(name, **properties), spp=8, seed=3))
        for own in ({"type": "owensobol"}, OWN)
    ]
    np.testing.assert_array_equal(*images)
    nested = np.array(mi.render(box("direct", OWN), spp=8, seed=3))
    np.testing.assert_allclose(images[0], nested, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("order", ["morton", "none"])
@pytest.mark.parametrize("rays", [1, 3 * WIDTH * 8])
def test_an_image_in_bands_has_the_bits_of_one_in_one_go(monkeypatch, rays, order):
    scene = box("direct", {"type": "owensobol", "order": order})
    whole = np.array(mi.render(scene, integrator=plugin("plain"), spp=8, seed=3))
    monkeypatch.setattr(accumulation, "BAND_RAYS", rays)
    np.testing.assert_array_equal(np.array(mi.render(scene, integrator=plugin("plain"), spp=8, seed=3)), whole)


def test_a_filters_border_counts_to_the_size():
    scene = box("direct", {"type": "owensobol"})
    film = {"type": "hdrfilm", **SIZE, "rfilter": {"type": "gaussian"}, "sample_border": True}
    camera = mi.load_dict({"type": "perspective", "film": film, "sampler": {"type": "owensobol"}})
    drawn, _ = plugin("plain").prepare(camera, 0, 4)
    assert f"width = {WIDTH + 4}, height = {HEIGHT + 4}," in str(drawn)
    assert np.isfinite(np.array(mi.render(scene, sensor=camera, integrator=plugin("plain"), spp=4))).all()


@pytest.mark.parametrize(("blend", "order"), [("auto", "none"), ("off", "morton")])
def test_pixels_are_independent_where_one_half_chooses_for_the_other(blend, order):
    integrator = plugin("reweighted", domain="pixel", blend=blend)
    drawn, _ = integrator.prepare(box("direct", {"type": "owensobol"}).sensors()[0], 0, 4)
    assert f"order = {order}" in str(drawn)


def test_wavefronts_of_one_sample_make_nets_too():
    """So do moving objects, of whose slices each is a wavefront."""
    own = sampler(order="none")
    own.set_samples_per_wavefront(1)
    own.seed(0, 32)
    drawn = []
    for _ in range(16):
        drawn.append(np.array(own.next_2d()))
        own.advance()
    assert all(is_net(np.array(drawn)[:, :, pixel].T) for pixel in range(32))


def test_pixels_can_be_picked_of_a_known_image_only():
    own = sampler()
    with pytest.raises(ValueError, match=r"pick needs the size of the image; call cover\(width, height, range\(he"):
        own.pick(mi.UInt32([1, 2]))
    own.cover(WIDTH, HEIGHT, range(HEIGHT))
    own.pick(mi.UInt32([1, 2]))


def picked(own, pixels, spp, draws=1):
    """Coordinates (2 · draws, pixels, spp) of some pixels, a sample of each at a time."""
    own.pick(mi.UInt32(pixels))
    own.set_samples_per_wavefront(1)
    own.seed(0, len(pixels))
    drawn = []
    for _ in range(spp):
        drawn.append([np.array(axis) for _ in range(draws) for axis in own.next_2d()])
        own.advance()
    return np.moveaxis(np.array(drawn), 0, -1)


@pytest.mark.parametrize("order", ["morton", "none"])
def test_picked_pixels_have_the_samples_of_the_whole_image(order):
    pixels = [3, WIDTH + 1, 3 * WIDTH + 2]
    own = sampler(sample_count=16, order=order, **SIZE)
    whole = draw(own, 4)
    np.testing.assert_array_equal(picked(own, pixels, 16, 2), whole[:, pixels])


def test_picked_pixels_begin_at_samples_of_their_own():
    """A pixel may come twice, and the next wavefront goes on in each."""
    pixels, starts = [3, WIDTH + 1, 3], [4, 0, 8]
    own = sampler(sample_count=16, order="none", **SIZE)
    whole = draw(own, 2)
    own.pick(mi.UInt32(pixels), mi.UInt32(starts))
    own.set_samples_per_wavefront(2)
    own.seed(0, 2 * len(pixels))
    drawn = [np.array(own.next_2d()).reshape(2, -1, 2)]
    own.advance()
    drawn = np.concatenate([*drawn, np.array(own.next_2d()).reshape(2, -1, 2)], -1)
    for k, (pixel, start) in enumerate(zip(pixels, starts, strict=True)):
        np.testing.assert_array_equal(drawn[:, k], whole[:, pixel, start : start + 4])


def test_samples_that_need_no_order_are_those_with_reversed_bits():
    """Of powers of two: rays that are traced at once are not as far apart as consecutive points."""
    for spp, turns in ((1, [0]), (8, [0, 4, 2, 6, 1, 5, 3, 7]), (12, list(range(12)))):
        own = sampler(sample_count=spp, **SIZE)
        whole = draw(own, 4)
        own.consecutive = False
        np.testing.assert_array_equal(draw(own, 4), whole[:, :, turns])


def test_slices_of_moving_objects_have_the_samples_of_the_whole_image(monkeypatch):
    """Each slice has some pixels: their squares have nets together, as all pixels do."""
    drawn = {}

    def noted(self, sensor, own, index, corner):
        found = camera_sample(self, sensor, own, index, corner)
        for axes in zip(*(np.array(v) for v in (corner.x, corner.y, found.pixel.x, found.pixel.y)), strict=True):
            drawn.setdefault((int(axes[0]), int(axes[1])), []).append(axes[2:])
        return found

    kind = type(plugin("reweighted", domain="time", slices=True))
    camera_sample = kind.camera_sample
    monkeypatch.setattr(kind, "camera_sample", noted)
    scene = box("direct", {"type": "owensobol"}, shutter_close=1.0)
    width, height = scene.sensors()[0].film().size()
    motion = {"domain": "time", "slices": True, "weighted": False}
    mi.render(scene, integrator=plugin("reweighted", **motion), spp=4, seed=0)
    own = sampler(sample_count=4, width=int(width), height=int(height))
    whole = draw(own, 2, pixels=int(width) * int(height))
    got = np.array([[drawn[x, y] for x in range(width)] for y in range(height)])  # (height, width, spp, 2)
    np.testing.assert_array_equal(np.moveaxis(got.reshape(-1, 4, 2), -1, 0), whole)


def test_the_values_of_a_set_make_nets_with_each_coordinate_drawn():
    """As sets of one coordinate are in rising order; in another order they make none."""
    integrator = plugin("reweighted", domain="time", sampler="stratified", blend="off")
    scene = box("direct", {"type": "owensobol"}, shutter_close=1.0)
    sensor = scene.sensors()[0]
    own, spp = integrator.prepare(sensor, 0, 16)
    drawn = integrator.camera_rays(sensor, own).drawn
    x, y, times = (np.array(axis).reshape(-1, spp) for axis in (drawn.pixel.x, drawn.pixel.y, drawn.time))
    for axis in (x, y):
        assert all(is_net(np.array(pair)) for pair in zip(axis, times, strict=True))
        assert not is_net(np.array([axis[0], times[0][np.random.default_rng(0).permutation(spp)]]))


def test_moving_objects_take_it():
    motion = {"domain": "time", "slices": True, "weighted": False}
    scenes = [box("direct", {"type": kind}, shutter_close=1.0) for kind in ("owensobol", "independent")]
    images = [np.array(mi.render(s, integrator=plugin("reweighted", **motion), spp=16, seed=3)) for s in scenes]
    assert images[0].mean() == pytest.approx(images[1].mean(), rel=0.1)
