"""The integrand pulled back to the unit box."""

import numpy as np
import pytest

from voroquad.integrals.integrand import Integrand


@pytest.mark.parametrize(
    ("a", "b"),
    [(-1.5, 2.0), (2.0, -1.5), (0.5, np.inf), (-np.inf, 0.5), (-np.inf, np.inf), (np.inf, -np.inf)],
)
def test_the_jacobian_is_the_derivative_of_the_map(a, b):
    """∫ (dx/du) du = x(v) − x(u), on intervals that halve towards both ends, down to 2^−40."""
    integrand = Integrand(lambda x: np.ones(x.shape[1]), a, b)
    near = 2.0 ** -np.arange(1, 41.0)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    for ends in (near, 1 - near):
        start, stop = np.minimum(ends[1:], ends[:-1]), np.maximum(ends[1:], ends[:-1])
        u = start[:, None] + (stop - start)[:, None] * (nodes + 1) / 2
        _, jacobian = integrand.pull_back(u.reshape(1, -1))
        integrals = (jacobian.reshape(u.shape) @ weights) * (stop - start) / 2
        (to,), (begin,) = integrand.pull_back(stop[None])[0], integrand.pull_back(start[None])[0]
        np.testing.assert_allclose(integrals, to - begin, rtol=2e-5)  # 2^-40 away from 1, u has 12 digits less
        np.testing.assert_allclose(integrals[:20], (to - begin)[:20], rtol=1e-9)


def test_the_map_goes_through_the_whole_interval():
    """Strictly upwards, from one limit to the other; those at infinity are left out."""
    u = np.concatenate([[0.0], np.geomspace(1e-12, 0.5, 50), 1 - np.geomspace(0.4, 1e-12, 50), [1.0]])[None]
    for a, b in [(-1.5, 2.0), (0.5, np.inf), (-np.inf, 0.5), (-np.inf, np.inf)]:
        (x,), jacobian = Integrand(lambda x: x[0], a, b).pull_back(u)
        assert np.isfinite(x).all()
        assert (np.isfinite(jacobian) & (jacobian > 0)).all()
        assert (np.diff(x) >= 0).all()
        assert (np.diff(x[1:-1]) > 0).all()
        assert x[0] == pytest.approx(a, abs=1e-15) if np.isfinite(a) else x[0] < -1e15
        assert x[-1] == pytest.approx(b, abs=1e-15) if np.isfinite(b) else x[-1] > 1e15
