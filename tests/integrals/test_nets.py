"""Plain means of Sobol' replicates and their error."""

import numpy as np
import pytest

from voroquad.integrals.evaluation import Function
from voroquad.integrals.integrand import Integrand
from voroquad.integrals.library import Library
from voroquad.integrals.nets import NetEstimator
from voroquad.integrals.regions import Box


def estimate(f, n, sets=1, seed=1, d=3):
    library = Library.of(0, 1)
    integrand = Integrand(Function(f, library), Box([0] * d, [1] * d, library))
    return NetEstimator(integrand, sets, np.random.default_rng(seed))(n)


def test_replicates_are_the_largest_of_which_four_fit():
    assert [estimate(lambda x: x[0], n).n for n in (4, 31, 1000, 1500)] == [4, 28, 896, 1280]
    r = estimate(lambda x: x[0], 256, sets=5)
    assert r.n == 1280
    assert r.degrees_of_freedom == 4


def test_mean_and_error_of_several_components():
    r = estimate(lambda x: np.stack([np.ones(x.shape[1]), x[0] * x[1], 1e9 * x[0] * x[1]]), 1024)
    np.testing.assert_allclose(r.mean, [1, 0.25, 0.25e9], rtol=1e-3)
    assert r.error[0] < 1e-14
    assert r.error[2] == pytest.approx(1e9 * r.error[1], rel=1e-9)
    assert {w.kind for w in estimate(lambda x: 0 * x[0], 64).warnings} == {"zero"}


def test_rare_large_values_are_in_the_error():
    """One in a hundred of the values is 100: most replicates have about as many, and their spread shows too little."""
    covered = []
    for seed in range(60):
        r = estimate(lambda x: 100.0 * (np.prod(x, axis=0) < 2.3e-4), 512, seed=seed, d=3)
        p = 2.3e-4
        exact = 100 * p * (1 - np.log(p) + np.log(p) ** 2 / 2)
        covered.append(abs(r.mean[0] - exact) < 2.5 * r.error[0])
        values = 512 * 0.0101
        assert r.error[0] > 0.5 * 100 * np.sqrt(values) / 512 or r.mean[0] < exact / 2
    assert np.mean(covered) > 0.85
