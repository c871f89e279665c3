"""Many sets, a little at a time."""

import numpy as np
import pytest

from voroquad.explore.experiment import MOST_SETS, Experiment, Replicates
from voroquad.explore.rules import method
from voroquad.study.functions import INTEGRANDS_1D

SMOOTH = INTEGRANDS_1D[1]


@pytest.fixture
def experiment():
    methods = [method("uniform", "equal", 0), method("uniform", "exchange", 0)]
    return Experiment(methods, SMOOTH, n=16, seed=5)


def test_batches_are_the_same_however_they_come(experiment):
    experiment.run(0.02)
    first = experiment.histograms[0]
    again = Replicates(first.method, SMOOTH, 16, 5)
    for _ in first.batches:
        again.add_batch()
    np.testing.assert_array_equal(first.errors, again.errors)


def test_rules_of_one_design_are_compared_on_the_same_seeds(experiment):
    for replicates in experiment.histograms:
        replicates.add_batch()
    plain, exchange = (r.errors for r in experiment.histograms)
    assert (exchange**2).mean() < (plain**2).mean() / 20


def test_errors_are_those_of_the_estimator(experiment):
    plain = experiment.histograms[0]
    for _ in range(40):
        plain.add_batch()
    m = plain.measured()
    variance = (np.e**2 - 1) / 2 - (np.e - 1) ** 2
    assert abs(m.mse - variance / 16) < 5.5 * m.mse_error
    assert abs(m.bias) < 5.5 * m.bias_error


def test_time_is_shared_and_kept(experiment):
    ticks = iter(range(1000))
    experiment.run(200, clock=lambda: next(ticks))
    histograms = [len(r.batches) for r in experiment.histograms]
    sizes = [len(r.batches) for row in experiment.convergence for r in row]
    assert sum(histograms) + sum(sizes) == 200
    assert max(histograms) - min(histograms) <= 1
    assert max(sizes) - min(sizes) <= 1
    assert min(histograms) > 4 * max(sizes)


def test_it_ends(experiment):
    (plain, _) = experiment.histograms
    while not plain.complete:
        plain.add_batch()
    assert MOST_SETS <= len(plain.errors) < MOST_SETS + plain.sets_per_batch
    experiment.run(0)  # takes the others
    assert len(plain.errors) < MOST_SETS + plain.sets_per_batch


def test_one_error_is_no_measurement():
    replicates = Replicates(method("uniform", "none", 0), SMOOTH, 4096, 0)
    assert replicates.measured() is None
    replicates.add_batch()
    assert replicates.measured() is None
    replicates.add_batch()
    assert replicates.measured().replicates == 2
