"""Tables of the plug-in: rules without bias by default, and a table for each seed."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from voroquad.mitsuba.domains import find_domain
from voroquad.mitsuba.recipes import FEWEST_SETS, MOST_SETS, read_settings


def settings(domain="lens", *, weighted=True, **properties):
    props = mi.Properties("reweighted")
    for name, value in properties.items():
        props[name] = value
    return read_settings(props, find_domain(domain), weighted=weighted)


@pytest.mark.parametrize(
    ("domain", "sampler", "order", "debias", "periodic"),
    [
        ("time", "stratified", 0, "exchange", False),
        ("wavelength", "stratified", 0, "none", True),
        ("wavelength", "sobol", 0, "none", True),
        ("wavelength", "scene", 0, "none", True),
        ("lens", "stratified", 0, "leave-one-out", False),
        ("light", "uniform", 0, "leave-one-out", False),
        ("pixel", "multi-jittered", 1, "leave-one-out", False),
        ("pixel+time", "stratified", 1, "leave-one-out", False),
        ("pixel+time", "uniform", 0, "leave-one-out", False),
        ("pixel+lens", "stratified", 1, "leave-one-out", False),
        ("pixel+lens+time+light", "multi-jittered", 1, "leave-one-out", False),
    ],
)
def test_default_rules(domain, sampler, order, debias, periodic):
    own = settings(domain, sampler=sampler)
    assert (own.order, own.debias, own.periodic) == (order, debias, periodic)


@pytest.mark.parametrize("sampler", ["regular", "sobol", "halton", "zero-two", "orthogonal", "scene"])
def test_what_is_biased_must_be_named(sampler):
    with pytest.raises(ValueError, match=r"no unbiased weights are known .*debias='none'.*weighted=false"):
        settings("lens", sampler=sampler)
    assert settings("lens", sampler=sampler, debias="none").order == 0
    settings("lens", sampler=sampler, weighted=False)


def test_each_image_has_a_table_of_its_seed():
    own = settings("lens")
    assert [own.recipe(16, 100, seed).seed for seed in (0, 7)] == [0, 7]
    assert [settings("lens", table_seed=3).recipe(16, 100, seed).seed for seed in (0, 7)] == [3, 3]


def test_number_of_sets():
    own = settings("lens")
    assert [own.recipe(n, uses, 0).sets for n, uses in ((16, 1), (16, 400), (16, 10**6), (4096, 10**6))] == [
        FEWEST_SETS, 100, MOST_SETS, 64,
    ]  # fmt: skip
    assert settings("lens", sets=5).recipe(16, 400, 0).sets == 5


def border(points):
    """A narrow bright band at one border of the box, beside a corner: where weights of cells are most wrong."""
    return 1 + 40 * (points[..., 0] < 1 / 32) + 10 * (points < 1 / 8).all(-1)


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("domain", "n"),
    [("time", 2), ("time", 16), ("time", 64), ("lens", 4), ("lens", 16), ("lens", 64), ("pixel+time", 16),
     ("pixel+time", 64), ("pixel+lens", 16), ("pixel+lens", 81)],
)  # fmt: skip
@pytest.mark.parametrize("sampler", ["stratified", "multi-jittered", "uniform"])
def test_default_rules_are_unbiased(domain, n, sampler):
    """Means of thousands of sets, beside the true integral."""
    if sampler == "uniform" and "+" in domain:
        pytest.skip("its rules in many dimensions take seconds")
    assert abs(z_of_border(settings(domain, sampler=sampler, sets=4000 if n < 64 else 2000), n)) < 5


@pytest.mark.statistical
@pytest.mark.parametrize("domain", ["time", "lens"])
@pytest.mark.parametrize("sampler", ["stratified", "uniform"])
def test_the_bias_of_cells_would_show(domain, sampler):
    """Negative control, the default of the first version."""
    assert abs(z_of_border(settings(domain, sampler=sampler, debias="none", sets=16000), 16)) > 10


def z_of_border(own, n):
    table = own.recipe(n, 10**6, 1).make()
    estimates = (table.weights * border(table.points)).sum(-1)
    truth = 1 + 40 / 32 + 10 / 8**own.d
    return (estimates.mean() - truth) / (estimates.std(ddof=1) / np.sqrt(len(estimates)))
