"""The program printed beside the picture gives the picture's numbers."""

import contextlib
import io

import numpy as np
import pytest
from scipy import special

import voroquad as vq
from voroquad.explore.edits import EditedSet
from voroquad.explore.experiment import Experiment
from voroquad.explore.integrands import FIRST, preset, typed
from voroquad.explore.python_code import numpy_source, python_code
from voroquad.explore.rules import method, weigh
from voroquad.integrals.expression import compile_expression


def run(code):
    """What a program prints, as rows of words."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(code, "copied", "exec"), {"__name__": "copied"})
    return [line.split() for line in printed.getvalue().splitlines()]


@pytest.mark.parametrize(
    ("problem", "rule"),
    [
        (preset(FIRST[1], 1), method("uniform", "exchange", 0)),
        (preset(FIRST[2], 2), method("stratified", "leave-one-out", 3)),
        (typed("exp(-x^2) * (0.2 < x < 0.7) + max(x, 0.5, pi/4)", 1), method("sobol", "none", 0)),
        (typed("abs(x - y) % 0.3 + 2 * (x + y <= 1)", 2), method("uniform", "equal", 0)),
        (typed("3", 2), method("uniform", "bias-function", 0)),
    ],
)
def test_estimate_of_a_drawn_set(problem, rule):
    edited = EditedSet(vq.sample(rule.design, 64, problem.integrand.d, rng=9))
    ((printed,),) = run(python_code(problem, rule, edited, 9))
    value = weigh(rule, edited) @ problem.integrand.values(edited.points)
    assert float(printed) == pytest.approx(value, rel=1e-13)


@pytest.mark.parametrize("order", ["move", "move add", "remove", "add remove", "add move remove add"])
def test_estimate_of_an_edited_set(order):
    problem, rule = typed("sin(5*x) + y", 2), method("uniform", "leave-one-out", 0)
    edited = EditedSet(vq.sample("uniform", 32, 2, rng=4))
    rng = np.random.default_rng(0)
    for edit in order.split():
        match edit:
            case "move":
                edited.move(7, rng.random(2))
                edited.move(len(edited) - 1, rng.random(2))
            case "add":
                edited.add(rng.random(2))
            case "remove":
                edited.remove(3)
    ((printed,),) = run(python_code(problem, rule, edited, 4))
    value = weigh(rule, edited) @ problem.integrand.values(edited.points)
    assert float(printed) == pytest.approx(value, rel=1e-13)


def test_statistics_of_the_histograms():
    problem = typed("x * y", 2)
    methods = [method("uniform", "none", 0), method("stratified", "equal", 0)]
    experiment = Experiment(methods, problem.integrand, n=16, seed=2)
    ticks = iter(range(100))
    experiment.run(20, clock=lambda: next(ticks))
    code = python_code(problem, methods[0], EditedSet(vq.sample("uniform", 16, 2, rng=2)), 2, experiment.histograms)
    for (name, *numbers), shown, replicates in zip(run(code)[1:], "AB", experiment.histograms, strict=True):
        errors = replicates.errors
        assert name == shown
        np.testing.assert_allclose(
            [float(x) for x in numbers], [errors.mean(), errors.std(ddof=1), (errors**2).mean()], rtol=1e-9
        )


@pytest.mark.parametrize(
    "formula",
    [
        "x1 + y",
        "2 ** -x",
        "-x ** 2",
        "(x < y) - (y < 0.5)",
        "1 < 2",
        "min(x, y, 0.3)",
        "tau * e + x",
        "x == y != 1",
        "max(x, 10**20)",
        "sin(-9**18 * 9**18)",
        "x + 99999999999999999999",
        "x ** 3 / 2 ** 2",
        "erf(x) + lgamma(y + 1) - atan2(y, x) * hypot(x, y)",
        "where(x < y, exp(x), max(x, 2, y))",
    ],
)
def test_numpy_source_means_the_same(formula):
    x, y = np.random.default_rng(3).random((2, 9))
    values = eval(numpy_source(formula), {"np": np, "special": special, "x": x, "y": y})
    np.testing.assert_allclose(values, compile_expression(formula, 2)(np.stack([x, y])), rtol=1e-13)
