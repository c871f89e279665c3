"""Maps of each axis by itself: volume elements, inverses, and where they put samples."""

import numpy as np

from voroquad.integrals.separable_map import INTERVALS, SeparableMap, refined

NODES = np.stack([np.linspace(0, 1, 25) ** 3, np.sin(np.linspace(0, np.pi / 2, 25))])


def test_the_map_has_its_volume_element_and_inverse():
    warp = SeparableMap(NODES)
    v = np.random.default_rng(1).uniform(0.01, 0.99, (2, 50))
    u, element = warp(v)
    np.testing.assert_allclose(warp.inverse(u), v, atol=1e-12)
    h = 1e-7
    slopes = [(warp(v + h * e[:, None])[0] - warp(v - h * e[:, None])[0]).sum(axis=0) / (2 * h) for e in np.eye(2)]
    np.testing.assert_allclose(element, slopes[0] * slopes[1], rtol=1e-4)
    np.testing.assert_allclose(warp(np.array([[0.0, 1.0], [0.0, 1.0]]))[0], [[0, 1], [0, 1]], atol=1e-15)


def test_intervals_a_million_times_as_wide_as_others():
    nodes = np.cumsum(np.r_[0, 10.0 ** np.random.default_rng(1).uniform(-6, 0, INTERVALS)])[None]
    warp = SeparableMap(nodes / nodes[0, -1])
    v = np.random.default_rng(2).random((1, 1000))
    u, _ = warp(v)
    np.testing.assert_allclose(warp(warp.inverse(u))[0], u, rtol=1e-13)


def test_intervals_gather_where_the_integrand_is_large():
    u = np.random.default_rng(1).random((2, 4000))
    masses = np.exp(-(((u[0] - 0.3) / 0.05) ** 2)) + 1e-3
    warp = SeparableMap.identity(2)
    for _ in range(4):
        warp = refined(warp, u, masses)
    inside = ((warp.nodes > 0.2) & (warp.nodes < 0.4)).sum(axis=1)
    assert inside[0] > 0.6 * INTERVALS
    assert inside[1] < 0.4 * INTERVALS
    assert (np.diff(warp.nodes) > 0).all()
    assert refined(warp, u, np.zeros(4000)) is warp
