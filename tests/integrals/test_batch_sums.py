"""Sums over batches: those of all values, whatever the batches are."""

import numpy as np

from voroquad.integrals.batch_sums import BatchSums
from voroquad.integrals.estimates import PlainMean


def batches(power=0):
    """Values of three components, one of them 0 for long, whose sizes grow from batch to batch."""
    rng = np.random.default_rng(4)
    found = [np.ldexp(rng.normal(3, 1, size=(3, m)), power + 6 * k) for k, m in enumerate((1, 7, 2, 30))]
    for part in found[:2]:
        part[2] = 0
    return found


def test_sums_over_batches_are_those_of_all_values():
    parts, values = batches(), np.concatenate(batches(), axis=1)
    sums = sum(map(BatchSums.of, parts[1:]), BatchSums.of(parts[0]))
    assert sums.n == values.shape[1]
    expected = [
        (sums.mean, 1, values.mean(axis=1)),
        (sums.scatter, 2, np.square(values - values.mean(axis=1, keepdims=True)).sum(axis=1)),
        (sums.absolute, 1, np.abs(values).sum(axis=1)),
        (sums.square, 2, np.square(values).sum(axis=1)),
    ]
    for found, degree, exact in expected:
        np.testing.assert_allclose(np.ldexp(found, degree * sums.power), exact, rtol=1e-13)


def test_the_plain_mean_of_batches_is_that_of_all_values_and_scales_with_them():
    estimates = [PlainMean(batches(power)).estimate() for power in (0, -1000, 800)]
    values = np.concatenate(batches(), axis=1)
    np.testing.assert_allclose(estimates[0].mean, values.mean(axis=1), rtol=1e-13)
    np.testing.assert_allclose(estimates[0].error, values.std(axis=1, ddof=1) / np.sqrt(40), rtol=1e-13)
    for found, power in zip(estimates, (0, -1000, 800), strict=True):
        np.testing.assert_array_equal(found.mean, np.ldexp(estimates[0].mean, power))
        np.testing.assert_array_equal(found.error, np.ldexp(estimates[0].error, power))
        assert [w.kind for w in found.warnings] == [w.kind for w in estimates[0].warnings]


def test_each_batch_is_summed_once():
    parts = batches()
    whole, growing = PlainMean(parts).estimate(), []
    mean = PlainMean(growing)
    assert mean.estimate() is None
    for part in parts:
        growing.append(part.copy())
        found = mean.estimate()
        growing[-1][:] = np.nan  # is not read again
    np.testing.assert_array_equal(found.mean, whole.mean)
    np.testing.assert_array_equal(found.error, whole.error)


def test_values_that_are_not_finite_or_0_are_told():
    values = np.stack([np.ones(8), np.full(8, np.nan), np.zeros(8)])
    found = PlainMean([values[:, :3], values[:, 3:]]).estimate()
    np.testing.assert_array_equal(found.mean, [1, np.nan, 0])
    np.testing.assert_array_equal(found.error, [0, np.nan, 0])
    assert [(w.kind, w.details["components"]) for w in found.warnings] == [("zero", [2])]
