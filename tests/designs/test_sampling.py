import math
from functools import partial
from itertools import combinations_with_replacement

import numpy as np
import pytest
from scipy.stats import chisquare, kstest, qmc

import voroquad as vq
from voroquad.designs.design import DESIGNS, design_of
from voroquad.designs.grids import grid_shape, inside, largest_grid, stratum_index
from voroquad.designs.multi_jittered import colours, offsets
from voroquad.designs.orthogonal import prime_power
from voroquad.designs.sampling import largest_size


@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize("d", [1, 2])
def test_points_fill_the_box_and_repeat_with_the_seed(design, d):
    one = vq.sample(design, n=64, d=d, rng=7)
    again = vq.sample(design, n=64, d=d, rng=np.random.default_rng(7))
    assert one.points.shape == (64, d)
    assert one.points.dtype == np.float64
    assert one.points.flags.c_contiguous
    assert ((one.points >= 0) & (one.points < 1)).all()
    np.testing.assert_array_equal(one.points, again.points)
    assert len(np.unique(one.points, axis=0)) == 64


@pytest.mark.parametrize("design", [name for name, known in DESIGNS.items() if known.randomised])
def test_sets_are_different_and_each_point_is_uniform(design):
    sets = vq.sample(design, n=16, d=2, sets=2000, rng=3).points
    assert sets.shape == (2000, 16, 2)
    assert len(np.unique(sets[:, 0, 0])) == 2000
    if DESIGNS[design].stratified:  # uniform in its own stratum only
        sets = sets * 4 % 1
    for i in (0, 5):
        for axis in (0, 1):
            assert kstest(sets[:, i, axis], "uniform").pvalue > 1e-6


@pytest.mark.statistical
@pytest.mark.parametrize("design", [name for name, known in DESIGNS.items() if known.randomised])
def test_the_coordinates_of_a_point_are_independent(design):
    """A point of the set is anywhere in the square, or in its stratum, with equal probability: 4 × 4 squares of it."""
    sets = vq.sample(design, n=16, d=2, sets=1000, rng=4).points
    if DESIGNS[design].stratified:
        sets = sets * 4 % 1
    for i in (0, 5, 15):
        of_square = np.ravel_multi_index(tuple((sets[:, i] * 4).astype(int).T), (4, 4))
        assert chisquare(np.bincount(of_square, minlength=16)).pvalue > 1e-6


@pytest.mark.parametrize(("n", "d"), [(5, 1), (12, 2), (18, 3)])
def test_regular_points_are_the_centres_of_their_boxes(n, d):
    points = vq.sample("regular", n, d).points
    mirrored = 1 - points[::-1]
    np.testing.assert_allclose(points, mirrored, atol=1e-15)
    np.testing.assert_allclose(vq.weights(points), 1 / n, rtol=1e-12)


@pytest.mark.parametrize(
    ("n", "d", "shape"), [(7, 1, (7,)), (12, 2, (3, 4)), (2, 2, (1, 2)), (16, 3, (2, 2, 4)), (1, 5, (1,) * 5)]
)
def test_grid_shape_is_the_most_equal_factors(n, d, shape):
    assert grid_shape(n, d) == shape


@pytest.mark.parametrize("d", [2, 3, 4, 6])
def test_the_largest_grid_is_the_largest_there_is(d):
    shapes = [k for k in combinations_with_replacement(range(1, 11), d) if k[-1] <= min(2 * k[0], k[0] + 2)]
    for n in range(1, 2**d + 20):
        assert math.prod(largest_grid(n, d)) == max(size for k in shapes if (size := math.prod(k)) <= n)
    assert largest_grid(2**d - 1, d) == (1,) + (2,) * (d - 1)


@pytest.mark.parametrize("design", [name for name, known in DESIGNS.items() if known.randomised])
@pytest.mark.parametrize("n", [9, 13, 250, 251, 1004])
def test_the_largest_size_is_one_that_the_design_has(design, n):
    size = largest_size(design, n, 2)
    assert size <= n
    assert vq.sample(design, size, 2, rng=1).n == size
    if design == "orthogonal":
        assert size == max(q * q for q in range(2, n) if q * q <= n and prime_power(q))


@pytest.mark.parametrize(("n", "d", "below", "above"), [(14, 2, 12, 15), (11, 2, 9, 12), (7, 3, 4, 8)])
def test_no_grid_names_the_nearest_that_are(n, d, below, above):
    with pytest.raises(ValueError, match=rf"n = {below} and n = {above}"):
        vq.sample("stratified", n=n, d=d)


def test_every_stratum_holds_one_point_in_c_order():
    s = vq.sample("stratified", n=24, d=2, sets=500, rng=1)
    assert s.strata == (4, 6)
    np.testing.assert_array_equal(stratum_index(s.points, s.strata), np.broadcast_to(np.arange(24), (500, 24)))


@pytest.mark.parametrize("strata", [(5, 7), (4, 5, 5), (3, 4, 4, 5)])
def test_multi_jittered_points_of_one_colour_are_a_latin_arrangement_in_each_slab(strata):
    places = offsets(strata, 3, np.random.default_rng(1))
    index = np.indices(strata).reshape(len(strata), -1)
    for colour in range(colours(strata).max() + 1):
        for a, k in enumerate(strata):
            for i in range(k):
                slab = np.flatnonzero((colours(strata) == colour) & (index[a] == i))
                for of_set in places[:, slab, a]:
                    np.testing.assert_array_equal(np.sort((of_set * len(slab)).astype(int)), np.arange(len(slab)))


@pytest.mark.statistical
def test_multi_jittered_points_of_different_colours_are_independent():
    # The sum of the first coordinates in a slab hardly varies if they are one arrangement of all its points
    places = offsets((6, 6), 4000, np.random.default_rng(1))[..., 0].reshape(-1, 6, 6)
    assert places[:, 0, [0, 3]].sum(axis=1).var() == pytest.approx(1 / 24, rel=0.15)  # in halves: 2 / (12 · 4)
    assert places[:, 0, [0, 1, 2]].sum(axis=1).var() == pytest.approx(3 / 12, rel=0.15)
    assert places[:, :2, 0].sum(axis=1).var() == pytest.approx(2 / 12, rel=0.15)


@pytest.mark.parametrize("design", ["sobol", "zero-two"])
def test_digital_nets_stay_nets(design):
    # A (0,2)-net in base 2: each elementary interval of area 1/n holds one point
    n = 64
    points = vq.sample(design, n=n, d=2, rng=5).points
    for split in range(7):
        strata = (2**split, n // 2**split)
        index = np.ravel_multi_index(tuple((points * strata).astype(int).T), strata)
        np.testing.assert_array_equal(np.sort(index), np.arange(n))


def test_owen_scrambling_is_not_a_mere_digital_shift():
    # A digital shift keeps the XOR of two points' digits; nested scrambling keeps leading zeros only
    shifts = []
    for rng in range(50):
        a, b = (vq.sample("sobol", n=8, d=1, rng=rng).points[:2, 0] * 2**16).astype(int)
        shifts.append(int(a ^ b))
    assert len(set(shifts)) > 40
    assert {s.bit_length() for s in shifts} == {16}


@pytest.mark.statistical
@pytest.mark.parametrize("design", ["sobol", "zero-two"])
def test_digits_below_the_32nd_are_random(design):
    """Without them a point could not be anywhere in the box: it would be one of 2^32 places along each axis."""
    points = vq.sample(design, n=64, d=2, sets=100, rng=3).points
    assert kstest((points * 2.0**32 % 1).ravel(), "uniform").pvalue > 1e-6


def test_scipy_engines():
    engine = vq.sample(qmc.LatinHypercube(d=3, rng=1), n=8)
    assert (engine.points.shape, engine.design) == ((8, 3), "latinhypercube")
    sets = vq.sample(qmc.Halton, n=8, d=2, sets=3, rng=1)
    assert sets.points.shape == (3, 8, 2)
    assert not np.array_equal(sets.points[0], sets.points[1])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: vq.sample("sobel", n=8), "unknown sampler 'sobel'; choose one of uniform"),
        (lambda: vq.sample("uniform", n=0), "n must be a whole number of at least 1, got 0"),
        (lambda: vq.sample("uniform", n=2.5), "n must be a whole number"),
        (lambda: vq.sample("uniform", n=True), "n must be a whole number"),
        (lambda: vq.sample("uniform", n=4, d=-1), "d must be a whole number"),
        (lambda: vq.sample("zero-two", n=4, d=3), "at most d = 2 dimensions, got d = 3; use 'sobol'"),
        (lambda: vq.sample("sobol", n=4, d=21_202), "at most d = 21201 dimensions, got d = 21202; use 'uniform'"),
        (lambda: vq.sample(qmc.Halton(2), n=4, d=3), "contradicts the engine's own d = 2"),
        (
            lambda: vq.sample(qmc.Halton(2), n=4, sets=3),
            r"the class, sampler=qmc.Halton, .* functools.partial\(qmc.Halton",
        ),
        (lambda: vq.sample(partial(qmc.Sobol, scramble=False), n=4, d=2, sets=3), "two of 3 sets have the same points"),
        (lambda: largest_size("orthogonal", 10, 5), "at least n = 16 samples in d = 5, but a set may have at most 10"),
        (lambda: vq.sample(qmc.PoissonDisk(2, radius=0.3, rng=1), n=100), "made 1?[0-9] points of the n = 100"),
        (lambda: vq.sample("uniform", n=4, rng=-1), "a seed must be at least 0"),
        (lambda: vq.SampleSet(np.full((4, 1), 0.5), "stratified"), "needs the strata"),
        (lambda: vq.SampleSet(np.full((4, 1), 0.5), "stratified", (4,)), "must hold one point"),
        (
            lambda: vq.SampleSet([[0.1], [0.3], [0.9], [0.35]], "stratified", (4,)),
            "must hold one point, but stratum 1 holds 2; say design='uniform'",
        ),
        (lambda: vq.SampleSet(np.full(4, 0.5), "uniform"), "must have shape"),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_a_callable_cannot_pass_for_a_design():
    def stratified(d, rng):
        return qmc.Halton(d, rng=rng)

    assert vq.sample(stratified, n=8, d=2, rng=1).design == "halton"


@pytest.mark.parametrize("strata", [(49,), (1000,), (7, 11)])
@pytest.mark.parametrize("u", [0.0, np.nextafter(1, 0)])
def test_rounding_puts_no_point_out_of_its_stratum(strata, u):
    n, d = int(np.prod(strata)), len(strata)
    corners = np.indices(strata).reshape(d, n).T
    points = inside((corners + np.full((1, n, d), u)) / strata, corners, strata)
    np.testing.assert_array_equal(stratum_index(points[0], strata), np.arange(n))


@pytest.mark.parametrize(
    ("engine", "design"),
    [
        (qmc.Sobol(2), "sobol"),
        (qmc.Halton(2), "halton"),
        (qmc.LatinHypercube(2), "latinhypercube"),
        (qmc.LatinHypercube(2, scramble=False), "latinhypercube (scramble=False)"),
        (qmc.LatinHypercube(2, optimization="random-cd"), "latinhypercube (optimization)"),
        (qmc.PoissonDisk(2), "poissondisk"),
    ],
)
def test_the_design_of_an_engine_tells_what_it_does_not_randomise(engine, design):
    found = vq.sample(engine, n=4).design
    assert found == design
    assert design_of(found).randomised == (found in ("sobol", "halton", "latinhypercube"))
