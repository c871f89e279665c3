"""The families' integrals are those of their functions."""

import numpy as np
import pytest

from voroquad.study.genz import FAMILIES, instances


@pytest.mark.parametrize("d", [1, 2, 3, 6])
def test_integrals_against_scrambled_sobol_points(d):
    from scipy.stats import qmc

    sets = np.stack([qmc.Sobol(d, rng=s).random(2**12).T for s in range(8)])
    for f in instances(d, 2, rng=1):
        means = np.array([f(x).mean() for x in sets])
        error = means.std(ddof=1) / np.sqrt(8)
        assert abs(means.mean() - f.integral) < 12 * error + 1e-4, f.name  # Student t, 7 degrees: p = 6e-6
        assert error < 0.05 * abs(f.integral) + 1e-3, f.name


def test_eight_families_and_reproducible():
    names = [f.name for f in instances(2, 3, rng=1)]
    assert names == [name for name in FAMILIES for _ in range(3)]
    x = np.random.default_rng(1).random((2, 5))
    for f, g in zip(instances(2, 1, 4), instances(2, 1, 4), strict=True):
        np.testing.assert_array_equal(f(x), g(x))
