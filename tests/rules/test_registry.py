import inspect
import itertools
import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import voroquad as vq
from voroquad.rules.registry import RANDOMISED, RULES

UNIT = st.floats(0, 1, exclude_max=True)


@pytest.mark.parametrize("n", [1, 2, 3, 10, 1000, 10**6])
@pytest.mark.parametrize(
    ("design", "d", "debias"),
    [
        ("uniform", 1, "none"),
        ("uniform", 2, "none"),
        ("uniform", 1, "exchange"),
        ("stratified", 1, "none"),
        ("stratified", 1, "exchange"),
    ],
)
def test_weights_sum_to_one(n, design, d, debias):
    w = vq.weights(vq.sample(design, n=n, d=d, rng=n), debias=debias)
    assert w.shape == (n,)
    assert abs(w.sum() - 1) < 1e-12


@given(arrays(np.float64, st.integers(1, 40), elements=UNIT))
def test_voronoi_weights_in_one_dimension_are_half_the_way_to_both_neighbours(x):
    w = vq.weights(x)
    distinct, inverse, counts = np.unique(x, return_inverse=True, return_counts=True)
    ends = np.concatenate([[0.0], (distinct[1:] + distinct[:-1]) / 2, [1.0]])
    np.testing.assert_allclose(w, (np.diff(ends) / counts)[inverse], atol=1e-15)


@given(arrays(np.float64, st.integers(1, 40), elements=UNIT))
def test_exchange_weights_are_not_negative_and_sum_to_one(x):
    w = vq.weights(x, design="uniform", debias="exchange")
    assert w.min() >= 0
    assert abs(w.sum() - 1) < 1e-12


def test_a_batch_equals_its_sets_one_by_one_for_any_number_of_threads():
    for d, n in ((1, 50), (2, 50), (2, 5000)):
        s = vq.sample("uniform", n=n, d=d, sets=5, rng=2)
        one_by_one = np.stack([vq.weights(points, threads=1) for points in s.points])
        for threads in (1, 2, 4):
            np.testing.assert_array_equal(vq.weights(s, threads=threads), one_by_one)


def test_stratified_points_may_come_in_any_order():
    s = vq.sample("stratified", n=20, d=1, rng=2)
    shuffle = np.random.default_rng(0).permutation(20)
    w = vq.weights(s.points[shuffle], design="stratified", debias="exchange")
    np.testing.assert_array_equal(w, vq.weights(s, debias="exchange")[shuffle])


@pytest.mark.parametrize(("d", "order"), [(1, 0), (2, "kriging"), (4, "kriging")])
def test_the_default_order_of_uniform_samples(d, order):
    """Kriging, but on a line, where the gaps between independent samples are too wide for predictions across them."""
    s = vq.sample("uniform", 40, d, rng=1)
    for debias in ("auto", "leave-one-out"):
        expected = vq.weights(s, order=order, debias=debias)
        np.testing.assert_array_equal(vq.weights(s, order="auto", debias=debias), expected)


def test_the_documented_table_is_that_of_the_rules():
    """As sets of (debias, order, dimension, design, fewest sets, most samples, unbiased)."""
    documented = set()
    table = inspect.getdoc(vq.weights).split("\n==================  ")[2].splitlines()[1:]
    for line in table:
        debias, orders, dimensions, designs, unbiased, _ = re.split(r"  +", line)
        designs, *rest = re.split("; |, (?=n ≤|two)", designs)
        names = RANDOMISED if designs == "randomised" else designs.split(", ")
        most = next((int(part.removeprefix("n ≤ ")) for part in rest if part.startswith("n ≤")), math.inf)
        documented |= {
            (debias.strip("`"), order, d, name, 2 if "two sets or more" in rest else 1, most, unbiased == "yes")
            for order, d, name in itertools.product(numbers(orders), numbers(dimensions), names)
        }
    described = {
        (row.debias, method.order, d, name, row.fewest_sets, row.most, row.unbiased)
        for row in RULES
        for method, d, name in itertools.product(row.methods, row.dimensions[:20], row.designs or ["any"])
    }
    assert documented == described


def numbers(text):
    if text in ("any", "kriging"):
        return {"any": range(1, 21), "kriging": ["kriging"]}[text]
    first, *last = map(int, text.split(" to "))
    return range(first, (last or [first])[0] + 1)


def test_strided_and_integer_input():
    points = np.random.default_rng(0).random((2, 30))
    np.testing.assert_array_equal(vq.weights(points.T), vq.weights(points.T.copy()))
    assert vq.weights([0]).tolist() == [1.0]


def test_auto_picks_an_unbiased_rule():
    s = vq.sample("uniform", n=30, d=1, rng=1)
    np.testing.assert_array_equal(vq.weights(s, debias="auto"), vq.weights(s, debias="exchange"))


@pytest.mark.parametrize(
    ("points", "options", "message"),
    [
        ([0.5, np.nan], {}, r"points\[1\] = \[nan\] is not inside"),
        (
            [[0.1, 0.2], [0.3, 1.5]],
            {},
            r"points\[1\] = \[0.3, 1.5\] is not inside .*give the box as bounds=",
        ),
        (np.full((2, 3, 1), 2.0), {}, r"points\[\(0, 0\)\]"),
        ([0.5, -0.1], {}, r"points\[1\]"),
        ([], {}, "at least one point"),
        ("abc", {}, "must be an array of numbers"),
        (np.zeros((1, 1, 1, 1)), {}, r"shape \(n, d\)"),
        ([0.5], {"debias": "magic"}, "unknown debias 'magic'; choose one of none"),
        ([0.5], {"design": "magic"}, "unknown design 'magic'"),
        ([0.5], {"order": 9}, "order must be a whole number from 0 to 8"),
        ([0.5], {"order": 0.5}, "order must be"),
        ([0.5], {"debias": "exchange"}, "no rule for .*there are: .*debias='exchange' with order 0, d = 1"),
        ([[[0.5, 0.5]]], {"debias": "exchange", "design": "uniform"}, "no rule for .* d = 2"),
        ([[[0.5, 0.5]]], {"order": 5}, "no rule for [^;]*; there are: (debias='none' [^;]*(; |$))+$"),
        ([0.1, 0.2], {"design": "stratified"}, "must hold one point, but stratum 0 holds 2"),
    ],
)
def test_bad_input_is_refused(points, options, message):
    with pytest.raises(ValueError, match=message) as error:
        vq.weights(points, **options)
    assert "\n" not in str(error.value)


BOX = np.array([[-1.0, 3.0], [2.0, 2.5]])


def _into(box, points):
    """Points of the unit box in a box (d, 2), below its upper ends."""
    low, high = np.asarray(box).T
    return low + (high - low) * points


def test_cells_of_order_0_are_those_of_the_box_itself():
    """Two points in 4 × 1: cells of the points scaled to the unit box would be 2.41 and 1.59."""
    x = _into(BOX, vq.sample("uniform", 50, 2, sets=3, rng=1).points)
    w = vq.weights(x, bounds=BOX)
    np.testing.assert_array_equal(w, vq.cells(x, bounds=BOX).measures)
    np.testing.assert_array_equal(w[0], vq.weights(x[0], bounds=BOX, design="uniform"))
    scaled = 2 * vq.weights((x - BOX[:, 0]) / (BOX[:, 1] - BOX[:, 0]))
    assert abs(w - scaled).max() > 0.01
    far = [[1.0, 0.9], [2.0, 0.1]]
    np.testing.assert_allclose(vq.weights(far, bounds=[(0, 4), (0, 1)]), [1.5, 2.5], rtol=1e-14)


def test_probed_cells_are_those_of_the_box_itself():
    """With one long axis, cells are slabs: half the way to both neighbours along it."""
    box = [(0, 1), (-500, 500), (0, 1), (0, 1)]
    x = _into(box, vq.sample("uniform", 40, 4, rng=2).points)
    w = vq.weights(x, bounds=box)
    assert w.sum() == pytest.approx(1000, rel=1e-12)
    slabs = vq.weights(x[:, 1], bounds=box[1])
    assert abs(w - slabs).max() < 2  # probes count a slab of 25 to about 1
    assert abs(1000 * vq.weights((x - [0, -500, 0, 0]) / [1, 1000, 1, 1]) - slabs).max() > 10


@pytest.mark.parametrize(
    ("design", "n", "order", "debias"),
    [
        ("uniform", 40, 0, "bias-function"),
        ("uniform", 40, 0, "leave-one-out"),
        ("uniform", 40, "kriging", "auto"),
        ("stratified", 30, 0, "leave-one-out"),
        ("stratified", 30, 2, "leave-one-out"),
        ("multi-jittered", 30, "auto", "auto"),
        ("sobol", 32, "kriging", "cross-fit"),
    ],
)
def test_unbiased_rules_map_to_the_unit_box(design, n, order, debias):
    s = vq.sample(design, n, 2, sets=2, rng=3)
    w = vq.weights(_into(BOX, s.points), bounds=BOX, design=design, order=order, debias=debias)
    np.testing.assert_allclose(w, 2 * vq.weights(s, order=order, debias=debias), rtol=1e-6, atol=1e-9)


def test_points_that_rounding_puts_on_a_face_belong_to_the_last_stratum():
    x = np.array([[0.25], [1.0]], dtype=np.float32) * np.float32(0.1)
    w = vq.weights(x, bounds=(0, 0.1), design="stratified", debias="leave-one-out")
    np.testing.assert_allclose(w.sum(), 0.1, rtol=1e-7)


@pytest.mark.parametrize(
    ("points", "bounds", "message"),
    [
        (
            [[0.1, 0.2], [0.3, 1.5]],
            (0, 1),
            r"points\[1\] = \[0.3, 1.5\] is not inside \[0, 1\]\^2; give the box as bounds",
        ),
        ([[0.1, 0.2], [0.3, 1.5]], [(0, 1)], "bounds has 1 pairs .* d = 2"),
        (np.zeros((2, 3)), [(0, 1)] * 3, r"may be \(n, d\) or \(d, n\)"),
        ([0.5], (1, 0), r"bounds\[0\] = \(1.0, 0.0\) must be two finite numbers low < high"),
        (vq.sample("uniform", 4, 2, rng=1), (0, 2), "bounds is for bare points, .* pass x with design='uniform'"),
    ],
)
def test_bad_bounds_are_refused(points, bounds, message):
    with pytest.raises(ValueError, match=message) as error:
        vq.weights(points, bounds=bounds)
    assert "\n" not in str(error.value)
