import numpy as np
import pytest
import scipy.stats

import voroquad as vq


def test_product_measure_gives_expectations_and_integrals():
    m = vq.ProductMeasure(scipy.stats.norm(1, 2), scipy.stats.expon())
    s = vq.sample("stratified", n=64 * 64, d=2, rng=3)
    x, w = m.transform(s.points), vq.weights(s)
    assert w @ x[:, 0] ** 2 == pytest.approx(5, rel=0.01)
    gauss = np.exp(-((x[:, 0] - 1) ** 2) / 8 - x[:, 1])
    assert w @ (gauss / m.density(x)) == pytest.approx(np.sqrt(8 * np.pi), rel=1e-9)


def test_a_corner_of_the_box_gives_no_infinity():
    assert np.isfinite(vq.ProductMeasure(scipy.stats.norm()).transform([[0.0]])).all()


@pytest.mark.statistical
@pytest.mark.parametrize("debias", ["exchange", "bias-function"])
def test_piecewise_uniform_is_unbiased(z_score, debias):
    m = vq.PiecewiseUniform([-1.0, 0.0, 0.5, 3.0], [7, 1, 12])
    x = m.sample("uniform", sets=20_000, rng=5)
    w = m.weights(x, design="uniform", debias=debias)
    assert abs(z_score((w * np.exp(x)).sum(axis=1), np.exp(3) - np.exp(-1))) < 5.5
    voronoi = m.weights(x)
    assert abs(z_score((voronoi * np.exp(x)).sum(axis=1), np.exp(3) - np.exp(-1))) > 20
    np.testing.assert_allclose(voronoi.sum(axis=1), 4.0, atol=1e-12)


def test_plain_monte_carlo_with_its_density(z_score):
    m = vq.PiecewiseUniform([0.0, 0.2, 1.0], [30, 10])
    x = m.sample("uniform", sets=20_000, rng=5)
    assert abs(z_score((np.exp(x) / m.density(x)).mean(axis=1), np.e - 1)) < 5.5
    assert m.density([-0.1, 0.1, 0.9, 1.1]).tolist() == [0.0, 3.75, 0.3125, 0.0]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: vq.PiecewiseUniform([0, 1, 1], [3, 3]), "edges must ascend"),
        (lambda: vq.PiecewiseUniform([0, np.inf], [3]), "finite"),
        (lambda: vq.PiecewiseUniform([0, 1, 2], [3]), r"one number per piece \(2\)"),
        (lambda: vq.PiecewiseUniform([0, 1], [0]), r"counts\[0\] must be a whole number"),
        (lambda: vq.PiecewiseUniform([0, 1, 2], [1, 1]).weights([1.5, 0.5]), "must lie in piece 0"),
        (lambda: vq.PiecewiseUniform([0, 1, 2], [1, 1]).weights([np.nan, 1.5]), "must lie in piece 0"),
        (lambda: vq.PiecewiseUniform([0, 1], [2]).weights([0.5]), r"x must have shape \(2,\)"),
        (lambda: vq.ProductMeasure(), "one per coordinate"),
        (lambda: vq.ProductMeasure(3), "lacks ppf and pdf"),
        (lambda: vq.ProductMeasure(scipy.stats.norm()).transform([[0.1, 0.2]]), r"shape \(\.\.\., 1\)"),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
