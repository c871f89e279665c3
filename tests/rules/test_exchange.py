"""The rules called unbiased are, and the test can tell."""

import numpy as np
import pytest

import voroquad as vq

REPLICATES = 100_000

# f and its integral over [0, 1]; none vanishes at both ends
FUNCTIONS = {
    "exp": (np.exp, np.e - 1),
    "wave": (lambda x: 1 + np.cos(5 * x), 1 + np.sin(5) / 5),
    "kink": (lambda x: np.abs(x - 1 / 3), 5 / 18),
    "jump": (lambda x: x + (x > 0.4), 1.1),
}


def z_scores(z_score, design, n, debias):
    s = vq.sample(design, n=n, d=1, sets=REPLICATES, rng=n)
    w, x = vq.weights(s, debias=debias), s.points[..., 0]
    return {name: z_score((w * f(x)).sum(axis=1), truth) for name, (f, truth) in FUNCTIONS.items()}


# 36 checks at 5.5 standard errors: a correct program exceeds one of them once in 7e5 seeds
@pytest.mark.statistical
@pytest.mark.parametrize("n", [5, 20, 100])
@pytest.mark.parametrize(
    ("design", "debias"), [("uniform", "bias-function"), ("uniform", "exchange"), ("stratified", "exchange")]
)
def test_unbiased(z_score, design, debias, n):
    z = z_scores(z_score, design, n, debias)
    assert max(map(abs, z.values())) < 5.5, z


@pytest.mark.statistical
@pytest.mark.parametrize("n", [5, 20, 100])
def test_voronoi_weights_are_found_biased(z_score, n):
    z = z_scores(z_score, "uniform", n, "none")
    assert abs(z["exp"]) > 20, z


@pytest.mark.statistical
@pytest.mark.parametrize("n", [1, 2, 3, 4, 6])
def test_exchange_weights_of_the_smallest_sets(z_score, n):
    for design in ("uniform", "stratified"):
        s = vq.sample(design, n=n, d=1, sets=20_000, rng=n)
        w = vq.weights(s, debias="exchange")
        assert abs(z_score((w * np.exp(s.points[..., 0])).sum(axis=1), np.e - 1)) < 5.5


def test_exchange_weights_by_hand():
    # D = .1 .1 .3 .2 .3: ends D_0 + (D_1 + D_2)/2, D_4 + (D_3 + D_2)/2; seconds D_1/2, D_3/2
    np.testing.assert_allclose(
        vq.weights([0.5, 0.1, 0.2, 0.7], design="uniform", debias="exchange"), [0.1, 0.3, 0.05, 0.55], atol=1e-15
    )
    # v = .3 −.1 .2 0 −.4 in fifths: N w_1 = 1 + v_2/2, N w_2 = 1 + v_1 + v_3/2, …
    v = np.array([0.3, -0.1, 0.2, 0.0, -0.4])
    x = (np.arange(5) + 0.5 + v) / 5
    expected = [1 - 0.05, 1 + 0.3 + 0.1, 1 - 0.3 + 0.05 - 0.4, 1 - 0.1 + 0.4, 1.0]
    np.testing.assert_allclose(5 * vq.weights(x, design="stratified", debias="exchange"), expected, atol=1e-12)
