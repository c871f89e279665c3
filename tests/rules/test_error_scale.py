"""The factors of error bars are what benchmarks/results/error_scale.csv says."""

import csv
import importlib
import math
from pathlib import Path

import pytest

from voroquad.designs.grids import grid_shape
from voroquad.rules import cross_fit
from voroquad.rules.defaults import default_of_strata
from voroquad.rules.strata_fits import ERROR_SCALE

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
#: Of (dimension, order, least number of strata)
FACTORS = {(d, p, least): factor for (d, p), scales in ERROR_SCALE.items() for least, factor in scales}


@pytest.fixture
def measured_sizes(monkeypatch):
    """The sizes that the benchmark measures, by dimension."""
    monkeypatch.syspath_prepend(BENCHMARKS)
    return importlib.import_module("calibrate_errors").GRIDS


def entry(strata):
    """The factor that a grid takes."""
    d, n, order = len(strata), math.prod(strata), default_of_strata(strata).order
    return d, order, next(least for least, _ in ERROR_SCALE[d, order] if n >= least)


def rows():
    with (BENCHMARKS / "results" / "error_scale.csv").open() as file:
        return list(csv.DictReader(file))


def rounded_up(factors):
    """The largest finite one, as a multiple of 0.05."""
    return math.ceil(20 * max(f for f in factors if math.isfinite(f)) - 1e-9) / 20


@pytest.mark.parametrize("which", FACTORS, ids=str)
def test_a_factor_is_the_largest_of_its_grids(measured_sizes, which):
    d = which[0]
    grids = [strata for n in measured_sizes[d] if entry(strata := grid_shape(n, d)) == which]
    assert grids, "no size is measured"
    found = {row["strata"]: float(row["factor"]) for row in rows() if int(row["d"]) == d}
    missing = [name for strata in grids if (name := "x".join(map(str, strata))) not in found]
    if missing:
        pytest.skip(f"d = {d}: {', '.join(missing)} have no row; run benchmarks/calibrate_errors.py")
    assert FACTORS[which] == rounded_up(found["x".join(map(str, strata))] for strata in grids)


def test_the_factor_of_replicates_is_the_largest_of_its_sizes():
    assert rounded_up(float(row["factor"]) for row in rows() if int(row["d"]) > 4) == cross_fit.ERROR_SCALE


def test_every_row_is_of_a_grid_that_takes_its_factor():
    """The defaults have not changed since: another order would make a row meaningless."""
    for row in rows():
        if int(row["d"]) <= 4:
            strata = tuple(map(int, row["strata"].split("x")))
            assert str(entry(strata)[1]) == row["order"]
