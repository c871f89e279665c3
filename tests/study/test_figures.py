import itertools

import numpy as np
import pytest

from voroquad import bias_function
from voroquad.results.style import spread
from voroquad.study import figures_bias, figures_bins
from voroquad.study.figures_bias import draw_three, mean_bias, simulate_bias
from voroquad.study.figures_bias_plane import draw_bias_plane
from voroquad.study.figures_bins import StepDensity, draw_bins
from voroquad.study.figures_cells import draw_cells
from voroquad.study.functions import INTEGRANDS


@pytest.mark.statistical
def test_three_samples_stand_and_weigh_as_expected():
    rows = draw_three(np.random.default_rng(0)).rows
    assert [r["expected"] for r in rows] == [0.25, 0.5, 0.75, 0.375, 0.25, 0.375]
    for row in rows:
        assert abs(row["simulated"] - row["expected"]) < 4.8 * row["standard_error"]
    # The test has power: the weights are far from a third
    assert all(abs(r["simulated"] - 1 / 3) > 20 * r["standard_error"] for r in rows[3:])


@pytest.mark.statistical
def test_simulated_bias_function():
    edges = np.linspace(0, 1, 41)
    simulated, error = simulate_bias(30, edges, 20_000, np.random.default_rng(0))
    exact = np.array([mean_bias(30, low, high) for low, high in itertools.pairwise(edges)])
    assert np.abs((simulated - exact) / error).max() < 5.5
    assert np.abs((simulated - 1) / error).max() > 20
    assert simulated @ np.diff(edges) == pytest.approx(1)


def test_mean_bias_over_the_interval_is_one():
    assert mean_bias(30, 0, 1) == pytest.approx(1, abs=1e-9)
    assert mean_bias(30, 0.1, 0.1 + 1e-9) == pytest.approx(bias_function([0.1], 30)[0])


def test_the_cut_through_the_plane_shows_layer_and_period():
    cut = {round(row["x_1"], 6): row for row in draw_bias_plane(np.random.default_rng(0)).rows}
    assert cut[0.00025]["uniform"] < 0.65
    assert cut[0.00025]["stratified"] < 0.75
    assert cut[0.49975]["uniform"] == pytest.approx(1, abs=1e-3)
    assert cut[0.31225]["stratified"] > cut[0.37475]["stratified"] + 0.03


def test_bins_tile_the_interval_only_where_they_are_voronoi_cells(monkeypatch):
    monkeypatch.setattr(figures_bins, "REPETITIONS", 10)
    rows = draw_bins(np.random.default_rng(0)).rows
    panels = {}
    for row in rows:
        panels.setdefault(row["panel"], []).append((row["bin_low"], row["x"], row["bin_high"]))
    assert {len(bins) for bins in panels.values()} == {20}

    def tiles(bins):
        low, _, high = np.array(sorted(bins)).T
        return low[0] == pytest.approx(0) and high[-1] == pytest.approx(1) and np.allclose(low[1:], high[:-1])

    assert tiles(panels["Regular binning"])
    assert tiles(panels["Reweighted random samples"])
    assert not tiles(panels["Random samples"])
    assert not tiles(panels["Importance sampling"])
    random = np.array(panels["Random samples"])
    np.testing.assert_allclose(random[:, 2] - random[:, 0], 1 / 20)
    np.testing.assert_allclose(random[:, 1], (random[:, 0] + random[:, 2]) / 2)
    assert sorted(x for _, x, _ in panels["Reweighted random samples"]) == sorted(random[:, 1])


def test_step_density():
    density = StepDensity.like(INTEGRANDS["talk"], bins=8)
    assert density.heights.mean() == pytest.approx(1)
    x = density.warp((np.arange(80_000) + 0.5) / 80_000)
    counts, _ = np.histogram(x, bins=8, range=(0, 1))
    np.testing.assert_allclose(counts / 10_000, density.heights, atol=1e-3)
    np.testing.assert_allclose(density(np.array([0.0, 0.5, 1.0])), density.heights[[0, 4, 7]])


def test_cells_rows():
    rows = draw_cells(np.random.default_rng(0)).rows
    for design in ("uniform", "stratified"):
        assert sum(r["weight"] for r in rows if r["design"] == design) == pytest.approx(1, abs=1e-12)


def test_bias_function_drawing(monkeypatch):
    monkeypatch.setattr(figures_bias, "BIAS_SETS", 100)
    rows = figures_bias.draw_bias_function(np.random.default_rng(0)).rows
    assert {r["n"] for r in rows} == {30, 50, 100}
    assert rows[0]["g"] < 0.6


@pytest.mark.parametrize("wanted", [[0.1, 0.5, 0.9], [0.5, 0.5, 0.5], [0.9, 0.1, 0.12], [0.3]])
def test_spread_labels(wanted):
    wanted = np.array(wanted)
    places = spread(wanted, 0.1)
    assert (np.diff(np.sort(places)) > 0.1 - 1e-12).all()
    assert places.mean() == pytest.approx(wanted.mean())
    assert (np.argsort(places, kind="stable") == np.argsort(wanted, kind="stable")).all()
    if (np.diff(np.sort(wanted)) >= 0.1).all():
        np.testing.assert_allclose(places, wanted)
