"""The page's models and what changes them, without a browser."""

import re

import numpy as np
import pytest
from bokeh.document import Document
from bokeh.events import Pan, PanEnd, PanStart, Tap
from cpu_time import cpu_time

import voroquad as vq
from voroquad.explore.explorer import Explorer


@pytest.fixture
def explorer():
    return Explorer(Document())


def estimate(explorer):
    return float(re.search(r'data-estimate="([^"]+)"', explorer.readings.estimate.text)[1])


def two_dimensions(explorer, n=64, design="uniform", weights="none"):
    explorer.problem_controls.dimension.active = 1
    explorer.rules[0].design.value = design
    explorer.rules[0].weights.value = weights
    explorer.problem_controls.n.value = n


def test_first_estimate_is_the_cores(explorer):
    points = vq.sample("uniform", 20, 1, rng=1).points
    assert estimate(explorer) == pytest.approx(vq.weights(points) @ explorer.problem.integrand.values(points))


def test_choices_that_do_not_exist_are_not_offered(explorer):
    rule = explorer.rules[0]
    assert "exchange" in dict(rule.weights.options)
    rule.weights.value = "exchange"
    explorer.problem_controls.dimension.active = 1
    assert "exchange" not in dict(rule.weights.options)
    assert rule.weights.value == "none"
    rule.design.value = "stratified"
    rule.weights.value = "leave-one-out"
    rule.order.value = "4"
    assert rule.method.order == 4
    rule.design.value = "uniform"
    assert rule.order.options == ["0", "1", "2", "3"]
    assert rule.method.order == 0
    assert explorer.readings.message.text == ""


@pytest.mark.parametrize("d", [1, 2])
def test_every_choice_gives_an_estimate(explorer, d):
    explorer.problem_controls.dimension.active = d - 1
    explorer.problem_controls.n.value = 16
    rule = explorer.rules[0]
    for design, _ in rule.design.options:
        rule.design.value = design
        for weights, _ in rule.weights.options:
            rule.weights.value = weights
            assert explorer.readings.message.text == ""
            assert np.isfinite(estimate(explorer))


def test_a_formula_and_a_bad_one(explorer):
    explorer.problem_controls.formula.value = "exp(x)"
    assert explorer.problem_controls.integrand.value == "formula"
    assert explorer.problem.integrand.integral == pytest.approx(np.e - 1)
    before = estimate(explorer)
    explorer.problem_controls.formula.value = "exp(z)"
    assert "unknown name &#x27;z&#x27;; there are x1, x, pi" in explorer.readings.message.text
    assert estimate(explorer) == before
    explorer.problem_controls.formula.value = "<script>alert(1)</script>"
    assert "<script" not in explorer.readings.message.text
    explorer.problem_controls.formula.value = "x"
    assert explorer.readings.message.text == ""


def test_a_bad_number_of_samples(explorer):
    for n in (None, 0, 2.5, 10**9):
        explorer.problem_controls.n.value = n
        assert "N must be a whole number from 1 to 4096" in explorer.readings.message.text


def test_a_number_of_samples_without_strata(explorer):
    two_dimensions(explorer, design="stratified")
    explorer.problem_controls.n.value = 7
    assert "the nearest that do are n = 6 and n = 8" in explorer.readings.message.text
    explorer.problem_controls.n.value = 8
    assert explorer.readings.message.text == ""
    explorer.rules[1].design.value = "stratified"
    explorer.rules[0].design.value = "uniform"
    explorer.problem_controls.n.value = 7  # rule A has such sets, rule B has not
    assert "the nearest that do are" in explorer.readings.message.text
    assert explorer.experiment is None
    explorer.problem_controls.dimension.active = 0
    assert explorer.readings.message.text == ""


def drag(explorer, start, end):
    figure = explorer.editing.figures[explorer.d - 1]
    for kind, place in ((PanStart, start), (Pan, end), (PanEnd, end)):
        figure._trigger_event(kind(figure, x=float(place[0]), y=float(place[-1])))


@pytest.mark.parametrize("weights", ["none", "leave-one-out"])
def test_a_drag_gives_the_cores_estimate(explorer, weights):
    two_dimensions(explorer, weights=weights)
    points = explorer.drawn.points.copy()
    before = estimate(explorer)
    points[5] = [0.9, 0.1]
    drag(explorer, explorer.drawn.points[5], points[5])
    w = vq.weights(points, debias=weights, design="uniform")
    assert estimate(explorer) == pytest.approx(w @ explorer.problem.integrand.values(points), rel=1e-12)
    assert estimate(explorer) != before
    np.testing.assert_allclose([share for *_, share in drawn(explorer)], 64 * w)


def drawn(explorer):
    """Each sample as (point, corners, share): of those drawn above, and where there is none, of those below."""
    picture, rows = explorer.cells[2], {}
    for source in (picture._below, picture._above):
        columns = (source.data[name] for name in ("sample", "x", "y", "xs", "ys", "share"))
        for k, x, y, xs, ys, share in zip(*columns, strict=True):
            if xs:
                rows[k] = [x, y], np.column_stack([xs, ys]), share
            else:  # a point that reaches into a cell above: drawn again as it is
                assert (rows[k][0], rows[k][2]) == ([x, y], share)
    return [rows[k] for k in range(len(rows))]


@pytest.mark.parametrize("n", [64, 1000])
def test_patches_are_the_cells_after_many_drags(explorer, n):
    two_dimensions(explorer, n=n)
    rng = np.random.default_rng(1)
    above = []
    for _ in range(20):
        drag(explorer, explorer.editing.edited.points[rng.integers(n)].copy(), rng.random(2))
        above.append(len(explorer.cells[2]._above.data["sample"]))
    points = explorer.editing.edited.points
    for (point, corners, _), expected, polygon in zip(
        drawn(explorer), points, vq.cells(points).polygons(), strict=True
    ):
        np.testing.assert_array_equal(point, expected)
        np.testing.assert_array_equal(corners, polygon)
    if n == 1000:
        assert min(above[:3]) > 5
        assert max(above) < 250


def test_a_sample_out_of_its_stratum(explorer):
    two_dimensions(explorer, design="stratified", weights="leave-one-out")
    drag(explorer, explorer.drawn.points[0], [0.99, 0.99])
    assert "each of the 8 × 8 strata must hold one point" in explorer.readings.message.text
    assert np.isnan(estimate(explorer))
    explorer.rules[0].weights.value = "none"
    assert explorer.readings.message.text == ""


def test_add_and_remove_by_pointer_and_keyboard(explorer):
    two_dimensions(explorer)
    editing, figure = explorer.editing, explorer.editing.figures[1]
    editing.controls.mode.active = 1
    figure._trigger_event(Tap(figure, x=0.31, y=0.62))
    assert len(editing.edited) == 65
    assert editing.controls.index.value == 64
    assert [field.value for field in editing.controls.place] == [0.31, 0.62]
    editing.controls.mode.active = 2
    figure._trigger_event(Tap(figure, x=0.31, y=0.62))
    assert not editing.edited.edited
    editing.controls.index.value = 3
    editing.controls.place[0].value = 0.25
    assert editing.edited.points[3, 0] == 0.25
    assert "points[[3]] = " in explorer.readings.code.text


def test_a_tap_outside_the_box_adds_nothing(explorer):
    two_dimensions(explorer)
    explorer.editing.controls.mode.active = 1
    figure = explorer.editing.figures[1]
    figure._trigger_event(Tap(figure, x=1.2, y=0.5))
    figure._trigger_event(Tap(figure, x=0.2, y=-0.1))
    assert not explorer.editing.edited.edited


def test_histograms_and_mse_fill(explorer):
    explorer.experiment.run(0.3)
    explorer._show_experiment(explorer.experiment)
    counts = [source.data["count"].sum() for source in explorer.histograms._sources]
    assert min(counts) > 0
    assert "mean squared error" in explorer.readings.statistics.text
    stale = explorer.experiment
    explorer.rules[1].weights.value = "exchange"
    text = explorer.readings.statistics.text
    explorer._show_experiment(stale)
    assert explorer.readings.statistics.text == text


def test_bias_function_of_the_design(explorer):
    explorer._show_bias()
    curve = explorer.bias[1]._curve.data
    np.testing.assert_allclose(curve["g"], vq.bias_function(curve["x"], n=20))
    explorer.rules[0].design.value = "sobol"
    explorer._show_bias()
    assert "not for sobol sets" in explorer.readings.bias.text


def test_a_drag_among_a_thousand_is_quick(explorer):
    """The server's part, in processor time; benchmarks/explorer_drag.py measures all of it."""
    two_dimensions(explorer, n=1000)
    with cpu_time() as seconds:
        for k in range(20):
            drag(explorer, explorer.editing.edited.points[k], np.array([0.5, 0.5]) + k / 50)
    assert seconds() / 40 < 0.05  # two answers to each
