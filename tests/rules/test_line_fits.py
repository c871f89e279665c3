"""Orders by stratum on the line: the definition from scratch, no look at the own sample, no bias."""

import math

import numpy as np
import pytest

import voroquad as vq
from voroquad.rules import line_fits
from voroquad.rules.line_fits import FEWEST, HALF_WIDTHS, JUDGES, OF_HIGHEST, REFERENCE, choose_on_line


def draw(n, sets, seed=1):
    return vq.sample("multi-jittered", n, 1, sets=sets, rng=seed).points[..., 0]


def fields(x):
    return np.stack([np.exp(3 * x), np.sqrt(x), np.where(x < 0.4, 1.0, x), np.sin(40 * x)], axis=-2)


def from_scratch(x, f, i, order, without=()):
    """The polynomial for stratum i, and the strata of its block."""
    n, m = len(x), HALF_WIDTHS[order]
    first = min(max(i - m, 0), n - 2 * m - 1)
    block = [j for j in range(first, first + 2 * m + 1) if j != i and j not in without]
    return np.polynomial.Polynomial.fit(x[block], f[block], order, domain=[x.min(), x.max()]), block


@pytest.mark.parametrize("n", [FEWEST, 9, 20, 40])
def test_scores_and_orders_are_those_of_the_definition(n):
    x = draw(n, 1)
    f = fields(x)
    found = choose_on_line(x, f)
    orders = [p for p, m in HALF_WIDTHS.items() if 2 * m + 1 <= n]
    for field, chosen in zip(f[0], found.orders[0], strict=True):
        for i in range(n):
            scores = []
            for p in orders:
                judges = [j for j in from_scratch(x[0], field, i, p)[1] if abs(j - i) <= JUDGES]
                missed = [field[j] - from_scratch(x[0], field, i, p, [j])[0](x[0, j]) for j in judges]
                scores.append(np.square(missed).mean() * (OF_HIGHEST if p == orders[-1] else 1))
            assert scores[orders.index(chosen[i])] <= min(scores) * (1 + 1e-6) + 1e-25  # rounding decides between zeros


@pytest.mark.parametrize("n", [FEWEST, 13, 30, 64])
def test_estimate_and_residuals_are_those_of_the_definition(n, monkeypatch):
    monkeypatch.setattr(line_fits, "TOGETHER", 17)
    x = draw(n, 2)
    f = fields(x)
    found = choose_on_line(x, f)
    for s in range(2):
        for field, orders, weights, residuals, around, reference in zip(
            f[s],
            found.orders[s],
            found.weights[s],
            found.residuals[s],
            found.around[s],
            found.reference[s],
            strict=True,
        ):
            estimate = 0.0
            for i in range(n):
                fit, _ = from_scratch(x[s], field, i, orders[i])
                whole = fit.integ()
                estimate += whole((i + 1) / n) - whole(i / n) + (field[i] - fit(x[s, i])) / n
                assert residuals[i] == pytest.approx(field[i] - fit(x[s, i]), abs=1e-9)
                near = min(max(i, 1), n - 2) + np.arange(-1, 2)
                np.testing.assert_allclose(around[i], field[near] - fit(x[s, near]), atol=1e-9)
                highest = max(p for p in (0, 1, 2, 4) if 2 * HALF_WIDTHS[p] + 1 <= n)
                other, _ = from_scratch(x[s], field, i, highest)
                assert reference[i] == pytest.approx(field[i] - other(x[s, i]), abs=1e-9)
            assert weights @ field == pytest.approx(estimate, abs=1e-9)
    assert REFERENCE == 4


def test_smooth_integrands_take_the_highest_order_and_jumps_a_low_one():
    x = draw(128, 4)
    orders = choose_on_line(x, fields(x)).orders
    assert (orders[:, 0] == 8).mean() > 0.7
    assert orders[:, 2, 48:54].mean() < 4


def test_polynomials_are_exact():
    x = draw(40, 3)
    f = np.stack([x**p for p in range(9)], axis=1)
    found = choose_on_line(x, f)
    np.testing.assert_allclose((found.weights * f).sum(axis=-1)[:, -1], 1 / 9, atol=1e-13)
    np.testing.assert_allclose(found.weights.sum(axis=-1), 1, atol=1e-13)


def test_neither_order_nor_prediction_knows_the_own_value():
    x = draw(30, 1)
    f = fields(x)
    before = choose_on_line(x, f)
    for i in range(30):
        other = f.copy()
        other[..., i] += 2
        after = choose_on_line(x, other)
        np.testing.assert_array_equal(after.orders[..., i], before.orders[..., i])
        np.testing.assert_allclose((after.residuals - before.residuals)[..., i], 2, atol=1e-9)
    assert (after.orders != before.orders).any()


def test_orders_do_not_know_the_own_position():
    x = draw(30, 2)
    f = fields(x)
    before = choose_on_line(x, f).orders
    for i in range(30):
        moved = x[:1].copy()
        moved[0, i] = x[1, i]
        np.testing.assert_array_equal(choose_on_line(moved, f[:1]).orders[0, :, i], before[0, :, i])


def own_residuals_choose(x, f):
    """The estimate if the order of least own residual were taken, as it must not be."""
    n = f.shape[-1]
    fits = [line_fits._fit(p, x, f, slice(0, n)) for p in HALF_WIDTHS if 2 * HALF_WIDTHS[p] + 1 <= n]
    best = np.argmin([abs(fit.residuals) for fit in fits], axis=0)
    weights = np.ones_like(f)
    for k, fit in enumerate(fits):
        for i in range(len(f)):
            np.add.at(weights[i], fit.block[best[i] == k], fit.response[best[i] == k])
    return (weights * f).sum(axis=-1) / n


@pytest.mark.slow
@pytest.mark.statistical
@pytest.mark.parametrize("n", [FEWEST, 24])
def test_the_choice_costs_no_bias_and_one_by_own_residuals_would(n):
    truth = np.array([(math.e**3 - 1) / 3, 2 / 3, 0.4 + 0.42, (1 - math.cos(40)) / 40])
    x = draw(n, 20_000, seed=2)
    f = fields(x)
    errors = (choose_on_line(x, f).weights * f).sum(axis=-1) - truth
    assert abs(errors.mean(axis=0) / errors.std(axis=0, ddof=1) * math.sqrt(len(errors))).max() < 4.7
    errors = np.array([own_residuals_choose(p, v) for p, v in zip(x[:4000], f[:4000], strict=True)]) - truth
    assert abs(errors.mean(axis=0) / errors.std(axis=0, ddof=1) * math.sqrt(len(errors))).max() > 8
