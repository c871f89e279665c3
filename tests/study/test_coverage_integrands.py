"""Integrals against quadrature, formulas against each other, at least forty integrands of each dimension."""

import itertools
import math

import numpy as np
import pytest
from scipy import integrate

import voroquad as vq
from voroquad.study.coverage_integrands import cases


@pytest.mark.parametrize("d", range(1, 7))
def test_there_are_enough_of_each_kind_and_most_are_not_calibrated_on(d):
    found = cases(d)
    assert len(found) >= 40
    assert len({case.name for case in found}) == len(found)
    assert sum(case.calibrated for case in found) <= len(found) / 2
    kinds = {case.kind for case in found}
    assert kinds == {"end", "singularity inside", "peak", "kink", "step", "wave", "smooth", "infinite range", "vector"}
    for case in found:
        assert case.lower.shape == case.upper.shape == (d,)
        x = np.clip(np.full((d, 3), 0.4), np.maximum(case.lower, -9)[:, None] + 0.1, np.minimum(case.upper, 9)[:, None])
        assert case(x).shape == (*case.integral.shape, 3)


@pytest.mark.parametrize("case", cases(1), ids=lambda case: case.name)
def test_integrals_on_the_line(case):
    breaks = [0.29, 0.31, 0.35, 0.37, 0.4, 0.41, 0.43, 0.45, 0.5, 0.53, 0.55, 0.61, 0.63, 0.7, 0.71, 0.83]
    ends = [float(case.lower[0]), *(breaks if math.isfinite(case.upper[0]) else [1.5]), float(case.upper[0])]
    components = np.atleast_1d(case.integral)
    for i, exact in enumerate(components):
        if "77" in case.formula or "33" in case.formula:  # waves, whose integrals are sums of a rule for waves
            rate = float(case.formula.split("(")[1].split(" ")[0])
            phase = float(case.formula.split("+")[1].strip(" )"))
            found = integrate.quad(lambda x, p=phase: math.cos(p), 0, 1, weight="cos", wvar=rate)[0]
            found -= integrate.quad(lambda x, p=phase: math.sin(p), 0, 1, weight="sin", wvar=rate)[0]
        else:
            f = lambda x, i=i: float(np.atleast_2d(case(np.array([[x]])))[i, 0])  # noqa: E731
            found = sum(integrate.quad(f, a, b, limit=500)[0] for a, b in itertools.pairwise(ends))
        assert found == pytest.approx(exact, rel=1e-6, abs=1e-8)


@pytest.mark.parametrize("d", [2, 3, 5])
def test_integrals_of_those_that_are_no_products(d):
    rng = np.random.default_rng(d)
    x = rng.random((d, 400_000))
    for case in cases(d):
        if "n·x" in case.formula:
            values = case(x)
            error = values.std() / math.sqrt(x.shape[1])
            assert abs(values.mean() - case.integral) < 5 * error + 1e-12, case.name


def test_products_over_all_axes_have_the_product_of_the_integrals():
    by_formula = {case.formula: case for case in cases(1)}
    for case in cases(3):
        if case.formula.startswith("product"):
            one = by_formula[case.formula.removeprefix("product over the axes of ")]
            assert case.integral == pytest.approx(float(one.integral) ** 3)
            x = np.array([[0.3, 0.6, 0.2]]).T + (1.5 if case.lower[0] == 1 else 0)
            np.testing.assert_allclose(case(x), np.prod([one(along[None]) for along in x]))


def test_quad_integrates_them():
    case = next(case for case in cases(2) if case.kind == "vector")
    result = vq.quad(case, case.lower, case.upper, n_points=256, rng=1)
    np.testing.assert_allclose(result.integral, case.integral, atol=0.03)
