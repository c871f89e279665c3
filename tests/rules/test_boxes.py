"""Boxes and the fits about their centres."""

import numpy as np
import pytest

from voroquad.rules.boxes import Boxes, BoxFits, samples_of_a_fit


@pytest.mark.parametrize(
    ("n", "d", "per_axis"), [(1, 3, 1), (8, 1, 8), (8, 3, 2), (26, 3, 2), (27, 3, 3), (1000, 2, 31)]
)
def test_there_are_at_most_as_many_boxes_as_samples(n, d, per_axis):
    assert Boxes.about(n, d).per_axis == per_axis


@pytest.mark.parametrize("d", [1, 2, 3])
def test_a_point_lies_in_the_box_of_its_number(d):
    boxes = Boxes(5, d)
    points = np.vstack([np.random.default_rng(1).random((200, d)), np.zeros(d), np.full(d, 1.0)])
    off = np.abs(points - boxes.centres[boxes.numbers(points)])
    assert (off <= boxes.half_width + 1e-15).all()
    assert len(boxes.centres) == 5**d


def test_the_nearest_samples_come_first():
    samples = np.random.default_rng(2).random((40, 2))
    boxes = Boxes(4, 2)
    distance, nearest = boxes.nearest(samples, 7)
    every = np.linalg.norm(samples - boxes.centres[:, None], axis=-1)
    np.testing.assert_allclose(distance, np.sort(every, axis=1)[:, :7])
    np.testing.assert_allclose(np.take_along_axis(every, nearest, axis=1), distance)


def fits(degree=2, n=60, d=2):
    samples = np.random.default_rng(3).random((n, d))
    boxes = Boxes.about(n, d)
    k = int(np.ceil(samples_of_a_fit(degree, d)))
    distance, nearest = boxes.nearest(samples, k + 1)
    return BoxFits(samples, boxes.centres, boxes.half_width, distance[:, k], nearest[:, :k], degree, 1), boxes


def test_the_mean_of_fits_to_a_polynomial_is_its_integral():
    made, _ = fits()
    x, y = made.samples.T
    assert made.mean @ (x**2 + x * y - y) == pytest.approx(1 / 3 + 1 / 4 - 1 / 2, rel=1e-11)


def test_the_sum_of_fits_to_a_polynomial_is_that_of_its_values():
    made, boxes = fits()
    points = np.random.default_rng(4).random((30, 2))
    weights = made.sum_at(points, boxes.numbers(points))
    assert weights @ (made.samples[:, 0] ** 2) == pytest.approx((points[:, 0] ** 2).sum(), rel=1e-11)
    assert (made.sum_at(points[:0], boxes.numbers(points[:0])) == 0).all()


def test_each_point_has_the_fit_of_its_number():
    """Of two sets of fits to jumps, as far as the fits of a point's own box go."""
    made, boxes = fits(degree=1)
    f = (made.samples[:, 0] > 0.5).astype(float)
    points = np.random.default_rng(5).random((20, 2))
    numbers = boxes.numbers(points)
    together = made.sum_at(points, numbers) @ f
    one_by_one = sum(made.sum_at(points[i : i + 1], numbers[i : i + 1]) @ f for i in range(20))
    assert together == pytest.approx(one_by_one, rel=1e-10)
    assert abs(made.sum_at(points, numbers[::-1]) @ f - together) > 0.1
