"""Sets of growing size: which one counts, and what stops them."""

import math
import warnings
from collections.abc import Callable

import numpy as np
import pytest

import voroquad as vq
from voroquad.integrals.diagnostics import Diagnoses
from voroquad.integrals.estimates import Estimate
from voroquad.integrals.kept import Trials
from voroquad.integrals.refinement import Tolerance, refine
from voroquad.integrals.watch import Watch

TRUTH = 0.02 * math.sqrt(math.pi)


def bump(x):
    """Few points find it: a set that misses it looks exact."""
    return np.exp(-(((x - 0.5) / 0.02) ** 2))


def plain_means(rng, seen):
    """Estimates by plain means of fresh points; they are noted in `seen`."""

    def estimate(n):
        values = bump(rng.random(n))
        error = values.std(keepdims=True) / math.sqrt(n)
        seen.append(Estimate(values.mean(keepdims=True), error, np.zeros(1), n, math.inf))
        return seen[-1]

    return estimate


@pytest.mark.statistical
@pytest.mark.filterwarnings("ignore::voroquad.IntegrationWarning")
def test_the_value_returned_is_none_that_stopped_the_refinement(z_score):
    rng, last, stopping = np.random.default_rng(1), [], []
    for _ in range(4000):  # a bias of 0.1 standard deviations of one estimate shows as |z| ≈ 6.3
        seen = []
        result = refine(plain_means(rng, seen), Tolerance(0.0, 0.2), 12, 200, 1, Diagnoses(), Watch())
        assert result.n == sum(e.n for e in seen) <= 200
        assert (result.mean, result.error) == (seen[-1].mean, seen[-1].error)
        last.append(result.mean[0])
        stopping.append(seen[-2].mean[0])
    assert abs(z_score(np.array(last), TRUTH)) < 5.5
    assert z_score(np.array(stopping), TRUTH) < -6.5  # those that missed the bump


# ---------------------------------------------------------------------- what ends it


def kinds(result):
    return [warning.kind for warning in result.warnings]


@pytest.mark.filterwarnings("ignore::voroquad.IntegrationWarning")
@pytest.mark.parametrize("wanted", [{"rtol": 1e-3}, {"atol": 1e-3}])
@pytest.mark.parametrize(("d", "most"), [(1, 20_000), (5, 20_000)])
def test_an_integral_of_which_all_samples_are_zero_never_converges(wanted, d, most):
    r = vq.quad(lambda x: 0 * x[0], [0] * d, [1] * d, max_evaluations=most, rng=1, **wanted)
    assert (r.integral, r.standard_error, kinds(r), r.success) == (0, 0, ["zero"], False)
    assert most / 2 < r.n_evaluations <= most


@pytest.mark.filterwarnings("ignore::voroquad.IntegrationWarning")
@pytest.mark.parametrize("wanted", [{"rtol": 1e-2}, {"atol": 1e-2}])
def test_a_peak_that_the_first_set_misses_is_found_by_a_larger_one(wanted):
    width = 2e-4

    def f(x):
        return np.exp(-(((x[0] - 0.3) / width) ** 2) / 2) / (width * math.sqrt(2 * math.pi))

    for seed in range(5):
        assert kinds(vq.quad(f, 0, 1, n_points=64, rng=seed))[0] in ("zero", "few-samples")
        r = vq.quad(f, 0, 1, n_points=64, max_evaluations=100_000, rng=seed, **wanted)
        assert r.success
        assert r.integral == pytest.approx(1, rel=1e-2)


def test_a_component_that_is_zero_does_not_hold_up_the_others():
    with pytest.warns(vq.IntegrationWarning, match="func is 0 at every point") as caught:
        r = vq.quad(lambda x: np.stack([np.exp(x[0]), 0 * x[0]]), 0, 1, rtol=1e-6, rng=1)
    assert r.n_evaluations == 2048
    assert (len(caught), caught[0].message.details) == (1, {"components": [1], "of": 2})


def test_a_smooth_integral_of_zero_ends_at_rounding_and_asks_for_atol():
    with pytest.warns(vq.IntegrationWarning) as caught:
        r = vq.quad(lambda x: x[0] ** 3, -1, 1, rtol=1e-6, rng=1)
    assert kinds(r) == [w.message.kind for w in caught] == ["give-atol", "rounding"]
    assert r.n_evaluations == 2048
    assert not r.success
    assert vq.quad(lambda x: x[0] ** 3, -1, 1, rtol=1e-6, atol=1e-12, rng=1).success


def test_atol_is_asked_for_before_the_evaluations_are_spent():
    spent = []

    def odd(x):
        spent.append(x.shape[1])
        return np.sign(x[0] - 0.1) * 1.0

    with warnings.catch_warnings():
        warnings.filterwarnings("error", message="the integral is 0 within its error")
        with pytest.raises(vq.IntegrationWarning):
            vq.quad(odd, -0.8, 1, rtol=1e-6, rng=1)
    assert sum(spent) < 50_000


def test_a_tolerance_below_rounding_is_told_apart():
    with pytest.warns(vq.IntegrationWarning, match="smaller than the rounding error") as caught:
        r = vq.quad(lambda x: np.exp(x[0]), 0, 1, rtol=1e-17, rng=1)
    assert r.n_evaluations == 2048
    assert [w.message.kind for w in caught] == ["rounding"]


class Made(Trials):
    """Trials of another call, and then own ones."""

    def __init__(self, sizes: list[int]):
        self.sizes, self.own = list(sizes), []

    def of_others(self, room: int) -> int | None:
        return self.sizes.pop(0) if self.sizes else None

    def begin(self, n: int, last: bool) -> None:
        self.own.append(n)


@pytest.mark.statistical
@pytest.mark.filterwarnings("ignore::voroquad.IntegrationWarning")
@pytest.mark.parametrize("fresh", [True, False])
def test_a_refined_estimate_does_not_depend_on_that_of_the_call_before(fresh, z_score):
    """The caller refines where the first result is large; the last set of that call is a trial, and no estimate."""
    found = []
    for seed in range(4000):

        def estimator(seed: int = seed) -> Callable[[int], Estimate]:
            rng = np.random.default_rng(seed)

            def estimate(n: int) -> Estimate:
                mean = rng.standard_normal(1) / math.sqrt(n)
                return Estimate(mean, np.exp(-mean) / math.sqrt(n), np.zeros(1), n, math.inf)

            return estimate

        first = Made([])
        before = refine(estimator(), Tolerance(0, 0.5), 8, 10_000, 1, Diagnoses(), Watch(), first)
        if before.mean[0] < 0:
            continue
        after = refine(estimator(), Tolerance(0, 0.2), 8, 10_000, 1, Diagnoses(), Watch(), Made(first.own))
        assert after.trials[len(first.own) - 1].mean == before.mean
        found.append((after if fresh else before).mean[0] * math.sqrt((after if fresh else before).trials[-1].n))
    assert (abs(z_score(np.array(found), 0.0)) < 4.5) == fresh
