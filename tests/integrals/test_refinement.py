"""Sets of growing size: which one counts, and what stops them."""

import math

import numpy as np
import pytest

from voroquad.integrals.diagnostics import Diagnoses
from voroquad.integrals.estimates import Estimate
from voroquad.integrals.refinement import Tolerance, refine

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
        result = refine(plain_means(rng, seen), Tolerance(0.0, 0.2), 12, 200, 1, Diagnoses())
        assert result.n == sum(e.n for e in seen) <= 200
        assert (result.mean, result.error) == (seen[-1].mean, seen[-1].error)
        last.append(result.mean[0])
        stopping.append(seen[-2].mean[0])
    assert abs(z_score(np.array(last), TRUTH)) < 5.5
    assert z_score(np.array(stopping), TRUTH) < -6.5  # those that missed the bump
