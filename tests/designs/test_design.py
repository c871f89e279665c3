"""What a design says of its sets is true of the sets that its sampler draws."""

from __future__ import annotations

import numpy as np
import pytest

import voroquad as vq
from voroquad.designs.design import DESIGNS, ENGINE_DESIGNS, design_of
from voroquad.designs.grids import stratum_index

SETS, N = 10_000, 16


@pytest.mark.parametrize("name", DESIGNS)
def test_gridded_designs_and_no_others_have_strata(name):
    s = vq.sample(name, n=16, d=2, rng=1)
    assert (s.strata is not None) == DESIGNS[name].gridded
    if DESIGNS[name].gridded:
        assert (stratum_index(s.points, s.strata) == np.arange(16)).all()


@pytest.mark.statistical
@pytest.mark.parametrize("name", DESIGNS)
def test_plain_means_of_randomised_designs_are_unbiased(name, z_score):
    # A threshold off every digit's edge, so that grids and sequences meet it by chance alone
    inside = (vq.sample(name, n=N, d=2, sets=SETS, rng=2).points < 0.3).all(axis=2).mean(axis=1)
    if DESIGNS[name].randomised:
        assert abs(z_score(inside, 0.09)) < 5.5
    else:
        assert (inside == inside[0]).all()
        assert inside[0] != 0.09


@pytest.mark.statistical
@pytest.mark.parametrize("name", [name for name, design in DESIGNS.items() if design.randomised])
def test_points_of_independent_designs_and_no_others_are_uncorrelated(name):
    points = vq.sample(name, n=N, d=2, sets=SETS, rng=3).points
    # Within strata where there are some: their indices are fixed
    u = points * 4 % 1 if DESIGNS[name].gridded else points
    v = u[..., 0] - 0.5
    total = v.sum(axis=1).var()
    ratio = total / (v**2).mean() / N  # 1 for independent points; its standard deviation is about √(2/SETS)
    if DESIGNS[name].independent:
        assert abs(ratio - 1) < 5.5 * np.sqrt(2 / SETS)
    else:
        assert abs(ratio - 1) > 20 * np.sqrt(2 / SETS)


def test_sizes_are_those_that_can_be_drawn():
    for name, design in DESIGNS.items():
        n = design.largest_size(100, 2)
        assert n <= 100
        assert vq.sample(name, n=n, d=2, rng=1).n == n


def test_nothing_is_assumed_of_an_unknown_design():
    unknown = design_of("unknown")
    assert not any((unknown.randomised, unknown.gridded, unknown.independent, unknown.stratified))
    assert all(design.randomised for design in ENGINE_DESIGNS.values())
