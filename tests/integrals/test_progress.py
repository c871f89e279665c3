"""Calls that are watched, stopped and interrupted: what is known then is right, and what they return is not changed."""

from __future__ import annotations

import itertools
import math
import os
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.stats

import voroquad as vq
from voroquad.designs.sampling import sample
from voroquad.integrals import pilot
from voroquad.integrals.estimates import PlainMean
from voroquad.integrals.evaluation import Function
from voroquad.integrals.integrand import Integrand
from voroquad.integrals.library import Library
from voroquad.integrals.progress import Stop
from voroquad.integrals.regions import Box
from voroquad.integrals.watch import Watch

LIBRARY = Library.of(0, 1)


def edge(x: np.ndarray) -> np.ndarray:
    """Large in a corner: not alike from stratum to stratum."""
    return np.exp(3 * x[0]) * (x.sum(axis=0) < 0.8)


def interrupt_at(call: int, func: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray], np.ndarray]:
    """func, with a Ctrl-C in the given one of its calls."""
    calls = []

    def interrupting(x: np.ndarray) -> np.ndarray:
        calls.append(x)
        if len(calls) == call:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(1)
        return func(x)

    return interrupting


# --- Ctrl-C


def test_ctrl_c_ends_with_the_mean_of_the_evaluations_so_far():
    seen: list[np.ndarray] = []

    def func(x: np.ndarray) -> np.ndarray:
        if len(seen) == 5:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(1)
        seen.append(edge(x))
        return seen[-1]

    with pytest.raises(KeyboardInterrupt, match="after 500 evaluations, the estimate so far is ") as caught:
        vq.quad(func, [0, 0], [1, 1], batch=100, rng=1)
    assert isinstance(caught.value, vq.IntegrationInterrupted)
    result, values = caught.value.result, np.concatenate(seen)
    assert caught.value.n_evaluations == result.n_evaluations == len(values) == 500
    assert result.integral == pytest.approx(values.mean(), rel=1e-14)
    assert result.standard_error == pytest.approx(values.std(ddof=1) / math.sqrt(500), rel=1e-14)
    assert [w.kind for w in result.warnings] == ["stopped"]
    assert not result.success


def test_nothing_is_known_of_a_single_call():
    with pytest.raises(vq.IntegrationInterrupted, match="after 0 evaluations, nothing is known yet") as caught:
        vq.quad(interrupt_at(1, edge), [0, 0], [1, 1], rng=1)
    assert caught.value.result is None


def test_a_func_of_one_point_can_be_interrupted():
    with pytest.raises(vq.IntegrationInterrupted) as caught:
        vq.quad(interrupt_at(600, edge), [0, 0], [1, 1], vectorized=False, rng=1)
    assert caught.value.result.n_evaluations == 592  # batches of 16


def test_finished_rounds_and_sets_are_what_is_known():
    with pytest.raises(vq.IntegrationInterrupted) as caught:
        vq.quad(interrupt_at(3, edge), [0, 0], [1, 1], rtol=1e-6, rng=1)
    assert caught.value.result.warnings[-1].details["rests_on"] == 1024
    each = 65536
    with pytest.raises(vq.IntegrationInterrupted) as caught:
        vq.quad(interrupt_at(80, edge), [0, 0], [1, 1], n_points=each, n_estimates=4, method="pilot", rng=1)
    whole = vq.quad(edge, [0, 0], [1, 1], n_points=each, n_estimates=3, method="pilot", rng=1)
    assert caught.value.result.integral == whole.integral


def test_of_several_pieces_only_the_evaluations_are_known():
    pieces = vq.PiecewiseUniform.from_boxes([[0, 0], [1, 0]], [[1, 1], [2, 1]], [100, 100])
    with pytest.raises(vq.IntegrationInterrupted, match="after 150 evaluations") as caught:
        vq.quad(interrupt_at(4, edge), measure=pieces, n_points=200, batch=50, rng=1)
    assert caught.value.result is None


@pytest.mark.slow
def test_the_command_line_prints_what_is_known(tmp_path):
    formula, limits = "exp(3*x)*(x+y<0.8)", "0:1,0:1"
    command = [sys.executable, "-m", "voroquad", "integrate", formula, "--bounds", limits, "--seed", "1", "--rtol",
               "1e-12", "--max-evaluations", "10000000000"]  # fmt: skip
    run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path)
    time.sleep(6)
    run.send_signal(signal.SIGINT)
    out, said = run.communicate(timeout=60)
    assert run.returncode == 130
    assert abs(float(out.split("(")[0]) - 0.847) < 0.01
    assert "stopped before its end" in said


# --- callbacks and bars

CALLS: dict[str, dict[str, Any]] = {
    "kriging": {"n_points": 200},
    "local": {"method": "local", "n_points": 200},
    "sobol": {"sampler": "sobol", "n_points": 256},
    "pilot": {"method": "pilot", "n_points": 9000},
    "sets": {"method": "pilot", "n_points": 3000, "n_estimates": 3},
    "polynomials": {"method": "polynomials", "n_points": 2048},
    "tolerance": {"rtol": 1e-3, "n_points": 64},
    "adapted": {"adapt": True, "n_points": 12_000},
}


@pytest.mark.parametrize("name", CALLS)
def test_watching_changes_no_bit_and_ends_with_the_result(name):
    seen: list[vq.Progress] = []
    how = {"a": [0, 0], "b": [1, 1], "rng": 3} | CALLS[name]
    alone, watched = vq.quad(edge, **how), vq.quad(edge, **how, callback=seen.append)
    assert watched.integral == alone.integral == seen[-1].integral
    assert watched.standard_error == alone.standard_error == seen[-1].standard_error
    assert watched.n_evaluations == seen[-1].n_evaluations
    counts = [p.n_evaluations for p in seen]
    assert counts == sorted(counts)
    assert len(set(counts)) > 30
    assert counts[-1] <= seen[0].most == seen[-1].most
    known = [p for p in seen[:-1] if p.integral is not None]
    assert len(known) > 2
    assert abs(known[-1].integral - alone.integral) < 8 * (known[-1].standard_error + alone.standard_error)


@pytest.mark.parametrize("name", CALLS)
def test_a_callback_that_returns_true_ends_the_call(name):
    how = {"a": [0, 0], "b": [1, 1], "rng": 3} | CALLS[name]
    total = vq.quad(edge, **how).n_evaluations
    asked = []

    def enough(p: vq.Progress) -> bool:
        asked.append(p)
        return p.n_evaluations >= 0.7 * total and p.integral is not None

    r = vq.quad(edge, **how, callback=enough)
    assert 0.7 * total <= r.n_evaluations < total
    assert r.integral == asked[-1].integral
    assert [w.kind for w in r.warnings][-1] == "stopped"


def test_stop_iteration_ends_and_a_number_does_not():
    def stop(p: vq.Progress) -> None:
        raise StopIteration

    r = vq.quad(
        lambda x: {"a": edge(x), "b": 1j * x[0]}, [0, 0], [1, 1], method="pilot", batch=10, rng=1, callback=stop
    )
    assert r.n_evaluations == 10
    assert np.isnan(r.integral["a"])
    assert np.isnan(r.integral["b"].imag)
    assert vq.quad(edge, [0, 0], [1, 1], rng=1, callback=lambda p: p.n_evaluations).n_evaluations == 1024


def test_a_callback_must_be_callable():
    with pytest.raises(TypeError, match=r"callback must be callable, as lambda p: .*, got True"):
        vq.quad(edge, [0, 0], [1, 1], callback=True)


def test_a_bar_shows_the_estimate_so_far(capsys):
    r = vq.quad(lambda x: 1 + 0 * x[0], [0, 0], [1, 1], progress=True, rng=1)
    said = capsys.readouterr().err
    assert "1024/1024" in said
    assert str(r)[:6] in said


# --- what is known has no bias


def stopped_early(in_random_order: bool, repetitions: int) -> np.ndarray:
    """Means of the first 5 of 16 evaluations at stratified points."""
    integrand = Integrand(Function(edge, LIBRARY, batch=lambda n: 5), Box([0, 0], [1, 1], LIBRARY), Watch())

    def stop() -> None:
        raise Stop

    integrand.watch.listeners.append(stop)
    found = []
    for drawn in sample("stratified", 16, 2, sets=repetitions, rng=5).points:
        done: list[np.ndarray] = []
        with pytest.raises(Stop):
            integrand.in_random_order(drawn, done) if in_random_order else integrand._evaluated(
                integrand.pull_back(drawn.T), done
            )
        found.append(PlainMean(done).estimate().mean[0])
    return np.array(found)


EDGE = float((np.exp(2.4) - 1 - 2.4) / 9)


@pytest.mark.statistical
def test_means_of_the_first_evaluations_are_unbiased(z_score):
    assert abs(z_score(stopped_early(True, 4000), EDGE)) < 4.5
    assert abs(z_score(stopped_early(False, 400), EDGE)) > 10


class GivenOrder:
    """A generator whose permutation is given."""

    def __init__(self, order: tuple[int, ...]):
        self.order = order
        self.integers = np.random.default_rng(1).integers

    def permutation(self, n: int) -> tuple[int, ...]:
        assert n == len(self.order)
        return self.order


def test_parts_of_the_pilot_rule_are_a_fair_sample_of_all(monkeypatch):
    """Over all orders of the parts the mean of what two of them tell is the estimate, and the errors are right."""
    monkeypatch.setattr(pilot, "FEWEST_OF_A_PART", 60)
    known = []
    for order in itertools.permutations(range(4)):
        integrand = Integrand(Function(edge, LIBRARY), Box([0, 0], [1, 1], LIBRARY), Watch())
        run = pilot.PilotRun(integrand, 8, GivenOrder(order), 1)
        run.evaluate_grid()
        integrand.watch.listeners.append(lambda run=run: len(run.steps) == 2 and known.append(run.known()))
        whole = run.estimates(270, 1)
    mean, error = (np.array([getattr(k, name)[0] for k in known]) for name in ("mean", "error"))
    within = float(np.ldexp(run.rule.square[0] / run.cells**2, 2 * run.power[0]))
    assert len(known) == 24
    assert mean.mean() == pytest.approx(whole.mean[0], rel=1e-12)
    assert mean.std() > 1e-3
    assert np.square(error).mean() == pytest.approx(mean.var() + within, rel=1e-9)


def test_intervals_of_stopped_calls_hold_the_integral():
    held = 0
    for seed in range(100):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            r = vq.quad(edge, [0, 0], [1, 1], n_points=256, rng=seed, callback=lambda p: p.n_evaluations >= 128)
        low, high = r.confidence_interval(0.95)
        held += low <= EDGE <= high
    assert scipy.stats.binom.cdf(held, 100, 0.93) > 1e-5
