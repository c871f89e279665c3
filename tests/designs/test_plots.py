"""What pictures of sample sets show."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
import pytest

mpl.use("Agg")

import matplotlib.pyplot as plt

import voroquad as vq


@pytest.fixture(autouse=True)
def _close():
    yield
    plt.close("all")


def test_on_a_line_heights_are_weights():
    s = vq.sample("uniform", 8, 1, rng=1)
    w = vq.weights(s)
    lines = s.plot(w).collections[0].get_segments()
    np.testing.assert_allclose([line[1] for line in lines], np.stack([s.points[:, 0], 8 * w], axis=1))


@pytest.mark.parametrize("d", [2, 3])
def test_dots_are_points_and_their_colours_weights(d):
    s = vq.sample("stratified", 2**d, d, rng=1)
    w = vq.weights(s)
    ax = s.plot(w)
    dots = ax.collections[0]
    np.testing.assert_allclose(np.stack(dots._offsets3d, axis=1) if d == 3 else dots.get_offsets(), s.points)
    np.testing.assert_allclose(np.sort(dots.get_array()), np.sort(2**d * w))


def test_strata_are_ruled():
    lines = vq.sample("stratified", 16, 2, rng=1).plot().lines
    assert sorted(line.get_xdata()[0] for line in lines)[3:] == [0.25, 0.5, 0.75]


def test_what_cannot_be_drawn():
    batch, many = vq.sample("uniform", 8, 2, sets=2, rng=1), vq.sample("uniform", 8, 4, rng=1)
    for s in (batch, many):
        with pytest.raises(ValueError, match="one set of points"):
            s.plot()
    with pytest.raises(ValueError, match=r"weights has shape \(7,\); give one for each"):
        vq.sample("uniform", 8, 2, rng=1).plot(np.ones(7))
    with pytest.raises(ValueError, match="projection='3d'"):
        vq.sample("uniform", 8, 3, rng=1).plot(ax=plt.figure().add_subplot())
