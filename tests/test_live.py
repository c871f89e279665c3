"""The live figure in a browser: its numbers are Python's, and hands and keyboard move its samples."""

from __future__ import annotations

import itertools
import runpy
import shutil
from pathlib import Path

import numpy as np
import pytest

import voroquad as vq

MAKE = Path(__file__).parents[1] / "scripts" / "make_live.py"


@pytest.fixture(scope="module")
def opened(browser):
    """The figure as a file, in a window of its own; what went wrong there fails the test at its end."""
    if shutil.which("clang++-19") is None:
        pytest.skip("needs a compiler for WebAssembly: scripts/ensure-wasm.sh installs it")
    make = runpy.run_path(str(MAKE))
    make["main"]()
    wrong = []
    page = browser.new_page(viewport={"width": 1000, "height": 1100})
    page.set_default_timeout(300_000)  # machines may have other work
    page.on("console", lambda message: wrong.append(message.text))
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("request", lambda request: request.url.startswith(("file:", "data:")) or wrong.append(request.url))
    page.goto(make["PAGE"].as_uri())
    page.wait_for_selector("body[aria-busy=false]")
    yield page
    page.close()
    assert wrong == []


RULES = ("equal", "none", "bias-function", "exchange", "leave-one-out-0", "leave-one-out-1", "leave-one-out-2")


def random_states(count):
    """Rules, designs and numbers of samples in turn, at random points."""
    rng = np.random.default_rng(19)
    kinds = [
        (d, design, n, rule)
        for d, n in ((1, 5), (1, 20), (1, 100), (2, 9), (2, 36), (2, 64))
        for design in ("uniform", "stratified")
        for rule in (
            "equal",
            "none",
            "bias-function",
            "exchange",
            "leave-one-out-0",
            "leave-one-out-1",
            "leave-one-out-2",
        )
        if d == 1 or rule not in ("exchange", "leave-one-out-0")
        if design == "stratified" or rule not in ("leave-one-out-1", "leave-one-out-2")
        if n > 9 or rule != "leave-one-out-2"  # too few strata
    ]
    for d, design, n, rule in itertools.islice(itertools.cycle(kinds), count):
        points = vq.sample(design, n=n, d=d, rng=rng).points
        yield {"d": d, "design": design, "n": n, "rule": rule, "points": points.ravel().tolist()}


def expected(state):
    """Weights and G at the samples."""
    d, n, design, rule = (state[name] for name in ("d", "n", "design", "rule"))
    points = np.reshape(state["points"], (n, d))
    bias = vq.bias_function(points, n, design)
    if rule == "equal":
        return np.full(n, 1 / n), bias
    if rule == "bias-function":
        return vq.cells(points).measures / bias, bias
    debias, _, order = rule.partition("-out-")
    debias = "leave-one-out" if order else debias
    return vq.weights(points, design=design, debias=debias, order=int(order or 0)), bias


def test_values_are_those_of_python(opened):
    states = list(random_states(100))
    shown = opened.evaluate("(states) => states.map((state) => (live.set(state), live.get()))", states)
    for state, found in zip(states, shown, strict=True):
        kind = {name: state[name] for name in ("d", "design", "n", "rule")}
        assert {name: found[name] for name in kind} == kind
        weights, bias = expected(state)
        np.testing.assert_allclose(found["weights"], weights, rtol=1e-12, atol=1e-12, err_msg=str(kind))
        np.testing.assert_allclose(found["bias"], bias, rtol=1e-12, err_msg=str(kind))
        points = np.reshape(state["points"], (state["n"], state["d"]))
        assert found["estimate"] == pytest.approx(weights @ np.exp(points.sum(axis=1)), rel=1e-12)


def test_corners_are_those_of_the_cells(opened):
    state = next(s for s in random_states(100) if s["d"] == 2 and s["n"] == 36)
    found = opened.evaluate("(state) => (live.set(state), live.get())", state)
    corners = np.reshape(found["corners"], (-1, 2))
    polygons = vq.cells(np.reshape(state["points"], (36, 2))).polygons()
    for i, polygon in enumerate(polygons):
        begin, end = (int(found["offsets"][i + k]) for k in (0, 1))
        np.testing.assert_allclose(corners[begin:end], polygon, atol=1e-12)


def drawn(page):
    """What was asked for is in the picture and in the controls: the figure draws once a frame."""
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def shown(page):
    return page.locator("#chosen td").first.inner_text()


def test_a_drag_moves_the_sample_and_the_estimate(opened):
    opened.evaluate("live.set({ d: 1, n: 20, design: 'uniform', rule: 'none' }); live.fresh(2)")
    drawn(opened)
    before, points = shown(opened), opened.evaluate("live.get().points")
    box = opened.locator("#picture .dot.selected").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    width = opened.locator("#picture").bounding_box()["width"]
    opened.mouse.move(x, y)
    opened.mouse.down()
    opened.mouse.move(x + 0.05 * width, y, steps=4)
    opened.mouse.up()
    moved = np.flatnonzero(np.array(opened.evaluate("live.get().points")) != points)
    assert len(moved) == 1
    assert opened.evaluate("live.get().points")[moved[0]] == pytest.approx(
        points[moved[0]] + 0.05 * 640 / 616, abs=0.005
    )
    drawn(opened)
    assert shown(opened) != before
    assert shown(opened) in opened.locator("#spoken").text_content()


def test_the_keyboard_reaches_and_moves_everything(opened):
    opened.evaluate("live.set({ d: 2 }); live.set({ design: 'stratified', rule: 'leave-one-out-1' })")
    drawn(opened)
    reached = set()
    opened.locator("body").click(position={"x": 2, "y": 2})
    for _ in range(12):
        opened.keyboard.press("Tab")
        reached.add(opened.evaluate("document.activeElement.name || document.activeElement.id"))
    assert reached >= {"d", "n", "design", "rule", "integrand", "fresh", "sample", "x", "y", "many"}
    before = opened.evaluate("live.get().points")
    opened.get_by_label("Sample", exact=True).fill("7")
    drawn(opened)
    for axis in ("x", "y"):
        opened.get_by_label(axis, exact=True).focus()
        opened.keyboard.press("PageUp")
        drawn(opened)
    opened.keyboard.press("End")
    drawn(opened)
    moved = np.flatnonzero(np.array(opened.evaluate("live.get().points")) != before)
    assert moved.tolist() == [14, 15]
    assert opened.evaluate("live.get().points")[15] == pytest.approx(1)  # sample 7 of 8 × 8 strata: the end of the last


def test_every_choice_is_named_and_fits_the_phone(opened):
    unnamed = "[...document.querySelectorAll('select, input')].filter((e) => !e.labels.length).length"
    assert opened.evaluate(unnamed) == 0
    opened.set_viewport_size({"width": 360, "height": 700})
    assert opened.evaluate("document.documentElement.scrollWidth") <= 360
    opened.set_viewport_size({"width": 1000, "height": 1100})


def test_many_sets_show_the_bias_of_cells(opened):
    opened.evaluate("live.set({ d: 1, n: 5, design: 'uniform', integrand: 'exp(x)', rule: 'none' })")

    def mean_error():
        opened.get_by_role("button", name="Draw many sets").click()
        opened.locator("#many[aria-pressed=false]").wait_for()  # it draws 20 000 and stops
        mean, error = opened.locator("#chosen td").nth(2).inner_text().split(" ± ")
        return float(mean) / float(error)

    assert abs(mean_error()) > 10
    opened.evaluate("live.set({ rule: 'exchange' })")
    assert abs(mean_error()) < 5.5
