import numpy as np
import pytest

from voroquad.study import convergence
from voroquad.study.convergence import (
    METHODS_1D,
    METHODS_2D,
    Measurement,
    fit_slope,
    measure,
    powers_of_two,
    replicates_at,
)
from voroquad.study.functions import INTEGRANDS

METHODS = {m.name: m for m in METHODS_1D}


def line(name, measurements):
    return [m for m in measurements if m.method.name == name]


@pytest.fixture(scope="module")
def on_exp():
    sizes = [64, 128, 256, 512, 1024]
    measurements = []
    # The squared error of a weighted uniform set has a heavy tail: its mean needs many sets
    for design, replicates in (("uniform", 5000), ("stratified", 500), ("sobol", 500)):
        methods = [m for m in METHODS_1D if m.design == design]
        measurements += measure(methods, [INTEGRANDS["smooth"]], sizes, replicates=replicates, seed=11)
    return measurements


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("name", "slope", "tolerance"),
    [
        ("uniform", -1, 0.15),
        ("uniform + Voronoi Î_C", -4, 0.3),
        ("uniform + exchange", -4, 0.3),
        ("uniform + Î_GR", -2, 0.3),
        ("stratified", -3, 0.3),
        ("Sobol'", -3, 0.3),
    ],
)
def test_slopes_on_exp(on_exp, name, slope, tolerance):
    fitted = fit_slope(line(name, on_exp))
    assert fitted.value == pytest.approx(slope, abs=tolerance)
    assert fitted.error < tolerance / 5


@pytest.mark.statistical
def test_exchange_on_exp_at_512(on_exp):
    mse = {m.method.name: m.mse for m in on_exp if m.n == 512}
    assert mse["uniform + exchange"] <= 1.3 * mse["uniform + Voronoi Î_C"]
    assert mse["uniform + exchange"] <= mse["uniform + Î_GR"] / 1000


@pytest.mark.statistical
def test_bias_is_seen_where_it_is_and_nowhere_else():
    independent = [m for m in METHODS_1D if m.design in ("uniform", "stratified")]
    measurements = measure(independent, [INTEGRANDS["kink"]], [8], replicates=20_000, seed=5)
    z = {m.method.name: m.bias / m.bias_error for m in measurements}
    biased = {"uniform + Voronoi Î_C", "stratified + Voronoi Î_C"}
    assert all(abs(z[name]) > 8 for name in biased)
    assert all(abs(z[name]) < 4.8 for name in z if name not in biased)


@pytest.mark.statistical
def test_two_dimensions_reach_the_reference_values():
    measurements = measure(METHODS_2D, [INTEGRANDS["smooth-2d"]], [1024], replicates=200, seed=3)
    mse = {m.method.name: m.mse for m in measurements}
    # docs/theory.md, measured by another program
    assert mse["uniform"] == pytest.approx(2.0e-3, rel=0.6)
    assert mse["uniform + Voronoi Î_C"] == pytest.approx(2.2e-6, rel=0.6)
    assert 1e-7 < mse["Sobol'"] < 4e-7
    assert mse["stratified + Voronoi Î_C"] == pytest.approx(3.6e-7, rel=0.6)


def synthetic(n, mse, error=0.0):
    return Measurement("smooth", METHODS["uniform"], n, 10, mse, error, 0.0, 1.0)


def test_fit_slope_of_a_power_law():
    slope = fit_slope([synthetic(n, 3 * n**-2.5) for n in (8, 64, 128, 256, 512)])
    assert slope.value == pytest.approx(-2.5)
    assert (slope.error, slope.n_from, slope.n_to) == (0.0, 64, 512)


def test_fit_slope_takes_the_last_three_sizes_if_all_are_small():
    slope = fit_slope([synthetic(8, 1.0), synthetic(16, 1 / 16), synthetic(32, 1 / 32), synthetic(64, 1 / 64)])
    assert (slope.n_from, slope.n_to) == (16, 64)
    assert slope.value == pytest.approx(-1)


def test_the_error_of_a_slope():
    # Two sizes a factor e apart on either side of a third: slope = (log m_3 − log m_1) / 2
    sizes = [np.e**k for k in (5, 6, 7)]
    slope = fit_slope([synthetic(n, 1.0, 0.1) for n in sizes])
    assert slope.error == pytest.approx(0.1 * np.sqrt(2) / 2)


def test_a_seed_gives_the_same_numbers_whatever_else_runs():
    smooth, jump = INTEGRANDS["smooth"], INTEGRANDS["jump"]
    both = measure(METHODS_1D, [smooth, jump], [8, 16], replicates=3, seed=1)
    alone = measure(METHODS_1D, [smooth], [16], replicates=3, seed=1)
    assert [m for m in both if m.integrand == "smooth" and m.n == 16] == alone
    assert measure(METHODS_1D, [smooth], [16], replicates=3, seed=2) != alone


def test_blocks_of_replicates_are_different(monkeypatch):
    """Twice the same block would leave the mean error as it is."""
    monkeypatch.setattr(convergence, "UNIT_SETS", 8)
    (one,), (two,) = (
        measure([METHODS["uniform"]], [INTEGRANDS["smooth"]], [8], replicates=replicates, seed=1)
        for replicates in (4, 8)  # doubled where sets are small
    )
    assert (one.replicates, two.replicates) == (8, 16)
    assert two.bias != pytest.approx(one.bias, rel=1e-3)


def test_sizes_and_replicates():
    assert powers_of_two(100) == [8, 16, 32, 64]
    assert [replicates_at(n, 1000) for n in (8, 256, 512, 1024, 4096)] == [2000, 2000, 2000, 1000, 1000]
    with pytest.raises(ValueError, match="max_n must be at least 32"):
        powers_of_two(31)
