"""The check that every array from outside goes through."""

import datetime

import numpy as np
import pytest
import scipy.stats

import voroquad as vq
from voroquad._support.checks import real_numbers

MASKED = np.ma.masked_array([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]], [[0, 0], [0, 1], [0, 0]])


@pytest.mark.parametrize(
    "values",
    [[1, 2.5], np.array([1, 2], dtype=np.uint8), (True, False), np.float32(1), np.array([1, 2.5], dtype=object)],
)
def test_real_numbers_are_read_as_float64(values):
    array = real_numbers("x", values)
    assert array.dtype == np.float64
    np.testing.assert_array_equal(array, np.asarray(values, dtype=np.float64))


def test_float64_is_not_copied():
    x = np.linspace(0, 1, 5)[::2]
    assert np.shares_memory(real_numbers("x", x), x)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ("0.5", "x must be an array of numbers, got '0.5'"),
        (["0.5", "1"], "x must be an array of numbers, got list"),
        (None, "x must be an array of numbers, got None"),
        ({"a": 1}, "x must be an array of numbers, got dict"),
        ([[1, 2], [3]], "x must be an array of numbers, got list"),
        ([datetime.date(2026, 1, 1)], "x must be an array of numbers, got list"),
        (np.array(["2026-01-01"], dtype="M8[D]"), "x must be an array of numbers, got an array of datetime64.D."),
        ([1j], "x must be real, got complex numbers; give their two parts"),
        (MASKED, "x must not be masked; drop the masked rows"),
        ([MASKED[1], MASKED[0]], "x must not be masked"),
        ([[np.ma.masked, 1.0]], "x must not be masked"),
    ],
)
@pytest.mark.filterwarnings("ignore:Warning. converting a masked element to nan")
def test_what_is_no_array_of_real_numbers_is_refused(values, message):
    with pytest.raises(ValueError, match=message):
        real_numbers("x", values)


def test_a_mask_that_hides_nothing_is_read():
    assert real_numbers("x", np.ma.masked_array([1.0, 2.0], [0, 0])).tolist() == [1, 2]


MEASURE = vq.ProductMeasure(scipy.stats.norm(), scipy.stats.norm())
PIECES = vq.PiecewiseUniform([0, 0.5, 1], [2, 1])


@pytest.mark.parametrize(
    "call",
    [
        lambda m: vq.quad(lambda x: x[0], m[1], [1, 1]),
        lambda m: vq.quad(lambda x: x[0], [0, 0], m[1]),
        lambda m: vq.quad(lambda x: np.ma.masked_less(x[0], 0.5), [0, 0], [1, 1]),
        lambda m: vq.quad(lambda x: [np.ma.masked_less(x[0], 0.5), x[1]], [0, 0], [1, 1]),
        lambda m: vq.weights(m),
        lambda m: vq.SampleSet(m, "uniform"),
        lambda m: vq.bias_function(m, 9),
        lambda m: vq.cells(m),
        lambda m: vq.sphere_points(m),
        lambda m: vq.sphere_weights(np.ma.masked_array(np.eye(3), [[0, 0, 0], [0, 0, 1], [0, 0, 0]])),
        lambda m: MEASURE.transform(m),
        lambda m: MEASURE.density(m),
        lambda m: MEASURE.weights(m),
        lambda m: PIECES.density(m[:, 1]),
        lambda m: PIECES.weights(m[:, 1]),
        lambda m: vq.PiecewiseUniform(m[:, 1], [1, 1]),
        lambda m: vq.PiecewiseUniform([0, 1, 2, 3], [1, 1, 1], m[:, 1]),
        lambda m: vq.PiecewiseUniform([0, 1, 2, 3], np.ma.masked_array([1, 2, 3], [0, 1, 0])),
        lambda m: vq.PiecewiseUniform.from_boxes(m, m + 1, [1, 1, 1]),
    ],
)
def test_no_entrance_takes_masked_values(call):
    with pytest.raises(ValueError, match="must not be masked"):
        call(MASKED)


@pytest.mark.parametrize("shape", [(1, 2), (1, 3), (2, 3), (2, 5), (3, 8), (2, 100)])
def test_fewer_points_than_dimensions_may_be_transposed(shape):
    points = np.random.default_rng(1).random(shape)
    with pytest.raises(
        ValueError, match=rf"samples of shape \({shape[0]}, {shape[1]}\) may be .*: pass samples\.T for"
    ):
        vq.weights(points)
    with pytest.raises(ValueError, match=rf"{shape[1]} points in d = {shape[0]}, samples\[None\] for {shape[0]} point"):
        vq.weights(points, order=1, debias="leave-one-out", design="uniform")
    if shape[1] <= 8:
        assert vq.weights(points.T).shape == shape[1:]
        assert vq.weights(points[None]).shape == (1, shape[0])
        assert vq.weights(vq.SampleSet(points, "uniform")).shape == shape[:1]


def test_as_many_points_as_dimensions_or_more_are_rows():
    for shape in ((1, 1), (2, 2), (3, 3), (3, 2), (8, 4)):
        assert vq.weights(np.random.default_rng(1).random(shape)).shape == shape[:1]
