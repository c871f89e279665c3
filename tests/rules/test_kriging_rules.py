"""Rules by kriging: exact for the drift, unbiased for all, linear in f."""

import itertools
import math

import numpy as np
import pytest

import voroquad as vq
from voroquad.designs.multi_jittered import offsets, period
from voroquad.designs.sampling import SampleSet
from voroquad.rules import kriging_rules
from voroquad.rules.cross_fit import replicate_shares
from voroquad.rules.defaults import default_of_strata
from voroquad.rules.kriging import Kriging, model
from voroquad.rules.kriging_rules import predicting
from voroquad.rules.method import KRIGING
from voroquad.rules.polynomials import Intervals
from voroquad.rules.strata_fits import fit_strata

DESIGNS = ("stratified", "multi-jittered")


def draw(strata, sets, design, seed=1):
    """Sets (sets, n, d) with one sample in each stratum of any grid, near-cubic or not."""
    d, n = len(strata), math.prod(strata)
    corners, rng = np.indices(strata).reshape(d, n).T, np.random.default_rng(seed)
    places = offsets(strata, sets, rng) if design == "multi-jittered" else rng.random((sets, n, d))
    return SampleSet((corners + places) / strata, design, tuple(strata))


def check_exact(points, w, degree, atol=1e-12):
    """Σ w x^p = Π 1/(p_a + 1), up to the total degree; (sets, n, d), weights that are averaged over sets."""
    d = points.shape[-1]
    for powers in itertools.product(range(degree + 1), repeat=d):
        if sum(powers) <= degree:
            f = np.prod(points ** np.array(powers), axis=-1)
            exact = 1 / np.prod(np.array(powers) + 1.0)
            np.testing.assert_allclose((w * f).sum(axis=-1), exact, atol=atol, rtol=0, err_msg=str(powers))


@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize(
    ("strata", "degree"),
    [
        ((40,), 2),
        ((6, 7), 1),
        ((16, 16), 5),
        ((2, 3), 0),
        ((4, 5, 6), 2),
        ((3, 4, 4), 1),
        ((4, 3, 4, 5), 2),
        ((3,) * 5, 1),
    ],
)
def test_polynomials_of_the_drift_are_integrated_exactly(design, strata, degree):
    samples = draw(strata, 2, design)
    w = fit_strata(samples, KRIGING, threads=2).weights
    check_exact(samples.points, w, degree)
    f = np.exp(samples.points[..., 0])
    assert (abs((w * f).sum(axis=1) - (math.e - 1)) > 1e-12).all()


@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize("strata", [(200,), (31, 33), (10, 11, 12), (6, 7, 5, 8)])
def test_many_strata_are_exact_where_a_part_predicts(monkeypatch, design, strata):
    monkeypatch.setattr(kriging_rules, "MOST", 180)
    members = predicting(strata)
    assert len(np.unique(members)) == 180
    samples = draw(strata, 2, design)
    fit = fit_strata(samples, KRIGING, threads=2, values=(samples.points**2).sum(axis=-1)[:, None])
    w, residuals = fit.weights, fit.residuals
    check_exact(samples.points, w, 2)
    assert abs(residuals).max() < 1e-9
    others = np.setdiff1d(np.arange(samples.n), members)
    np.testing.assert_allclose(w[:, others], 1 / samples.n, rtol=1e-12)  # each corrects, and predicts nothing


@pytest.mark.parametrize("design", DESIGNS)
def test_what_predicts_nothing_changes_its_own_residual_only(monkeypatch, design):
    monkeypatch.setattr(kriging_rules, "MOST", 30)
    samples = draw((8, 9), 1, design)
    f = np.exp(samples.points[..., 0] * samples.points[..., 1])
    residuals = fit_strata(samples, KRIGING, threads=1, values=f[:, None]).residuals
    (other, *_) = np.setdiff1d(np.arange(samples.n), predicting((8, 9)))
    raised = f.copy()
    raised[:, other] += 1
    after = fit_strata(samples, KRIGING, threads=1, values=raised[:, None]).residuals
    np.testing.assert_allclose(after - residuals, (np.arange(samples.n) == other)[None, None], atol=1e-12)


@pytest.mark.parametrize("strata", [(50, 60), (16, 16, 16), (8, 7, 9, 10)])
def test_the_samples_that_predict_are_spread_evenly(strata):
    """In halves along each axis, and in the 2^d boxes of such halves, to a tenth."""
    members = predicting(strata)
    assert len(np.unique(members)) == kriging_rules.MOST
    index = np.stack(np.unravel_index(np.arange(math.prod(strata)), strata))
    octant = np.ravel_multi_index(tuple(2 * index // np.array(strata)[:, None]), (2,) * len(strata))
    expected = kriging_rules.MOST / math.prod(strata) * np.bincount(octant)
    np.testing.assert_allclose(np.bincount(octant[members]), expected, rtol=0.1)


@pytest.mark.parametrize(("design", "most"), [("multi-jittered", 2048), ("multi-jittered", 40), ("stratified", 40)])
def test_a_prediction_knows_no_value_of_its_own_colour(monkeypatch, design, most):
    """Samples of one colour may depend on each other, so what predicts one of them must not know the others."""
    strata = (8, 9)
    monkeypatch.setattr(kriging_rules, "MOST", most)
    q = period(2) if design == "multi-jittered" else kriging_rules.COLOURS_OF_MANY
    colour = np.indices(strata).reshape(2, -1) % q
    samples = draw(strata, 1, design)
    f = np.sin(5 * samples.points.sum(axis=-1))
    before = fit_strata(samples, KRIGING, threads=1, values=f[:, None]).residuals
    for j in predicting(strata)[::5]:
        raised = f.copy()
        raised[:, j] += 1
        after = fit_strata(samples, KRIGING, threads=1, values=raised[:, None]).residuals
        alike = (colour == colour[:, [j]]).all(axis=0)
        expected = ~alike | (np.arange(samples.n) == j)
        np.testing.assert_array_equal(abs(after - before)[0, 0] > 1e-10, expected)


def test_more_points_do_not_make_more_error_where_not_all_predict():
    """Of one smooth integrand, on either side of the limit."""

    def f(x):
        return np.exp((np.arange(1, len(x) + 1)[:, None] * x).sum(axis=0) / len(x))

    for d, sampler in ((3, "stratified"), (4, "stratified"), (2, "sobol"), (3, "sobol")):
        errors = [
            vq.quad(f, np.zeros(d), np.ones(d), n_points=n, sampler=sampler, rng=3).standard_error for n in (2048, 4096)
        ]
        assert errors[1] < 2 * errors[0]


def test_independent_samples():
    for n, d, degree in ((60, 1, 2), (120, 2, 2), (200, 3, 2), (40, 6, 0), (1, 2, 0), (2, 2, 0)):
        points = vq.sample("uniform", n, d, sets=2, rng=1).points
        w = vq.weights(points, design="uniform", order="kriging", debias="leave-one-out")
        check_exact(points, w, degree)


@pytest.mark.parametrize(("n", "d"), [(30, 1), (70, 2)])
def test_independent_samples_are_those_of_the_definition(n, d):
    """Î = 1/n Σ_i [ f_i − f̂^(−i)(x_i) + ∫ f̂^(−i) ], each prediction from n − 1 samples and from scratch."""
    points = vq.sample("uniform", n, d, rng=2).points
    f = np.exp(points.sum(axis=1))
    assumed = model(n, d, kriging_rules.INDEPENDENT_PER_TERM)
    whole = Intervals(np.zeros(1), np.ones(1), np.zeros(1, dtype=np.intp), 1)
    total = 0.0
    for i in range(n):
        others = np.delete(np.arange(n), i)
        kriging = Kriging(points[others], assumed)
        predicted, integral = (
            kriging.integrals(measures)[0] @ f[others]
            for measures in (kriging.at_points(points[i : i + 1]), kriging.over_boxes([whole] * d))
        )
        total += f[i] - predicted + integral
    w = vq.weights(points, design="uniform", order="kriging", debias="leave-one-out")
    assert w @ f == pytest.approx(total / n, rel=1e-10)


@pytest.mark.parametrize(("n", "d"), [(100, 2), (200, 1), (200, 3)])
def test_clusters_lower_the_drift_of_their_own_set_only(n, d):
    """Samples at a few places, or nearly, do not determine a polynomial. Weights stay tame, and the other sets' too."""
    rng = np.random.default_rng(1)
    sets = rng.random((24, n, d))
    for number, points in enumerate(sets[1:], start=1):
        places = rng.random((1 + number // 2, d))
        points[:] = places[rng.integers(len(places), size=n)] * (1 - 1e-6) + 1e-7 * rng.random((n, d)) * (number % 2)
    w = vq.weights(sets, design="uniform", order="kriging", debias="leave-one-out")
    np.testing.assert_allclose(w.sum(axis=1), 1, rtol=0, atol=1e-9)
    assert n * abs(w).max() < 1e5
    alone = np.stack([vq.weights(x, design="uniform", order="kriging", debias="leave-one-out") for x in sets])
    np.testing.assert_allclose(w, alone, rtol=0, atol=1e-12)


def test_replicates(monkeypatch):
    for most in (2048, 90):  # all samples predict, or the first few of each replicate, which the others correct
        monkeypatch.setattr(kriging_rules, "MOST", most)
        for design, sets, n, d in (("sobol", 4, 64, 3), ("halton", 3, 50, 2), ("uniform", 100, 4, 2)):
            points = vq.sample(design, n, d, sets=sets, rng=1).points
            shares = replicate_shares(points, KRIGING, threads=2)
            predicting = min(sets, most) * min(n, max(1, most // sets))
            np.testing.assert_allclose(shares[np.arange(sets), np.arange(sets)], 1 / n, rtol=1e-12)
            for r in range(sets):
                check_exact(points.reshape(-1, d), shares[r].ravel(), model(predicting, d).degree)


def test_order_auto_is_the_default_of_the_grid():
    def f(x):
        return np.cos(3 * x.sum(axis=0))

    for d, n in ((1, 64), (2, 64), (2, 400), (3, 64), (4, 81)):
        s = vq.sample("multi-jittered", n, d, rng=np.random.default_rng(3))
        value = vq.weights(s, order="auto", debias="auto") @ f(s.points.T)
        order = default_of_strata(s.strata).order
        r = vq.quad(f, np.zeros(d), np.ones(d), n_points=n, order=order, rng=3)
        assert r.integral == pytest.approx(value, rel=1e-12)


# ---------------------------------------------------------------------- without bias


def jumpy(x):
    """Not zero at the border, with a jump along a slanted plane; (..., d)."""
    return np.exp(x[..., 0]) + (x.sum(axis=-1) < 0.43 * x.shape[-1])


def exact_jumpy(d):
    t = 0.43 * d  # the distribution function of a sum of d uniform variables (Irwin and Hall)
    below = sum((-1) ** j * math.comb(d, j) * max(t - j, 0) ** d for j in range(d + 1)) / math.factorial(d)
    return math.e - 1 + below


def ramp(x, k):
    """A ramp of mean zero in the first layer of strata, 0 elsewhere: it finds fits that know x_i."""
    first = x[..., 0] * k
    return np.where(first < 1, first - 0.5, 0.0)


# 17 checks at 5.5 standard errors: a correct program exceeds one of them once in 1.7e6 seeds. With so many
# sets a bias of 0.1 standard deviations of one estimate shows as |z| ≈ 5.6.
SETS = 3100


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("design", "strata"),
    [("stratified", (4, 4)), ("multi-jittered", (5, 5)), ("multi-jittered", (3, 4, 4)), ("stratified", (9,)),
     ("multi-jittered", (4, 4, 4)), ("multi-jittered", (2, 2, 2, 2, 2))],
)  # fmt: skip
def test_strata_are_unbiased(z_score, design, strata):
    samples = draw(strata, SETS, design, seed=5)
    w = fit_strata(samples, KRIGING, threads=1).weights
    for f, truth in ((jumpy(samples.points), exact_jumpy(len(strata))), (ramp(samples.points, strata[0]), 0.0)):
        assert abs(z_score((w * f).sum(axis=1), truth)) < 5.5


@pytest.mark.statistical
@pytest.mark.parametrize("design", DESIGNS)
def test_strata_are_unbiased_where_a_part_predicts(z_score, monkeypatch, design):
    monkeypatch.setattr(kriging_rules, "MOST", 12)
    samples = draw((5, 6), SETS, design, seed=5)
    w = fit_strata(samples, KRIGING, threads=1).weights
    for f, truth in ((jumpy(samples.points), exact_jumpy(2)), (ramp(samples.points, 5), 0.0)):
        assert abs(z_score((w * f).sum(axis=1), truth)) < 5.5


@pytest.mark.statistical
def test_dependence_between_colours_is_found_biased(z_score):
    samples = draw((4, 4), 800, "stratified", seed=5)
    together = samples.points - samples.points % 0.25 + samples.points[:, :1] % 0.25  # all alike in their strata
    w = fit_strata(SampleSet(together, "stratified", (4, 4)), KRIGING, threads=1).weights
    assert abs(z_score((w * ramp(together, 4)).sum(axis=1), 0.0)) > 6.5


@pytest.mark.statistical
@pytest.mark.parametrize(("n", "d"), [(9, 1), (16, 2), (27, 3), (40, 5)])
def test_independent_samples_are_unbiased(z_score, n, d):
    points = vq.sample("uniform", n, d, sets=SETS, rng=5).points
    w = vq.weights(points, design="uniform", order="kriging", debias="leave-one-out")
    assert abs(z_score((w * jumpy(points)).sum(axis=1), exact_jumpy(d))) < 5.5
    near_the_border = (points[..., 0] < 0.06).astype(float)
    assert abs(z_score((w * near_the_border).sum(axis=1), 0.06)) < 5.5


def test_weights_of_independent_samples_are_tame():
    """With 12 samples per term of the drift, as strata have, the worst sum is 1.9 here, and a weight is 42/n."""
    points = vq.sample("uniform", 660, 2, sets=100, rng=5).points
    w = np.abs(vq.weights(points, design="uniform", order="kriging", debias="leave-one-out"))
    assert w.sum(axis=1).mean() < 1.12
    assert w.sum(axis=1).max() < 1.5
    assert 660 * w.max() < 30


@pytest.mark.statistical
def test_the_integral_of_the_prediction_alone_is_found_biased(z_score):
    points = vq.sample("uniform", 9, 1, sets=3100, rng=5).points
    kriging = Kriging(points, model(9, 1))
    w = kriging.integrals(kriging.over_boxes([Intervals(np.zeros(1), np.ones(1), np.zeros(1, int), 1)]))[:, 0]
    assert abs(z_score((w * (points[..., 0] < 0.06)).sum(axis=1), 0.06)) > 6.5


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("design", "n", "d", "most"),
    [
        ("sobol", 8, 2, 2048),
        *(pytest.param(*case, marks=pytest.mark.slow) for case in (("sobol", 16, 5, 2048), ("halton", 9, 3, 10))),
    ],
)
def test_replicates_are_unbiased(z_score, monkeypatch, design, n, d, most):
    monkeypatch.setattr(kriging_rules, "MOST", most)
    points = vq.sample(design, n, d, sets=2 * SETS, rng=5).points.reshape(SETS, 2, n, d)
    shares = np.stack([replicate_shares(pair, KRIGING, 1) for pair in points])
    assert abs(z_score(np.einsum("prsn,psn->p", shares, jumpy(points)) / 2, exact_jumpy(d))) < 5.5


def test_large_grids_have_no_limit_and_independent_samples_one():
    values = [vq.quad(lambda x: np.exp(x.sum(axis=0)), [0] * 5, [1] * 5, sampler="stratified", n_points=n, rng=1)
              for n in (1024, 3125)]  # fmt: skip
    for value in values:
        assert abs(value.integral - (math.e - 1) ** 5) < 4 * value.standard_error
    assert values[1].standard_error < values[0].standard_error
    with pytest.raises(ValueError, match="n ≤ 2048"):
        vq.weights(
            np.random.default_rng(1).random((2049, 2)), design="uniform", order="kriging", debias="leave-one-out"
        )
