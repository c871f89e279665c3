"""Cross-fit across replicates: exact for polynomials, unbiased for all, linear in f."""

import itertools
import math

import numpy as np
import pytest

import voroquad as vq
from voroquad.rules.cross_fit import replicate_shares
from voroquad.rules.method import local


@pytest.mark.parametrize(
    ("d", "n", "sets", "order"),
    [(1, 32, 3, 4), (2, 64, 4, 3), (3, 64, 4, 2), (3, 128, 3, 4), (5, 64, 4, 2), (8, 16, 8, 1)],
)
@pytest.mark.parametrize("design", ["sobol", "uniform"])
def test_polynomials_up_to_the_order_are_integrated_exactly(design, d, n, sets, order):
    s = vq.sample(design, n, d, sets=sets, rng=1)
    shares = replicate_shares(s.points, local(order), threads=2)
    np.testing.assert_allclose(shares.sum(axis=(1, 2)), 1, atol=1e-12)
    rng = np.random.default_rng(2)
    for powers in itertools.islice(itertools.product(range(order + 1), repeat=d), 200):
        if sum(powers) <= order:
            shift = rng.random(d)  # (x − shift)^p, its integral axis by axis
            f = np.prod((s.points - shift) ** np.array(powers), axis=-1)
            exact = np.prod(
                [((1 - c) ** (p + 1) - (-c) ** (p + 1)) / (p + 1) for p, c in zip(powers, shift, strict=True)]
            )
            np.testing.assert_allclose(np.einsum("rsn,sn->r", shares, f), exact, atol=1e-11)


def test_weights_are_the_mean_of_the_replicates_estimates():
    s = vq.sample("halton", 50, 2, sets=3, rng=1)
    f = np.cos(5 * s.points.sum(axis=-1))
    estimates = np.einsum("rsn,sn->r", replicate_shares(s.points, local(2), 1), f)
    w = vq.weights(s, order=2, debias="cross-fit")
    assert w.shape == (3, 50)
    assert (w * f).sum(axis=1).mean() == pytest.approx(estimates.mean(), rel=1e-13)
    np.testing.assert_array_equal(w, vq.weights(s, order=2, debias="cross-fit", threads=3))
    np.testing.assert_array_equal(w, vq.weights(s, order=2, debias="auto"))


# f(x) = e^(x_1) + [Σx < 0.43 d], which vanishes nowhere and jumps
def truth(d):
    t = 0.43 * d
    below = sum((-1) ** j * math.comb(d, j) * max(t - j, 0) ** d for j in range(d + 1)) / math.factorial(d)
    return math.e - 1 + below


# With so many pairs a bias of 0.1 standard deviations of one estimate shows as |z| ≈ 5.6
PAIRS = 3100


# 8 checks at 5.5 standard errors: a correct program exceeds one of them once in 3e6 seeds
@pytest.mark.statistical
@pytest.mark.parametrize(
    ("design", "d", "n", "order"),
    [("sobol", 1, 8, 2), ("sobol", 2, 8, 1), ("sobol", 2, 16, 2), ("uniform", 2, 12, 2), ("stratified", 2, 9, 1),
     ("sobol", 3, 8, 1), ("sobol", 5, 16, 1), pytest.param("halton", 2, 9, 2, marks=pytest.mark.slow)],
)  # fmt: skip
def test_unbiased(z_score, design, d, n, order):
    points = vq.sample(design, n, d, sets=2 * PAIRS, rng=5).points.reshape(PAIRS, 2, n, d)
    f = np.exp(points[..., 0]) + (points.sum(axis=-1) < 0.43 * d)
    shares = np.stack([replicate_shares(pair, local(order), 1) for pair in points])
    assert abs(z_score(np.einsum("prsn,psn->p", shares, f) / 2, truth(d))) < 5.5


@pytest.mark.statistical
def test_a_reconstruction_that_knows_the_replicate_is_found_biased(z_score):
    points = np.repeat(vq.sample("uniform", 9, 1, sets=1500, rng=5).points[:, None], 2, axis=1)  # both are the same
    f = np.exp(3 * points[..., 0])
    shares = np.stack([replicate_shares(pair, local(1), 1) for pair in points])
    assert abs(z_score(np.einsum("prsn,psn->p", shares, f) / 2, (math.e**3 - 1) / 3)) > 6.5


def test_needs_two_sets_of_a_randomised_design():
    s = vq.sample("sobol", 16, 2, rng=1)
    with pytest.raises(ValueError, match="2 sets or more"):
        vq.weights(s, order=2, debias="cross-fit")
    with pytest.raises(ValueError, match="no rule"):
        vq.weights(vq.sample("regular", 16, 2, sets=3), order=2, debias="cross-fit")


def test_coinciding_points_give_no_nan():
    points = np.full((3, 20, 2), 0.25)
    assert np.isfinite(replicate_shares(points, local(2), 1)).all()


def test_the_guard_knows_nothing_of_the_replicate_that_is_left_out():
    """In a box f̂ is one polynomial, here of degree 2 at most, whatever the order that the guard leaves it with.

    So two sets of points in the box with the same sums of x and of x² count alike. The other replicate lies at two
    places a and b, up to a distance that shrinks: at zero, (x − a)(x − b) is free. It is largest beside the centre of
    the box, where the guard looks, and one of the two sets has points there.
    """
    a, b, centre, n = 0.375, 0.53, 0.4375, 8
    far, near = 0.04, 0.01
    farther = math.sqrt(2 * far**2 - near**2)
    one = centre + np.repeat([-far, far], 4)[:, None]
    other = centre + np.repeat([-near, near, -farther, farther], 2)[:, None]
    place, spread = np.repeat([a, b], 4)[:, None], np.random.default_rng(1).uniform(-1, 1, (n, 1))
    largest = []
    for distance in np.geomspace(2e-3, 1e-4, 301):  # one per cent from one to the next
        samples = place + distance * spread
        shares, again = (replicate_shares(np.stack([x, samples]), local(2), 1)[0, 1] for x in (one, other))
        np.testing.assert_allclose(shares, again, rtol=0, atol=1e-10 * abs(shares).max())
        largest.append(abs(shares).max())
    assert largest[-1] < 1 < largest[0]  # the guard leaves the order where samples are apart, and lowers it else
