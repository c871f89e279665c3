import re
from pathlib import Path

import numpy as np
import pytest
import scipy.stats

import voroquad as vq

NEW_NORMAL = scipy.stats.Normal(mu=1.0, sigma=2.0)  # has icdf, no ppf


# ---------------------------------------------------------------------- products of distributions


@pytest.mark.parametrize("normal", [scipy.stats.norm(1, 2), NEW_NORMAL], ids=["frozen", "new"])
def test_product_measure_gives_expectations_and_integrals(normal):
    m = vq.ProductMeasure(normal, scipy.stats.expon())
    s = vq.sample("stratified", n=64 * 64, d=2, rng=3)
    x, w = m.transform(s.points), vq.weights(s)
    assert w @ x[:, 0] ** 2 == pytest.approx(5, rel=0.01)
    gauss = np.exp(-((x[:, 0] - 1) ** 2) / 8 - x[:, 1])
    assert w @ (gauss / m.density(x)) == pytest.approx(np.sqrt(8 * np.pi), rel=1e-9)


@pytest.mark.parametrize("distribution", [scipy.stats.norm(), scipy.stats.Normal(), scipy.stats.cauchy()])
def test_a_corner_of_the_box_gives_no_infinity(distribution):
    edges = [[0.0], [np.nextafter(1.0, 0.0)]]
    assert np.isfinite(vq.ProductMeasure(distribution).transform(edges)).all()


@pytest.mark.statistical
def test_importance_sampling_is_unbiased(z_score):
    m = vq.ProductMeasure(scipy.stats.expon(scale=2), NEW_NORMAL)
    s = vq.sample("uniform", n=16, d=2, sets=20_000, rng=5)
    x = m.transform(s.points)
    f = (x[..., 0] > 1) * np.exp(-x[..., 0] - (x[..., 1] - 1) ** 2 / 4)  # ∫ f = 2√π / e
    f_over_p = f / m.density(x)
    truth = 2 * np.sqrt(np.pi) / np.e
    assert abs(z_score((vq.weights(s, debias="leave-one-out") * f_over_p).sum(axis=1), truth)) < 5.5
    assert abs(z_score((vq.weights(s) * f_over_p).sum(axis=1), truth)) > 20


def test_existing_points_are_weighed_with_a_target_measure():
    x = [[-1.0, 0.5], [0.25, 2.0], [3.0, 0.1]]
    m = vq.ProductMeasure(scipy.stats.norm(), scipy.stats.expon())
    u = np.stack([scipy.stats.norm.cdf([-1.0, 0.25, 3.0]), scipy.stats.expon.cdf([0.5, 2.0, 0.1])], axis=1)
    np.testing.assert_allclose(m.weights(x), vq.weights(u), rtol=1e-12)
    np.testing.assert_array_equal(m.weights([x, x[::-1]]), [m.weights(x), m.weights(x[::-1])])
    assert m.weights([[40.0, 1e3]]).tolist() == [1.0]  # far out, where F rounds to 1
    line = vq.ProductMeasure(scipy.stats.uniform(-1, 2))
    np.testing.assert_allclose(line.weights([-1.0, 0.0, 1.0]), [0.25, 0.5, 0.25], rtol=1e-15)


@pytest.mark.statistical
def test_existing_points_need_no_known_density():
    """The error falls faster than that of self-normalised importance sampling, which is told the density."""
    target = vq.ProductMeasure(scipy.stats.norm(), NEW_NORMAL)
    drawn_from = vq.ProductMeasure(scipy.stats.norm(0.5, 1.2), scipy.stats.norm(0, 3))
    truth = np.cos(0.5) / np.sqrt(np.e) + 0.5  # E[cos(X − ½)] + P(Y > 1)

    def mean_squared_errors(n):
        x = drawn_from.transform(vq.sample("uniform", n, 2, sets=400, rng=8).points)
        f = np.cos(x[..., 0] - 0.5) + (x[..., 1] > 1)
        ratio = target.density(x) / drawn_from.density(x)
        rules = {"cells": target.weights(x), "ratio": ratio / ratio.sum(axis=1, keepdims=True), "equal": 1 / n}
        return {name: np.mean(((w * f).sum(axis=1) - truth) ** 2) for name, w in rules.items()}

    few, many = mean_squared_errors(64), mean_squared_errors(1024)
    assert few["cells"] < few["ratio"] / 4
    assert many["cells"] < many["ratio"] / 16
    assert few["cells"] / many["cells"] > 3 * few["ratio"] / many["ratio"]
    assert many["equal"] > 100 * many["cells"]  # equal weights converge to another number


# ---------------------------------------------------------------------- piecewise uniform

ON_A_LINE = vq.PiecewiseUniform([-1.0, 0.0, 0.5, 3.0], [7, 1, 12])
ON_A_GRID = vq.PiecewiseUniform([[-1, 0, 0.5], [0, 0.25, 2]], [[9, 8], [1, 12]])
AN_L = vq.PiecewiseUniform.from_boxes([[0, 0, 0], [1, 0, 0]], [[1, 2, 1], [3, 1, 1]], [8, 5])


def exponential(x):
    """e^(x_1 + … + x_d), and a jump."""
    return np.exp(x.sum(axis=-1)) + (x[..., 0] > 0.3)


def integral(lower, upper):
    """∫ of it over a box."""
    volume = np.prod(np.subtract(upper, lower))
    beyond = np.clip((upper[0] - 0.3) / (upper[0] - lower[0]), 0, 1)
    return np.prod(np.exp(upper) - np.exp(lower)) + volume * beyond


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("m", "debias"),
    [(ON_A_LINE, "exchange"), (ON_A_LINE, "bias-function"), (ON_A_GRID, "bias-function")]
    + [(m, "leave-one-out") for m in (ON_A_LINE, ON_A_GRID, AN_L)],
)
def test_piecewise_uniform_is_unbiased(z_score, m, debias):
    s = m.sample("uniform", sets=10_000, rng=5)
    f = exponential(s.points)
    truth = sum(integral(*box) for box in zip(m.lower, m.upper, strict=True))
    assert abs(z_score((m.weights(s, debias=debias) * f).sum(axis=1), truth)) < 5.5
    voronoi = m.weights(s)
    assert abs(z_score((voronoi * f).sum(axis=1), truth)) > 14
    np.testing.assert_allclose(voronoi.sum(axis=1), np.prod(m.upper - m.lower, axis=1).sum(), rtol=1e-12)


@pytest.mark.statistical
def test_each_piece_may_have_any_measure(z_score):
    masses = np.array([[0.1, 0.0], [0.5, 0.4]])
    m = vq.PiecewiseUniform([[-1, 0, 0.5], [0, 0.25, 2]], [[9, 3], [4, 2]], masses)
    s = m.sample("uniform", sets=20_000, rng=5)
    w = m.weights(s, debias="leave-one-out")
    means = [integral(*box) / np.prod(box[1] - box[0]) for box in zip(m.lower, m.upper, strict=True)]
    assert abs(z_score((w * exponential(s.points)).sum(axis=1), masses.ravel() @ means)) < 5.5
    np.testing.assert_allclose(w.sum(axis=1), 1, atol=1e-12)


@pytest.mark.parametrize("sampler", ["uniform", "stratified", "sobol"])
@pytest.mark.parametrize("m", [ON_A_GRID, AN_L])
def test_a_set_is_like_a_sample_set(m, sampler):
    if sampler == "stratified":
        m = vq.PiecewiseUniform.from_boxes(m.lower, m.upper, [4**m.d] * len(m.counts))
    s, batch = m.sample(sampler, rng=1), m.sample(sampler, sets=3, rng=1)
    assert (s.points.shape, s.design, s.n, s.d) == ((m.n, m.d), sampler, m.n, m.d)
    assert batch.points.shape == (3, m.n, m.d)
    w = m.weights(s)
    np.testing.assert_allclose(m.weights(s.points), w, rtol=1e-9)  # bare positions in place of samples
    if sampler != "sobol":
        told = m.weights(s.points, order=1, debias="leave-one-out", design=sampler)
        np.testing.assert_allclose(told, m.weights(s, order=1, debias="leave-one-out"), atol=1e-9)


@pytest.mark.statistical
@pytest.mark.parametrize("sampler", ["uniform", "sobol"])
def test_pieces_are_independent(sampler):
    """Of two pieces alike, a function of the one's samples tells nothing of the same function of the other's."""
    m = vq.PiecewiseUniform([0, 1, 2], [8, 8])
    x = m.sample(sampler, sets=4000, rng=3).points[..., 0] % 1
    (_, correlation), _ = np.corrcoef(np.exp(x).reshape(-1, 2, 8).mean(axis=-1).T)
    assert abs(correlation) * np.sqrt(4000) < 5.5


def test_a_grid_is_its_boxes():
    boxes = vq.PiecewiseUniform.from_boxes(ON_A_GRID.lower, ON_A_GRID.upper, ON_A_GRID.counts)
    assert (ON_A_GRID.lower[1].tolist(), ON_A_GRID.upper[1].tolist()) == ([-1, 0.25], [0, 2])
    np.testing.assert_array_equal(boxes.sample(rng=3).points, ON_A_GRID.sample(rng=3).points)


@pytest.mark.statistical
@pytest.mark.parametrize("m", [ON_A_LINE, ON_A_GRID, AN_L])
def test_plain_monte_carlo_with_its_density(z_score, m):
    x = m.sample("uniform", sets=20_000, rng=5).points
    truth = sum(integral(*box) for box in zip(m.lower, m.upper, strict=True))
    assert abs(z_score((exponential(x) / m.density(x)).mean(axis=1), truth)) < 5.5


def test_density():
    m = vq.PiecewiseUniform([0.0, 0.2, 1.0], [30, 10])
    assert m.density([-0.1, 0.1, 0.2, 0.9, 1.0]).tolist() == [0.0, 3.75, 0.3125, 0.3125, 0.0]
    assert AN_L.density([[0.5, 1.5, 0.5], [2.0, 1.5, 0.5], [2.0, 0.5, 0.5]]).tolist() == [4 / 13, 0.0, 2.5 / 13]


LINE = vq.ProductMeasure(scipy.stats.norm())
HALF_LINE = vq.ProductMeasure(scipy.stats.expon())


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: vq.PiecewiseUniform([0, 1, 1], [3, 3]), "edges must ascend"),
        (lambda: vq.PiecewiseUniform([0, np.inf], [3]), "finite"),
        (lambda: vq.PiecewiseUniform(3, [3]), "edges must be two or more"),
        (lambda: vq.PiecewiseUniform([[0, 1], [1, 0]], [[3]]), r"edges\[1\] must ascend"),
        (lambda: vq.PiecewiseUniform([0, 1, 2], [3]), r"one number per piece \(2\)"),
        (lambda: vq.PiecewiseUniform([[0, 1], [0, 1, 2]], [3, 3]), r"one number per piece \(1 × 2\)"),
        (lambda: vq.PiecewiseUniform([0, 1], [0]), r"counts\[0\] must be a whole number"),
        (lambda: vq.PiecewiseUniform([[0, 1], [0, 1, 2]], [[3, 0.5]]), r"counts\[\(0, 1\)\] must be a whole number"),
        (lambda: vq.PiecewiseUniform([0, 1], [3], [np.nan]), r"measures\[0\] must be finite"),
        (lambda: vq.PiecewiseUniform([0, 1], [3], [1, 2]), r"measures must hold one number per piece, shape \(1,\)"),
        (
            lambda: vq.PiecewiseUniform.from_boxes([[0, 0]], [[1, 0]], [3]),
            r"lower\[0\] = \[0.0, 0.0\] must be .* below",
        ),
        (lambda: vq.PiecewiseUniform.from_boxes([0, 1], [1, 2], [3, 3]), r"must both have shape \(k, d\)"),
        (lambda: vq.PiecewiseUniform.from_boxes([[0], [2], [1]], [[1.5], [3], [2]], [1] * 3), "boxes 0 and 2 overlap"),
        (lambda: vq.PiecewiseUniform([0, 1, 2], [1, 1]).weights([1.5, 0.5]), r"samples\[0\] .* must lie in piece 0"),
        (lambda: vq.PiecewiseUniform([0, 1, 2], [1, 1]).weights([0.5, np.nan]), r"samples\[1\] .* must lie in piece 1"),
        (lambda: ON_A_GRID.weights(AN_L.sample(rng=1)), r"samples must have shape \(n, 2\)"),
        (lambda: vq.PiecewiseUniform([0, 1], [2]).weights([0.5]), r"samples must have shape \(2, 1\)"),
        (lambda: vq.ProductMeasure(), "one per coordinate"),
        (lambda: vq.ProductMeasure(3), "lacks ppf"),
        (lambda: LINE.transform([[0.1, 0.2]]), r"shape \(\.\.\., 1\)"),
        (lambda: LINE.transform([[0.5], [-0.5]]), r"u\[1\] = \[-0.5\] is not inside \[0, 1\)\^1; scale"),
        (lambda: LINE.transform([[[0.5], [0.5]], [[0.5], [1.0]]]), r"u\[\(1, 1\)\] = \[1.0\] is not inside"),
        (lambda: LINE.transform([np.nan]), r"u\[0\] = \[nan\] is not inside"),
        (lambda: LINE.weights([[0.0], [np.nan]]), r"x\[1\] = \[nan\] is not in the support"),
        (lambda: HALF_LINE.weights([[[1.0]], [[-1.0]]]), r"x\[\(1, 0\)\] = \[-1.0\] .* \[0.0\] to \[inf\]; drop it"),
        (lambda: HALF_LINE.weights([[1.0, 2.0]]), r"x must have shape \(n, 1\)"),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_the_guide_runs():
    guide = Path(__file__).parents[2] / "docs" / "measures.md"
    names: dict[str, object] = {}
    for block in re.findall(r"```python\n(.*?)```", guide.read_text(encoding="utf-8"), re.DOTALL):
        exec(block, names)


# ---------------------------------------------------------------------- quad


def test_expectations_by_quad():
    m = vq.ProductMeasure(scipy.stats.norm(1, 2), scipy.stats.expon())
    r = vq.quad(lambda x: np.stack([x[0] ** 2, x[0] * x[1], np.ones(x.shape[1])]), measure=m, n_points=4096, rng=1)
    exact = np.array([5, 1, 1])
    assert (abs(r.integral - exact) < 5 * r.standard_error + 1e-12).all()
    assert (r.standard_error < 2e-2).all()


@pytest.mark.parametrize("measures", [None, [[0.5, 2.0], [0.0, 1.0]]])
def test_quad_over_pieces_of_a_measure(measures):
    """The mass of each piece is spread evenly over it, and its samples are its share of n_points."""
    m = vq.PiecewiseUniform([[0, 0.2, 1], [0, 0.5, 1]], counts=[[9, 3], [3, 1]], measures=measures)
    seen = []
    r = vq.quad(lambda x: seen.append(x) or x[0] * x[1], measure=m, n_points=1600, rng=1)
    means = np.outer([0.1, 0.6], [0.25, 0.75])
    masses = np.outer([0.2, 0.8], [0.5, 0.5]) if measures is None else np.array(measures)
    assert r.integral == pytest.approx((means * masses).sum(), rel=1e-9)
    assert [x.shape[1] for x in seen] == [900, 289, 289, 100]  # squares up to 900, 300, 300, 100
    assert seen[0].max(axis=1).tolist() < [0.2, 0.5]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"measure": scipy.stats.norm()}, "measure must be a vq.ProductMeasure or a vq.PiecewiseUniform, got rv_"),
        ({"a": 0, "b": 1, "measure": vq.ProductMeasure(scipy.stats.norm())}, "give only one of limits, a domain"),
        ({"a": vq.ProductMeasure(scipy.stats.norm())}, r"a is a ProductMeasure; write quad\(func, measure=...\)"),
    ],
)
def test_what_quad_takes_for_a_measure(arguments, message):
    with pytest.raises(ValueError, match=message):
        vq.quad(lambda x: x[0], **arguments)


@pytest.mark.parametrize("parameters", [(0, -1), ([0, 1], 1), (np.nan, 1)])
def test_a_distribution_without_a_median_is_named(parameters):
    with pytest.raises(ValueError, match=r"distributions\[1\] must be one distribution with valid parameters"):
        vq.ProductMeasure(scipy.stats.norm(), scipy.stats.norm(*parameters))
