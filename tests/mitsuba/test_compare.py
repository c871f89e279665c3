"""The comparison: what it leaves in its folder, and what it must show."""

from __future__ import annotations

import csv
import gc

import numpy as np
import pytest

from voroquad.mitsuba import compare as comparison
from voroquad.mitsuba.figures import closeup_windows
from voroquad.results import Results


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    import mitsuba as mi

    if mi.variant() != "llvm_ad_rgb":
        mi.set_variant("llvm_ad_rgb")
    out = tmp_path_factory.mktemp("compare") / "out"
    results = comparison.compare("depth-of-field", out, spp=(16, 4), size=(40, 30), seed=1, show_progress=False)
    gc.collect()  # a scene that still exists slows every later render: Dr.Jit traces all registered materials
    return out, results


def test_results_name_files_that_exist(small):
    out, results = small
    read = Results.read(out)
    assert read == results
    names = [name for s in read.sections for f in s.figures for name in (f.png, f.svg, f.csv)]
    (comparison_,) = (c for s in read.sections for c in s.comparisons)
    names += [comparison_.reference, comparison_.csv, *(r.exr for r in comparison_.renderings)]
    assert len(names) == 3 + 2 + 2 * len(comparison.METHODS)
    for name in names:
        assert (out / name).stat().st_size > 0
    for left, top, width, height in comparison_.closeups:
        assert 0 <= left < left + width <= 40
        assert 0 <= top < top + height <= 30


def test_errors_are_those_of_the_images(small):
    import mitsuba as mi

    out, _ = small
    with (out / "errors.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * len(comparison.METHODS)
    labels = {method.label: method.name for method in comparison.METHODS}
    reference = np.array(mi.Bitmap(str(out / "images" / "reference.exr")))[..., :3]
    for row in rows:
        image = np.array(mi.Bitmap(str(out / "images" / f"{labels[row['method']]}-{row['spp']}.exr")))[..., :3]
        assert float(row["mse"]) == pytest.approx(np.mean((image - reference) ** 2), rel=1e-3)
        assert 0 < float(row["flip"]) < 1
        assert float(row["reference_mse"]) < float(row["mse"])


def test_closeups_are_where_the_error_is():
    error = np.zeros((50, 60, 3))
    error[11:15, 20:24] = 1
    error[40:44, 5:8] = -0.5
    windows = closeup_windows(error)
    assert [error[w].any() for w in windows] == [True, True]
    assert [np.abs(error[w]).max() for w in windows] == [1, 0.5]
    assert error[windows[0]].shape == (10, 12, 3)


def test_slope_is_the_exponent():
    assert comparison.slope([16, 64, 256], [16.0**-1.5, 64.0**-1.5, 256.0**-1.5]) == pytest.approx(-1.5)
    assert comparison.slope([16], [1.0]) is None


def test_a_multijitter_that_would_take_more_samples_is_named(tmp_path):
    with pytest.raises(ValueError, match="multijitter"):
        comparison.compare("depth-of-field", tmp_path / "out", spp=(14 * 11,), size=(8, 6), show_progress=False)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.statistical
def test_depth_of_field_shows_what_weights_do(tmp_path):
    """Weighted uniform sets 3 × below uniform at 64 spp, 6 × at 256; weighted stratified sets below stratified."""
    comparison.compare("depth-of-field", tmp_path / "out", spp=(64, 256), size=(160, 120), show_progress=False)
    with (tmp_path / "out" / "errors.csv").open() as file:
        mse = {(row["method"], int(row["spp"])): float(row["mse"]) for row in csv.DictReader(file)}
    assert mse["uniform", 64] > 3 * mse["uniform + w", 64]
    assert mse["uniform", 256] > 6 * mse["uniform + w", 256]
    for spp in (64, 256):
        assert mse["stratified", spp] > mse["stratified + w", spp]
