"""Evaluations that outlive their call: nothing is evaluated twice, and no bit changes."""

from __future__ import annotations

import functools
import random
import signal
import subprocess
import sys
import time
from collections import namedtuple
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.stats

import voroquad as vq
from voroquad.cluster.store import Store
from voroquad.integrals.kept import KeptEvaluations, KeptTrials

Pair = namedtuple("Pair", "a b")

CALLS: dict[str, dict[str, Any]] = {
    "kriging": {"n_points": 200},
    "pilot": {"method": "pilot", "n_points": 3000},
    "sets": {"method": "pilot", "n_points": 300, "n_estimates": 3, "batch": 20},
    "polynomials": {"method": "polynomials", "n_points": 512},
    "tolerance": {"rtol": 1e-2, "n_points": 64, "batch": 2},
    "adapted": {"adapt": True, "n_points": 1000},
    "workers": {"n_points": 200, "workers": map},
}


def wave(x: np.ndarray) -> dict[str, np.ndarray]:
    return {"wave": np.exp(1j * x[0] * x[1]), "moments": np.stack([x[0], x[1] ** 2])}


class Killed(Exception):
    """What ends a call in the middle."""


class Counting:
    """A func that counts its points, and fails in the call of the given number."""

    def __init__(self, func: Callable[[np.ndarray], Any], fails_at: int = 0):
        self.func, self.fails_at, self.calls, self.points = func, fails_at, 0, 0

    def __call__(self, x: np.ndarray) -> Any:
        self.calls += 1
        if self.calls == self.fails_at:
            raise Killed
        self.points += x.shape[1]
        return self.func(x)


def bits(r: vq.QuadResult) -> list[bytes]:
    return [np.asarray(part[key]).tobytes() for part in (r.integral, r.standard_error) for key in ("wave", "moments")]


@pytest.mark.parametrize("name", CALLS)
def test_a_call_that_failed_goes_on_where_it_was(tmp_path, name):
    how = {"a": [0, 0], "b": [1, 2], "rng": 5} | CALLS[name]
    alone = vq.quad(wave, **how)
    points = 0
    for fails_at in (3, 30, 7):
        func = Counting(wave, fails_at)
        with pytest.raises(Killed):
            vq.quad(func, **how, store=tmp_path / "store")
        points += func.points
        assert func.calls == fails_at
    func = Counting(wave)
    kept = vq.quad(func, **how, store=tmp_path / "store")
    assert points + func.points == kept.n_evaluations == alone.n_evaluations
    assert bits(kept) == bits(alone)
    func = Counting(wave, 1)
    assert bits(vq.quad(func, **how, store=tmp_path / "store")) == bits(alone)
    assert func.calls == 0


def test_the_store_holds_points_and_values(tmp_path):
    vq.quad(lambda x: np.stack([x[0], x[0] * x[1]]), [0, 0], [1, 2], batch=256, rng=1, store=tmp_path)
    values, about = Store(str(tmp_path)).get("batch-000003")
    assert values.shape == (4, 256)
    np.testing.assert_array_equal(values[2:], [values[0], values[0] * values[1]])
    assert about["shapes"] == [[2]]
    assert Store(str(tmp_path)).get("batch-000004") is None


def test_what_was_not_written_whole_is_evaluated_again(tmp_path):
    """A kill between the two files of a batch, and a damaged file."""
    how = {"a": 0, "b": 1, "n_points": 64, "batch": 8, "rng": 1, "store": tmp_path}
    alone = vq.quad(Counting(sine), **how)
    (tmp_path / "batch-000002/c/0/0").unlink()
    chunk = tmp_path / "batch-000005/c/0/0"
    chunk.write_bytes(chunk.read_bytes()[:-9])
    (tmp_path / "batch-000007/zarr.json").unlink()
    func = Counting(sine)
    assert vq.quad(func, **how).integral == alone.integral
    assert func.points == 24


def parts_are_not_finite(x: np.ndarray) -> np.ndarray:
    return np.where(x[0] > 0.5, complex(1, np.inf), 1)


def test_infinite_parts_come_back(tmp_path):
    for _ in range(2):
        with pytest.warns(vq.IntegrationWarning):
            r = vq.quad(parts_are_not_finite, 0, 1, rng=1, store=tmp_path)
        assert r.integral.real == 1


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"rng": 2}, r"keeps units of another run \(rng is '.*', was '.*'\)"),
        ({"n_points": 65}, r"\(n_points is '65', was '64'\)"),
        ({"b": 2}, r"\(b is '2.0', was '1.0'\)"),
        ({"batch": 9}, r"\(batch is '9', was '8'\)"),
        ({"method": "plain"}, r"\(method is \"'plain'\", was \"'auto'\"\)"),
        ({"sampler": "sobol"}, "sampler is"),
        ({"args": (3,)}, "args is"),
        ({"func": lambda x: x[0]}, r"func is '.*lambda>', was 'sine'"),
        ({"measure": vq.ProductMeasure(scipy.stats.uniform()), "a": None, "b": None}, "a is 'None'.* measure is"),
        ({"rng": None}, "store needs a seed"),
    ],
)
def test_another_call_is_refused_in_one_line(tmp_path, changed, message):
    call = {"func": sine, "a": 0, "b": 1, "n_points": 64, "batch": 8, "rng": 1, "store": tmp_path}
    vq.quad(**call)
    with pytest.raises(ValueError, match=message) as caught:
        vq.quad(**(call | changed))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "how", [{"n_points": 64}, {"method": "pilot", "n_points": 200}, {"n_points": 64, "n_estimates": 2}]
)
def test_a_tighter_tolerance_reuses_what_was_evaluated(tmp_path, how):
    """All of it are trials; the result is that of one set more. Each call still has its own bits."""
    how = {"a": [0, 0], "b": [1, 2], "rng": 5, "batch": 50, "store": tmp_path / "store"} | how
    func = Counting(wave)
    loose = vq.quad(func, rtol=3e-2, atol=1e-2, **how)
    assert func.points == loose.n_evaluations
    tight = vq.quad(func, rtol=1e-3, atol=1e-3, **how)
    assert func.points == tight.n_evaluations > loose.n_evaluations
    assert bits(tight) != bits(vq.quad(Counting(wave), rtol=1e-3, atol=1e-3, **how | {"store": tmp_path / "other"}))
    for tolerances, r in (((3e-2, 1e-2), loose), ((1e-3, 1e-3), tight)):
        assert bits(vq.quad(Counting(wave, 1), rtol=tolerances[0], atol=tolerances[1], **how)) == bits(r)
    between = vq.quad(func, rtol=1e-2, atol=1e-2, **how)
    assert func.points == between.n_evaluations > tight.n_evaluations
    with pytest.raises(
        ValueError, match=r"max_evaluations must be at least \d+ with the \d+ evaluations of sets that other calls"
    ):
        vq.quad(Counting(wave, 1), rtol=1e-3, max_evaluations=func.points, **how)


class Stopping:
    """A callback that fails once so many points are evaluated."""

    def __init__(self, n: int):
        self.n = n

    def __call__(self, progress: vq.Progress) -> None:
        if progress.n_evaluations >= self.n:
            raise Killed


def test_an_unfinished_round_of_another_call_is_passed_over(tmp_path):
    """A call that needs less of it goes on beside, and each call has its own bits whatever the other does since."""
    how = {"a": [0, 0], "b": [1, 2], "n_points": 64, "rng": 5, "batch": 50, "store": tmp_path / "one"}
    other = how | {"store": tmp_path / "other"}
    tight = {"rtol": 1e-9, "max_evaluations": 20_000}

    def stop(**call: Any) -> None:
        func = Counting(wave)
        with pytest.raises(Killed):
            vq.quad(func, **tight, **call, callback=Stopping(300))

    stop(**how)
    stop(**other)
    func = Counting(wave)
    loose = vq.quad(func, rtol=0.1, max_evaluations=200, **how)
    assert loose.success
    assert loose.n_evaluations <= 200
    assert func.points == 64  # those of the last set, not those that the round lacks
    whole, beside = vq.quad(Counting(wave), **tight, **how), vq.quad(Counting(wave), **tight, **other)
    assert bits(whole) == bits(beside)
    assert bits(vq.quad(Counting(wave, 1), rtol=0.1, max_evaluations=200, **how)) == bits(loose)
    between = vq.quad(Counting(wave), rtol=0.05, max_evaluations=200_000, **how)
    assert between.n_evaluations > whole.n_evaluations  # the round is complete now


def test_a_branch_has_other_samples_than_the_round(tmp_path):
    kept, rng, same = KeptEvaluations(Store(str(tmp_path)), {}), np.random.default_rng(1), np.random.default_rng(1)
    KeptTrials(kept, {"rtol": 2}, rng).begin(9, last=False)
    assert KeptTrials(kept, {"rtol": 1}, rng).of_others(9) == 9
    assert KeptTrials(kept, {"rtol": 1}, rng).of_others(8) is None
    assert kept.branch == "-0"
    stream = {same.random() for _ in range(100)}
    assert not stream & {rng.random() for _ in range(50)}


def test_rounds_that_do_not_fit_are_refused_before_work(tmp_path):
    how = {"a": [0, 0], "b": [1, 2], "n_points": 64, "rng": 5, "batch": 50, "store": tmp_path}
    spent = vq.quad(Counting(wave), rtol=1e-4, atol=1e-4, **how).n_evaluations
    message = f"at least {spent + 64} with the {spent} evaluations of sets that other calls began"
    with pytest.raises(ValueError, match=message):
        vq.quad(Counting(wave, 1), rtol=1e-9, max_evaluations=spent + 63, **how)
    with pytest.warns(vq.IntegrationWarning):
        r = vq.quad(Counting(wave), rtol=1e-9, max_evaluations=spent + 64, **how)
    assert r.n_evaluations == spent + 64


@pytest.mark.parametrize("fails_at", [2, 4])
def test_a_refining_call_that_failed_goes_on(tmp_path, fails_at):
    how = {"a": [0, 0], "b": [1, 2], "n_points": 64, "rng": 5, "batch": 50}

    def refined(store: str, fails: int) -> vq.QuadResult:
        path = tmp_path / store
        vq.quad(Counting(wave), rtol=3e-2, atol=1e-2, **how, store=path)
        if fails:
            with pytest.raises(Killed):
                vq.quad(Counting(wave, fails), rtol=1e-9, atol=1e-9, max_evaluations=5000, **how, store=path)
        return vq.quad(Counting(wave), rtol=1e-9, atol=1e-9, max_evaluations=5000, **how, store=path)

    assert bits(refined("one", 0)) == bits(refined("two", fails_at))


@pytest.mark.parametrize(
    ("refused", "error"),
    [
        ({"method": "pilot", "n_points": 3}, ValueError),
        ({"method": "nonsense"}, ValueError),
        ({"workers": 2, "func": lambda x: x[0]}, ValueError),
        ({"func": 3}, TypeError),
        ({"adapt": True, "n_points": 10}, ValueError),
    ],
)
def test_a_call_that_is_refused_leaves_no_trace(tmp_path, refused, error):
    """The store belongs to the first call that evaluates func, not to one with a wrong argument."""
    call = {"func": sine, "a": 0, "b": 1, "n_points": 64, "rng": 1, "store": tmp_path / "store"}
    with pytest.raises(error):
        vq.quad(**(call | refused))
    assert not (tmp_path / "store").exists()
    vq.quad(**call)
    assert (tmp_path / "store/batch-000000").exists()


def sine(x: np.ndarray, k: float = 1) -> np.ndarray:
    return np.sin(k * x[0])


@pytest.mark.parametrize("bound", [{"k": 3}, {"k": np.arange(20)}])
def test_partials_with_other_parameters_are_other_functions(tmp_path, bound):
    call = {"a": 0, "b": 1, "n_points": 64, "rng": 1, "store": tmp_path}
    vq.quad(functools.partial(sine, k=2), **call)
    with pytest.raises(ValueError, match=r"func is 'sine\(k=.*\)', was 'sine\(k=2\)'"):
        vq.quad(functools.partial(sine, **bound), **call)
    vq.quad(functools.partial(sine, k=2), **call)


def test_limits_are_known_by_their_values(tmp_path):
    func = Counting(sine)
    limits = [(0, 1), (0.0, np.float64(1)), (np.int64(0), np.float64(1.0))]
    for a, b in limits:
        vq.quad(func, a, b, n_points=64, rng=1, scale=b, store=tmp_path / "one")
    assert func.points == 64
    for zero in ([0] * 20, np.zeros(20), [0.0] * 20):
        vq.quad(func, zero, np.ones(20), n_points=64, rng=1, store=tmp_path / "many")
    assert func.points == 128
    with pytest.raises(ValueError, match="keeps units of another run"):
        vq.quad(func, zero, np.full(20, 2), n_points=64, rng=1, store=tmp_path / "many")


RESUMED = """
import sys
import scipy.stats, voroquad as vq

def cube(x):
    raise RuntimeError("called")

m = vq.ProductMeasure(scipy.stats.Normal(mu=1.0, sigma=2.0), scipy.stats.norm(1, 2))
print(vq.quad(cube, measure=m, n_points=64, rng=1, store=sys.argv[1]).integral.hex())
"""


def cube(x: np.ndarray) -> np.ndarray:
    return x[0] ** 3


def test_another_process_knows_a_measure(tmp_path):
    """Also when the distributions were used before, and keep what they computed; others are refused."""
    m = vq.ProductMeasure(scipy.stats.Normal(mu=1.0, sigma=2.0), scipy.stats.norm(1, 2))
    how = {"n_points": 64, "rng": 1, "store": tmp_path}
    first = vq.quad(cube, measure=m, **how).integral
    assert vq.quad(cube, measure=m, **how).integral == first
    again = subprocess.run([sys.executable, "-c", RESUMED, str(tmp_path)], capture_output=True, text=True, check=True)
    assert again.stdout.strip() == first.hex()
    other = vq.ProductMeasure(scipy.stats.Normal(mu=1.0, sigma=2.0), scipy.stats.norm(1, 2.5))
    with pytest.raises(ValueError, match="measure is"):
        vq.quad(cube, measure=other, **how)


def test_values_of_a_wrong_shape_are_not_kept(tmp_path):
    how = {"a": [0, 0], "b": [1, 1], "n_points": 64, "rng": 1, "store": tmp_path}
    with pytest.raises(ValueError, match=r"func must return shape \(1,\) or .*, got \(\)"):
        vq.quad(lambda x: x.sum(), **how)
    assert Store(str(tmp_path)).get("batch-000000") is None
    vq.quad(lambda x: x.sum(axis=0), **how)


def test_other_points_are_refused(tmp_path):
    """Whatever the settings say, the points of a batch are compared."""
    vq.quad(sine, 0, 1, n_points=64, rng=1, store=tmp_path / "one")
    vq.quad(sine, 0, 1, n_points=64, rng=2, store=tmp_path / "two")
    (tmp_path / "one/batch-000003").rename(tmp_path / "old")
    (tmp_path / "two/batch-000003").rename(tmp_path / "one/batch-000003")
    with pytest.raises(ValueError, match=r"keeps evaluations at other points .* \(batch 3\); name another store"):
        vq.quad(sine, 0, 1, n_points=64, rng=1, store=tmp_path / "one")


def test_structures_that_json_does_not_give_back_are_refused(tmp_path):
    with pytest.raises(ValueError, match=r"func returned a Pair with the keys 0, 1; return a dict"):
        vq.quad(lambda x: Pair(x[0], x[0]), 0, 1, rng=1, store=tmp_path)


def test_any_path_of_fsspec(tmp_path):
    url = f"file://{tmp_path}/store"
    func = Counting(sine)
    for _ in range(2):
        vq.quad(func, 0, 1, n_points=64, rng=1, store=url)
    assert func.points == 64


SCRIPT = """
import os, sys, time
import numpy as np, voroquad as vq

log = os.open(sys.argv[2], os.O_WRONLY | os.O_CREAT | os.O_APPEND)

def f(x):
    time.sleep(0.03)
    os.write(log, b"%d\\n" % x.shape[1])
    return np.exp(x[0]) * (x.sum(axis=0) < 1)

r = vq.quad(f, [0, 0], [1, 1], n_points=2000, method="pilot", batch=20, rng=3, store=sys.argv[1] or None)
print(r.integral.hex(), r.standard_error.hex(), r.n_evaluations)
"""


@pytest.mark.slow
def test_ten_kills_at_random_moments(tmp_path):
    def started(store: str, log: str) -> subprocess.Popen[str]:
        arguments = [sys.executable, "-c", SCRIPT, store, str(tmp_path / log)]
        return subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True)

    alone, _ = started("", "log-alone").communicate()
    rng, kept, kills = random.Random(1), 0, 0
    begin = time.monotonic()
    started(str(tmp_path / "warm"), "log-warm").communicate()
    usual = time.monotonic() - begin
    store = tmp_path / "store"
    while kills < 10:
        run = started(str(store), "log")
        time.sleep(rng.uniform(0.3, 0.6) * usual)
        run.send_signal(signal.SIGKILL)
        kills += run.wait() == -signal.SIGKILL
        assert kills, "the run ended before it could be killed"
        kept = max(kept, len(list(store.glob("batch-*"))))
        if run.returncode == 0:
            store.rename(tmp_path / f"done-{kills}")
    assert kept > 10
    out, _ = started(str(store), "log").communicate()
    assert out == alone
    batches = int(out.split()[2]) / 20
    runs = 1 + len(list(tmp_path.glob("done-*")))
    assert len((tmp_path / "log").read_text().splitlines()) <= runs * batches + kills + 1
