"""The coverage suite: what a cell says of given intervals, and a small run."""

import csv

import numpy as np
import pytest

from voroquad.results.manifest import Results
from voroquad.study import coverage_suite
from voroquad.study.coverage_integrands import cases
from voroquad.study.coverage_suite import CoverageCell, CoverageSettings, kind_rows, measure, run_coverage


def test_a_cell_tells_shares_and_widths():
    held, warned = np.array([1.0, 1, 0, 0]), np.array([0.0, 1, 1, 0])
    row = CoverageCell(cases(1)[0], 1, 64, held, np.array([1.0, 2, 3, 9]), np.array([2.0, -2, 2, -2]), warned).row()
    assert row["coverage"] == 0.5
    assert row["width_over_rms"] == 1.25  # the median half-width, 2.5, over 2
    assert row["warned_of_missed"] == 0.5
    assert row["warned_of_held"] == 0.5
    assert row["calibrated"] == "yes"
    always = CoverageCell(cases(1)[0], 1, 64, np.ones(4), np.ones(4), np.zeros(4), warned).row()
    assert always["warned_of_missed"] == ""
    assert np.isfinite(always["width_over_rms"])


def test_a_vector_is_as_wide_as_its_widest_component():
    half = np.tile([1.0, 10.0, 100.0], 5)
    error = np.tile([1.0, 2.0, 100.0], 5)
    row = CoverageCell(cases(1)[-1], 1, 64, np.ones(15), half, error, np.zeros(15)).row()
    assert row["width_over_rms"] == 5


def test_replicates_are_those_of_quad_and_do_not_depend_on_their_number():
    work = [(1, 64, number) for number in (0, len(cases(1)) - 1)]
    few, many = (list(measure(work, CoverageSettings(replicates, 3))) for replicates in (20, 45))
    for a, b in zip(few, many, strict=True):
        components = a.case.integral.size
        assert len(a.held) == 20 * components
        assert len(b.held) == 45 * components
        for name in ("held", "half", "error", "warned"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name)[: 20 * components])
    seed = [3, 1, 64, 0, 7]
    np.testing.assert_array_equal(coverage_suite._replicate(few[0].case, 64, seed)[:, 0], [
        few[0].held[7], few[0].half[7], few[0].error[7], few[0].warned[7],
    ])  # fmt: skip


def test_kinds_are_summed_up_by_what_was_calibrated():
    row = {"d": 1, "n": 64, "kind": "end", "calibrated": "no", "integrand": "a", "coverage": 0.9, "width_over_rms": 3.0}
    other = row | {"integrand": "b", "coverage": 0.7, "width_over_rms": 2.0}
    (found,) = kind_rows([row, other])
    assert (found["coverage"], found["least"], found["of"], found["widest"]) == (pytest.approx(0.8), 0.7, "b", 3.0)
    assert found["integrands"] == 2
    assert len(kind_rows([row, other | {"calibrated": "yes"}])) == 2


def test_a_small_run(tmp_path, monkeypatch):
    few = cases(1)[:3]
    monkeypatch.setattr(coverage_suite, "cases", lambda d: few)
    results = run_coverage(tmp_path, dimensions=[1], max_n=256, replicates=20, seed=1, show_progress=False)
    assert Results.read(tmp_path) == results
    with (tmp_path / "coverage.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["n"], row["integrand"]) for row in rows] == [(n, f.formula) for n in ("64", "256") for f in few]
    assert all(0 < float(row["coverage"]) <= 1 for row in rows)
    assert (tmp_path / "coverage-1d.svg").is_file()
    assert coverage_suite.summary(results, tmp_path)["coverage"][0]["kind"] == "end"
    assert "--replicates 20" in results.command


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"replicates": 19}, "replicates must be at least 20"),
        ({"seed": -1}, "seed must be at least 0"),
        ({"dimensions": [7]}, "dimensions must be from 1 to 6"),
        ({"dimensions": []}, "dimensions must name at least one"),
        ({"dimensions": [1, 5], "max_n": 256}, "max_n must be at least 512 for d = 5"),
    ],
)
def test_arguments_are_checked_before_work_starts(tmp_path, options, message):
    with pytest.raises(ValueError, match=message):
        run_coverage(tmp_path / "out", show_progress=False, **options)
    assert not (tmp_path / "out").exists()
