"""The pilot rule: its numbers one by one, no bias, and what goes with it."""

from __future__ import annotations

import math
import subprocess
import sys
import time
import warnings
from collections.abc import Callable

import numpy as np
import pytest
from pilot_reference import keys_of, pilot, rough

import voroquad as vq
from voroquad.integrals.evaluation import Function
from voroquad.integrals.integrand import Integrand
from voroquad.integrals.library import Library
from voroquad.integrals.pilot import PilotRun, grid_side
from voroquad.integrals.pilot_error import variance
from voroquad.integrals.regions import Box
from voroquad.study.genz import instances


@pytest.mark.parametrize(("d", "n"), [(1, 16), (1, 64), (1, 150), (2, 60), (2, 700), (3, 16), (3, 120), (3, 1400)])
def test_every_number_is_that_of_the_definition(d, n):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", vq.IntegrationWarning)
        r = vq.quad(rough, np.zeros(d), np.ones(d), n_points=n, method="pilot", rng=5)
    estimate, (squares, fourths), evaluations = pilot(rough, n, d, keys_of(5, d))
    of_sum, freedom = variance(squares[None], fourths[None])
    assert r.n_evaluations == evaluations <= n
    assert r.integral == pytest.approx(estimate, rel=1e-12)
    assert r.standard_error == pytest.approx(math.sqrt(of_sum[0]) / grid_side(n, d) ** d, rel=1e-6)
    assert r.degrees_of_freedom == pytest.approx(freedom[0], rel=1e-6)


@pytest.mark.parametrize("n", [6000, 8192, 12_000])
def test_no_stencil_at_an_edge_extrapolates_a_cusp_at_the_centre(n):
    """One that does is off by up to 170. The integral is that over pyramids with the cusp at their tip."""
    t, w = np.polynomial.legendre.leggauss(24)
    u, v, z = np.meshgrid(*[(1 + t) / 2] * 3)
    weights = np.prod(np.meshgrid(*[w / 2] * 3), axis=0)
    exact = 24 * (weights * u**2 * np.exp(-5 * u * np.sqrt(1 + v**2 + z**2))).sum()
    r = vq.quad(lambda x: np.exp(-5 * np.linalg.norm(x, axis=0)), [-1] * 3, [1] * 3, n_points=n, method="pilot", rng=1)
    assert abs(r.integral - exact) < 5 * r.standard_error
    assert r.standard_error < 2e-3 * exact


@pytest.mark.parametrize("n", [8000, 12_000])
def test_no_stencil_in_a_corner_extrapolates_a_singularity_at_the_centre(n):
    """Only the product of the errors along all three axes shows that it does."""
    found = [vq.quad(lambda x: 1 / np.linalg.norm(x, axis=0), vq.Ball(), n_points=n, rng=seed) for seed in range(3)]
    assert max(abs(r.integral - 2 * math.pi) / r.standard_error for r in found) < 5
    assert max(r.standard_error for r in found) < 0.02


@pytest.mark.parametrize(("d", "n", "degree"), [(1, 64, 9), (2, 1024, 9), (3, 4096, 7)])
def test_polynomials_are_exact(d, n, degree):
    powers = [[degree] * d, [degree - 1, *[1] * (d - 1)], [0] * d]
    r = vq.quad(lambda x: np.stack([np.prod(x.T**p, axis=1) for p in powers]), np.zeros(d), np.ones(d), n_points=n,
                method="pilot", rng=1)  # fmt: skip
    np.testing.assert_allclose(r.integral, [np.prod(1 / (np.array(p) + 1)) for p in powers], rtol=1e-13)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("worth", [0, math.inf])
def test_threads_and_batches_change_no_bit(d, worth, monkeypatch):
    """Whether the rule works ahead, beside func, or waits for it."""
    monkeypatch.setattr("voroquad.integrals.pilot.WORTH_A_THREAD", worth)

    def bits(**how: int) -> tuple[bytes, bytes, int]:
        r = vq.quad(lambda x: np.stack([rough(x), np.sin(9 * x[0])]), np.zeros(d), np.ones(d), n_points=30_000,
                    method="pilot", rng=3, **how)  # fmt: skip
        return r.integral.tobytes(), r.standard_error.tobytes(), r.n_evaluations

    assert bits(threads=1) == bits(threads=3) == bits(batch=1000) == bits(batch=7, threads=2)


def test_threads_change_nothing_that_a_callback_gets(monkeypatch):
    """While func is evaluated another thread adds the values before; what is known waits for it."""
    add = PilotRun._add

    def slow(self: PilotRun, values: np.ndarray) -> None:
        time.sleep(0.02)
        add(self, values)

    def seen(threads: int) -> list[tuple[int, float, float]]:
        told: list[vq.Progress] = []
        vq.quad(rough, [0, 0], [1, 1], n_points=20_000, method="pilot", rng=3, threads=threads, callback=told.append)
        return [(p.n_evaluations, p.integral, p.standard_error) for p in told]

    alone = seen(1)
    monkeypatch.setattr("voroquad.integrals.pilot.WORTH_A_THREAD", 0)
    monkeypatch.setattr(PilotRun, "_add", slow)
    assert seen(3) == alone


UNSEEN: dict[str, Callable[[np.ndarray, int], np.ndarray]] = {
    "wave in step": lambda x, k: np.exp(x[0]) + 1e-6 * np.cos(2 * np.pi * k * x[0]),
    "product of waves": lambda x, k: np.prod(np.cos(2 * np.pi * k * x), axis=0),
    "wave at the highest frequency": lambda x, k: np.cos(np.pi * k * x[0]),
    "layer beside the centres": lambda x, k: 1.0 + (np.abs(k * x[0] - 7.0) < 0.3),
    "peaks beside the centres": lambda x, k: 1.0 + 9 * (np.square(k * x - np.round(k * x)).sum(axis=0) < 0.1),
}


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("name", UNSEEN)
@pytest.mark.parametrize("size", [1e-200, 1.0, 1e200])
def test_what_the_grid_does_not_see_is_warned_of(d, name, size):
    n = 20_000
    with pytest.warns(vq.IntegrationWarning) as caught:
        r = vq.quad(lambda x: np.stack([0 * x[0] + 1, size * UNSEEN[name](x, grid_side(n, d))]), [0] * d, [1] * d,
                    n_points=n, method="pilot", rng=1)  # fmt: skip
    assert {w.message.kind for w in caught} <= {"unforeseen", "one-stratum"}
    assert not r.success
    if name == "wave in step":
        assert caught[0].message.details["component"] == 1


def test_a_component_of_zeros_hides_no_other_that_the_grid_does_not_see():
    k = 70

    def func(x: np.ndarray) -> np.ndarray:
        return np.stack([0 * x[0], np.cos(2 * np.pi * k * x[0])])

    with pytest.warns(vq.IntegrationWarning) as caught:
        vq.quad(func, [0, 0], [1, 1], n_points=4 * k**2, method="pilot", rng=1)
    assert [w.message.kind for w in caught] == ["zero", "unforeseen"]


@pytest.mark.parametrize("d", [1, 2, 3])
def test_what_the_grid_sees_is_not_warned_of(d):
    """New members of all families, rounding, and no change: fewer than 2 % of calls, of smooth ones none."""
    smooth = [lambda x: np.exp(x.sum(axis=0)), lambda x: 3.0 + 0 * x[0], lambda x: np.cos(9 * x[0]) + 1e8,
              lambda x: np.exp(x.sum(axis=0)).astype(np.float32)]  # fmt: skip
    smooth += [f for f in instances(d, 12, rng=77) if f.name in ("oscillatory", "peak", "corner", "gaussian")]
    rough_ones = [f for f in instances(d, 12, rng=77) if f.name in ("kink", "half-plane", "ball")]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", vq.IntegrationWarning)
        for n in (1000, 20_000):
            warned = [
                [vq.quad(f, [0] * d, [1] * d, n_points=n, method="pilot", rng=2).warnings for f in some]
                for some in (smooth, rough_ones)
            ]
            assert not any(warned[0])
            k = grid_side(n, d)

            def rounds(x: np.ndarray, k: int = k) -> np.ndarray:
                return (1 + 1e-7 * np.cos(2 * np.pi * k * x[0])).astype(np.float32)

            assert vq.quad(rounds, [0] * d, [1] * d, n_points=n, method="pilot", rng=2).success
            assert sum(w[0].kind == "unforeseen" for w in warned[1] if w) <= 1


@pytest.mark.parametrize("threads", [1, 2])
def test_an_exception_in_the_middle_is_raised(threads):
    calls = []

    def func(x: np.ndarray) -> np.ndarray:
        calls.append(x.shape[1])
        if len(calls) == 4:
            raise OSError("in the middle")
        return rough(x)

    with pytest.raises(OSError, match="in the middle"):
        vq.quad(func, [0, 0], [1, 1], n_points=20_000, method="pilot", rng=3, threads=threads)
    assert len(calls) == 4


@pytest.mark.parametrize("d", [1, 2, 3])
def test_parts_of_the_samples_change_nothing(monkeypatch, d):
    """Cells have the blocks of their sequences that they have without parts."""

    def points(most: int) -> np.ndarray:
        seen = []
        monkeypatch.setattr("voroquad.integrals.pilot.FEWEST_OF_A_PART", most)
        vq.quad(lambda x: seen.append(x) or rough(x), [0] * d, [1] * d, n_points=3000, method="pilot", rng=3)
        x = np.concatenate(seen, axis=1)
        return x[:, np.lexsort(x)]

    assert (points(100) == points(10_000)).all()


def test_no_call_has_more_points_than_a_batch():
    sizes = []

    def func(x: np.ndarray) -> np.ndarray:
        sizes.append(x.shape[1])
        assert x.flags.c_contiguous
        return rough(x)

    r = vq.quad(func, [0, 0], [1, 1], n_points=5000, method="pilot", batch=300, rng=3)
    assert max(sizes) == 300
    assert sum(sizes) == r.n_evaluations


def test_samples_go_where_the_grid_sees_the_integrand():
    """An edge along a third of the box: most samples lie at it, and the error is that of few cells."""
    seen = []

    def func(x: np.ndarray) -> np.ndarray:
        seen.append(x)
        return (x[0] + 0.3 * x[1] < 0.5) * 1.0

    r = vq.quad(func, [0, 0], [1, 1], n_points=16_384, method="pilot", rng=1)
    x = np.concatenate(seen, axis=1)
    assert np.mean(np.abs(x[0] + 0.3 * x[1] - 0.5) < 0.03) > 0.4
    assert abs(r.integral - 0.35) < 4 * r.standard_error < 1e-3


def test_components_share_the_samples():
    """Two edges in different places, one of them of a hundredth of the size: both get samples."""

    def func(x: np.ndarray) -> np.ndarray:
        return np.stack([x.sum(axis=0) < 0.4, 1 + 0.01 * (x.sum(axis=0) < 1.6)])

    r = vq.quad(func, [0, 0], [1, 1], n_points=16_384, method="pilot", rng=1)
    plain = vq.quad(func, [0, 0], [1, 1], n_points=16_384, method="plain", rng=1)
    assert (r.standard_error < plain.standard_error / 2).all()
    assert (np.abs(r.integral - [0.08, 1.0092]) < 4 * r.standard_error).all()


def test_errors_of_components_are_linked():
    """The first two sum to 1, which has no error; the last is independent of them."""

    def func(x: np.ndarray) -> np.ndarray:
        return np.stack([x[0] < 0.3, x[0] >= 0.3, np.sqrt(x[1])])

    r = vq.quad(func, [0, 0], [1, 1], n_points=4096, method="pilot", rng=1)
    low, high, other = r.standard_error
    assert np.sqrt(np.diag(r.covariance)) == pytest.approx([low, high, other])
    assert r.linear([1, 1, 0]).standard_error < 1e-9 * low
    assert r.ratio(0, 1).standard_error == pytest.approx(low / 0.7**2, rel=0.01)
    assert abs(r.covariance[0, 2]) < 0.5 * low * other


def test_it_says_what_predicts_each_component():
    r = vq.quad(lambda x: np.stack([x[0], x[0] < 0.3]), [0, 0], [1, 1], n_points=4096, method="pilot", rng=1)
    smooth, edge = r.rule
    assert smooth.startswith("pilot grid of 32 × 32 cells, stencil of ")
    assert edge == "pilot grid of 32 × 32 cells, stencil of 1"


@pytest.mark.parametrize("power", [-1000, -600, 600, 1000])
def test_no_scale_of_the_integrand_changes_a_digit(power):
    one, other = (
        vq.quad(lambda x, p=p: np.ldexp(rough(x), p), [0, 0], [1, 1], n_points=2000, method="pilot", rng=1)
        for p in (0, power)
    )
    assert other.integral == math.ldexp(one.integral, power)
    assert other.standard_error == math.ldexp(one.standard_error, power)


@pytest.mark.parametrize(
    ("func", "d", "n", "exact"),
    [
        (lambda x: np.exp(-(((x[0] - 0.30002) / 1e-5) ** 2) / 2), 1, 9000, 1e-5 * math.sqrt(2 * math.pi)),
        (lambda x: np.exp(-2e4 * x[0]), 2, 8192, 1 / 2e4),
        (lambda x: np.exp(-4e4 * x[0]), 2, 8192, 1 / 4e4),
    ],
)
@pytest.mark.filterwarnings("ignore::voroquad.IntegrationWarning")
def test_samples_far_above_the_grid_have_an_error(func, d, n, exact):
    """The largest samples are 10^87 to 10^190 times as large as the grid's largest value."""
    r = vq.quad(func, [0] * d, [1] * d, n_points=n, rng=3)
    assert abs(r.integral - exact) / 10 < r.standard_error < exact


def spikes(x: np.ndarray) -> np.ndarray:
    """Between the centres of 2250 cells, of 2^60 and 2^100 in different places; about 1 elsewhere."""
    y = 2250 * x[0]
    between, low, high = y % 1 < 0.4, np.abs(y - 700) < 20, np.abs(y - 1900) < 20
    return np.where(between & high, 2.0**100, np.where(between & low, 2.0**60, 1 + x[0]))


def history(room: int, monkeypatch: pytest.MonkeyPatch) -> tuple[np.ndarray, np.ndarray]:
    """Estimates of the spikes with their errors, batch by batch; units grow beyond 2^room."""
    monkeypatch.setattr("voroquad.integrals.pilot.ROOM", room)
    monkeypatch.setattr("voroquad.integrals.pilot.FEWEST_OF_A_PART", 200)
    seen: list[vq.Progress] = []
    vq.quad(lambda x: np.stack([spikes(x), x[0], 2.0**-40 * spikes(1 - x)]), 0, 1, n_points=9000, n_estimates=2, rng=1,
            callback=seen.append)  # fmt: skip
    known = [p for p in seen if p.integral is not None]
    return np.stack([p.integral for p in known]), np.stack([p.standard_error for p in known])


@pytest.mark.filterwarnings("ignore::voroquad.IntegrationWarning")
def test_growing_units_change_no_digit(monkeypatch):
    """Errors are the same but for the rounding of logarithms of their squares."""
    values, errors = history(1000, monkeypatch)
    assert len(values) > 3
    for room in (0, 32):
        others, their_errors = history(room, monkeypatch)
        np.testing.assert_array_equal(others, values)
        np.testing.assert_allclose(their_errors, errors, rtol=1e-12)


def mostly_zero(x: np.ndarray) -> np.ndarray:
    """Of three parts of the samples two are 0."""
    return np.where(x[0] < 0.2, rough(x) - (np.pi * 700 * x[0]) % 1, 0)


@pytest.mark.parametrize("func", [spikes, mostly_zero])
@pytest.mark.parametrize("power", [-1000, -560, 900])
@pytest.mark.filterwarnings("ignore::voroquad.IntegrationWarning")
def test_no_scale_changes_a_digit_where_units_grow(power, func):
    one, other = (vq.quad(lambda x, p=p: np.ldexp(func(x), p), 0, 1, n_points=9000, rng=1) for p in (0, power))
    assert one.standard_error > 0.001 * one.integral
    assert other.integral == math.ldexp(one.integral, power)
    assert other.standard_error == math.ldexp(one.standard_error, power)


def test_an_error_that_is_not_finite_is_no_success(monkeypatch):
    monkeypatch.setattr("voroquad.integrals.pilot.variance", lambda s, _: (np.full(len(s), np.nan), np.full(len(s), 3)))
    with pytest.warns(vq.IntegrationWarning, match="standard error is not finite"):
        r = vq.quad(lambda x: x[0], 0, 1, n_points=9000, rng=1)
    assert r.integral == pytest.approx(0.5)
    assert [w.kind for w in r.warnings] == ["no-finite-error"]
    assert not r.success


def test_infinite_limits():
    r = vq.quad(lambda x: np.exp(-np.square(x).sum(axis=0)), [-np.inf, 0], [np.inf, np.inf], n_points=20_000,
                method="pilot", rng=1)  # fmt: skip
    assert r.integral == pytest.approx(math.pi / 2, abs=1e-6)


def test_difficulty_is_in_proportion_to_errors():
    """An edge, its triple beside it, and a bell that the grid resolves far better."""

    def edge(x: np.ndarray) -> np.ndarray:
        return (x.sum(axis=0) < 0.8) * 1.0

    def func(x: np.ndarray) -> np.ndarray:
        return np.stack([edge(x), 3 * edge(x), np.exp(-np.square(x).sum(axis=0))])

    def difficulty(f: Callable[[np.ndarray], np.ndarray], k: int = 30) -> np.ndarray:
        library = Library.of(0, 1)
        run = PilotRun(Integrand(Function(f, library), Box([0, 0], [1, 1], library)), k, np.random.default_rng(1), 1)
        run.evaluate_grid()
        return run.difficulty()

    found = difficulty(func)
    assert found[1] == pytest.approx(3 * found[0], rel=1e-12)
    assert found[2] < 1e-6 * found[0]
    assert difficulty(edge)[0] == pytest.approx(found[0], rel=1e-12)
    # 2 k of k² cells have an edge: (2k)^1.5 / k²
    assert difficulty(edge, 120)[0] == pytest.approx(found[0] / 2, rel=0.25)


def test_several_estimates_share_the_grid():
    r = vq.quad(rough, [0, 0], [1, 1], n_points=1024, n_estimates=5, method="pilot", rng=1)
    assert r.degrees_of_freedom == 4
    assert 256 + 5 * 700 < r.n_evaluations <= 256 + 5 * 768


def test_a_tolerance_is_met():
    r = vq.quad(lambda x: np.exp(x[0] * x[1]), [0, 0], [1, 1], method="pilot", rtol=1e-8, rng=1)
    assert r.success
    assert r.integral == pytest.approx(sum(1 / ((k + 1) ** 2 * math.factorial(k)) for k in range(30)), rel=1e-8)


def kinds(func: Callable[[np.ndarray], np.ndarray], n: int = 2000) -> set[str]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        r = vq.quad(func, [0, 0], [1, 1], n_points=n, method="pilot", rng=1)
    return {w.kind for w in r.warnings}


def test_what_the_samples_do_not_show_is_said():
    assert kinds(lambda x: 0 * x[0]) == {"zero"}
    assert kinds(lambda x: np.where(x[0] > 0.5, np.nan, 1.0)) == {"not-finite"}
    assert kinds(rough) == set()
    corner = (np.arange(32) + 0.5) / 32  # beside the centres of the grid

    def peak(x: np.ndarray) -> np.ndarray:
        away = np.min(np.abs(x[:, :, None] - corner), axis=2).max(axis=0)
        return np.exp(-1e5 * np.square(x - 0.5).sum(axis=0)) * (away > 1e-3)

    assert kinds(peak, 4096) & {"few-samples", "zero"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"a": [0] * 4, "b": [1] * 4}, "d = 1 to 3"),
        ({"sampler": "sobol"}, "sampler='sobol'"),
        ({"order": 3}, "order=3"),
        ({"debias": "none"}, "debias='none'"),
        ({"n_points": 15}, "n_points must be at least 16"),
    ],
)
def test_what_the_rule_does_not_take(arguments, message):
    limits = {"a": [0, 0], "b": [1, 1]}
    with pytest.raises(ValueError, match=message):
        vq.quad(lambda x: pytest.fail("called"), **(limits | arguments), method="pilot")


# --- no bias


def own_residuals_choose(f: Callable[[np.ndarray], np.ndarray], k: int, rng: np.random.Generator) -> float:
    """The negative control in d = 1: of the predictions by one and by three centres, the one nearer to the sample."""
    grid = f((np.arange(k) + 0.5)[None] / k)
    v = rng.random(k) - 0.5
    y = f((np.arange(k) + 0.5 + v)[None] / k)
    i = np.clip(np.arange(k), 1, k - 2)
    t = v + np.arange(k) - i
    low, mid, high = grid[i - 1], grid[i], grid[i + 1]

    def parabola(t: np.ndarray) -> np.ndarray:
        return mid + t * (high - low) / 2 + t * t * (high - 2 * mid + low) / 2

    at = np.arange(k) - i
    mean = mid + at * (high - low) / 2 + (at * at + 1 / 12) * (high - 2 * mid + low) / 2
    terms = np.stack([y, mean + y - parabola(t)])
    nearest = np.argmin(np.abs(np.stack([y - grid, y - parabola(t)])), axis=0)
    return float(np.take_along_axis(terms, nearest[None], axis=0).mean())


def chi_square(estimates: np.ndarray, truth: np.ndarray) -> float:
    """Σ z² over integrands, of estimates (repetitions, integrands)."""
    spread = estimates.std(axis=0, ddof=1) / math.sqrt(len(estimates))
    seen = spread > 1e-15
    return float(np.square((estimates.mean(axis=0) - truth)[seen] / spread[seen]).sum())


@pytest.mark.statistical
@pytest.mark.parametrize(("d", "n", "repetitions"), [(1, 48, 1500), (2, 128, 1000), (3, 400, 800)])
def test_unbiased(d, n, repetitions):
    """A bias of 0.1 standard deviations of each of the 16 would make 140 ± 23 of the sum, or more."""
    members = list(instances(d, 2, rng=4))
    truth = np.array([m.integral for m in members])

    def func(x: np.ndarray) -> np.ndarray:
        return np.stack([m(x) for m in members])

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", vq.IntegrationWarning)
        found = np.array(
            [vq.quad(func, np.zeros(d), np.ones(d), n_points=n, method="pilot", threads=1, rng=s).integral
             for s in range(repetitions)]
        )  # fmt: skip
    # 16 degrees of freedom: exceeded once in 10^6
    assert chi_square(found, truth) < 60


@pytest.mark.statistical
def test_a_choice_by_the_samples_themselves_is_biased():
    rng = np.random.default_rng(1)
    k = grid_side(48, 1)
    members = list(instances(1, 2, rng=4))
    found = np.array([[own_residuals_choose(m, k, rng) for m in members] for _ in range(1000)])
    assert chi_square(found, np.array([m.integral for m in members])) > 120


PEAK = """
import resource, sys
import numpy as np, voroquad as vq
n, d = int(sys.argv[1]), int(sys.argv[2])
r = vq.quad(lambda x: np.cos(x.sum(axis=0)), [0] * d, [1] * d, n_points=n, method="pilot", threads=1, rng=1)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024, r.n_evaluations)
"""


@pytest.mark.parametrize("d", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_memory_grows_with_the_grid_alone(d):
    """Of a cell there are a value of 8 bytes, its stencil of 1 and its demand of 2; samples come and go.

    If they stayed, 8 bytes for the value of each would be 40 MB.
    """

    def peak(n: int) -> tuple[int, int]:
        done = subprocess.run([sys.executable, "-c", PEAK, str(n), str(d)], capture_output=True, text=True, check=True)
        memory, evaluations = map(int, done.stdout.split())
        return memory, evaluations

    few, many = peak(1_000_000), peak(6_000_000)
    assert many[1] > 5_900_000
    cells = (6_000_000 - 1_000_000) / 4
    assert many[0] - few[0] < 11 * cells + 12e6
