"""What pictures of results show."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
import pytest

mpl.use("Agg")

import matplotlib.pyplot as plt

import voroquad as vq
from voroquad.integrals.plots import _shares


@pytest.fixture(autouse=True)
def _close():
    yield
    plt.close("all")


def test_convergence_is_that_of_the_trials():
    result = vq.quad(lambda x: np.abs(x[0] - 0.3), 0, 1, n_points=16, rtol=1e-5, rng=1)
    assert len(result.trials) > 2
    assert sum(trial.n_evaluations for trial in result.trials[:-1]) < result.n_evaluations
    assert result.trials[-1].integral == result.integral
    errors, differences = result.plot().lines
    np.testing.assert_array_equal(errors.get_ydata(), [trial.standard_error[0] for trial in result.trials])
    np.testing.assert_array_equal(
        differences.get_ydata(), [abs(trial.integral[0] - result.integral) for trial in result.trials[:-1]]
    )


def test_a_fixed_number_of_points_is_one_trial():
    result = vq.quad(lambda x: np.stack([x[0], x[0] ** 2]), 0, 1, n_points=64, rng=1)
    (trial,) = result.trials
    assert trial.n_evaluations == 64
    np.testing.assert_array_equal(trial.integral, result.integral)
    assert len(result.plot().lines) == 4
    with pytest.raises(ValueError, match="computed from other results"):
        result.ratio(0, 1).plot()


def test_the_rule_is_shown_in_shares():
    assert _shares("order 1 in 26 of 64 strata, order 0 in 20, order 8 in 18") == {
        "order 1": 26 / 64, "order 0": 20 / 64, "order 8": 18 / 64,
    }  # fmt: skip
    assert _shares("degree 13") == {"degree 13": 1.0}
    result = vq.quad(lambda x: np.stack([np.exp(x[0]), x[0] > 0.3]), 0, 1, n_points=64, rng=1)
    bars = result.plot_rule().patches
    for component in (0, 1):
        assert sum(bar.get_width() for bar in bars if round(bar.get_y() + 0.4) == component) == pytest.approx(1)
    with pytest.raises(ValueError, match="rule of this result is not known"):
        result.ratio(0, 1).plot_rule()
