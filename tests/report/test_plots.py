"""Plots from a figure's numbers: what they draw, the slopes beside them, numbers that do not fit."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from voroquad.report.plots import fit_from, make_plots
from voroquad.results.manifest import Figure, Line, Plot
from voroquad.study.convergence import METHODS_1D, Measurement, fit_slope

HEADER = ["method", "n", "mse", "mse_error", "bias"]


def make(path, rows, **plot):
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([HEADER, *rows])
    lines = {"a": Line("#123456", "dotted", "diamond"), "bare": Line("#654321")}
    spec = Figure("f.png", "", "", csv=path.name, plots=[Plot("n", **plot, x_label="N", y_label="y")], lines=lines)
    return make_plots(spec, path)


def drawn(plots, name):
    """The points of a renderer of the first plot."""
    renderer = next(r for r in plots.models[0].renderers if r.name == name)
    return renderer.data_source.data


def test_points_in_order_and_their_error_bars(tmp_path):
    plots = make(tmp_path / "f.csv", [["a", 64, 1e-4, 1e-5, 0], ["a", 8, 1e-2, 2e-2, 0]], y="mse", error="mse_error")
    data = drawn(plots, "line-0")
    np.testing.assert_array_equal(data["x"], [8, 64])
    np.testing.assert_array_equal(data["y"], [1e-2, 1e-4])
    np.testing.assert_allclose(data["low"], [1e-2, 0.9e-4])  # a bar that reaches zero has no lower end
    np.testing.assert_allclose(data["high"], [3e-2, 1.1e-4])
    assert data["y_text"] == ["0.01 ± 0.02", "0.0001 ± 1e-05"]
    assert plots.series[0].line == Line("#123456", "dotted", "diamond")


def test_signs_are_dropped_and_zeros_left_out(tmp_path):
    plots = make(tmp_path / "f.csv", [["a", 8, 1, 0, -0.5], ["a", 16, 1, 0, 0], ["b", 8, 1, 0, 0]], y="bias")
    np.testing.assert_array_equal(drawn(plots, "line-0")["y"], [0.5])
    assert len(drawn(plots, "line-1")["y"]) == 0
    assert plots.fitted == []
    assert plots.series[1].line.color != plots.series[0].line.color


def test_what_was_not_measured_is_left_out(tmp_path):
    rows = [["a", 8, 1, "", 0], ["a", 16, "", "", 0], ["a", 32, 0.5, 0.1, 0]]
    data = drawn(make(tmp_path / "f.csv", rows, y="mse", error="mse_error"), "line-0")
    np.testing.assert_array_equal(data["x"], [8, 32])
    np.testing.assert_allclose(data["high"], [1, 0.6])


def test_a_line_of_one_point_is_seen(tmp_path):
    for rows, opacity in (([["bare", 8, 1, 0, 0]], 1), ([["bare", 8, 1, 0, 0], ["bare", 16, 1, 0, 0]], 0)):
        (plot,) = make(tmp_path / "f.csv", rows, y="mse").models
        points = plot.renderers[-1].glyph
        assert (points.line_alpha, points.fill_alpha, bool(points.tags)) == (opacity, opacity, not opacity)


@pytest.mark.parametrize("last", [0.3, 1e-6], ids=["few decades", "many decades"])
def test_ticks_are_round_and_told_apart(tmp_path, last):
    (plot,) = make(tmp_path / "f.csv", [["a", 8, 2, 0, 0], ["a", 16, last, 0, 0]], y="mse").models
    labels = plot.yaxis[0].major_label_overrides
    if last < 0.1:
        assert not labels  # Bokeh's powers of ten
    else:
        assert {0.2: "2·10⁻¹", 0.5: "5·10⁻¹", 1.0: "1·10⁰", 2.0: "2·10⁰"}.items() <= labels.items()
        assert sorted(labels) == plot.yaxis[0].ticker.ticks


def test_rows_can_be_chosen(tmp_path):
    rows = [["a", 8, 1, 0, 1], ["a", 16, 0.5, 0, 2], ["b", 8, 3, 0, 1]]
    plots = make(tmp_path / "f.csv", rows, y="mse", where={"bias": "1"})
    assert [list(drawn(plots, f"line-{k}")["y"]) for k in range(2)] == [[1], [3]]


def test_slopes_are_those_of_the_study(tmp_path):
    """The same fit to the same numbers, over n ≥ 64 or the last three sizes."""
    rng = np.random.default_rng(2)
    for sizes in ([8, 16, 32, 64, 128, 256], [8, 16, 32, 64]):
        mse = [n**-2.5 * (1 + 0.3 * rng.random()) for n in sizes]
        rows = [["a", n, m, 0, 0] for n, m in zip(sizes, mse, strict=True)]
        plots = make(tmp_path / "f.csv", rows, y="mse", slope_from=64)
        lines = [Measurement("f", METHODS_1D[0], n, 2, m, 0.0, 0.0, 0.0) for n, m in zip(sizes, mse, strict=True)]
        assert plots.series[0].slopes == [pytest.approx(fit_slope(lines).value)]
        fit = next(r for r in plots.models[0].renderers if r.name == "fit-0")
        assert list(fit.data_source.data["x"]) == [max(64, sizes[0]) if sizes[-1] == 256 else 16, sizes[-1]]
        assert not fit.visible


def test_one_point_has_no_slope():
    assert fit_from(np.array([8.0]), np.array([1.0]), 0) is None
    assert fit_from(np.array([]), np.array([]), 0) is None
    assert fit_from(np.array([8.0, 16.0]), np.array([1.0, 0.5]), 0).slope == pytest.approx(-1)


@pytest.mark.parametrize("plot", [{"y": "none"}, {"y": "method"}, {"y": "mse", "error": "none"}])
def test_numbers_that_do_not_fit(tmp_path, plot):
    with pytest.raises(ValueError, match=r"f\.csv does not hold what the figure plots .*make it again"):
        make(tmp_path / "f.csv", [["a", 8, 1, 0, 0]], **plot)
