"""The comparison: what it leaves in its folder, and what it must show."""

from __future__ import annotations

import csv
import gc

import numpy as np
import pytest

from voroquad.mitsuba import compare as comparison
from voroquad.mitsuba import methods
from voroquad.mitsuba.figures import closeup_windows
from voroquad.mitsuba.loading import load_scene
from voroquad.mitsuba.methods import Stage, methods_for
from voroquad.report.errors import read_errors
from voroquad.results.manifest import Results

ALL = methods.UNIFORM, methods.UNIFORM_W, *methods.STRATIFIED, methods.ZERO_TWO, *methods.SOBOL, methods.HALTON
ALL += (methods.OWEN_SOBOL, *methods.OF_MITSUBA)
#: At 4 and 16 spp; Mitsuba's orthogonal sampler makes squares of primes
RENDERINGS = 2 * len(ALL) - 1


@pytest.fixture(scope="module")
def small(ball, tmp_path_factory):
    import mitsuba as mi

    if mi.variant() != "llvm_ad_rgb":
        mi.set_variant("llvm_ad_rgb")
    out = tmp_path_factory.mktemp("compare") / "out"
    results = comparison.compare(ball, out, spp=(16, 4), size=(40, 30), seed=1, seeds=2, show_progress=False)
    gc.collect()  # a scene that still exists slows every later render: Dr.Jit traces all registered materials
    return out, results


def test_results_name_files_that_exist(small):
    out, results = small
    read = Results.read(out)
    assert read == results
    names = [name for s in read.sections for f in s.figures for name in (f.png, f.svg, f.csv)]
    (comparison_,) = (c for s in read.sections for c in s.comparisons)
    names += [comparison_.reference, comparison_.csv, *(r.exr for r in comparison_.renderings)]
    assert len(names) == 6 + 2 + RENDERINGS
    (grid,) = (g for s in read.sections for g in s.grids)
    assert grid.rows == ["stratified + blend", "Sobol' + blend"]
    names += [png for row in grid.pngs for png in row]
    for name in names:
        assert (out / name).stat().st_size > 0
    for left, top, width, height in comparison_.closeups:
        assert 0 <= left < left + width <= 40
        assert 0 <= top < top + height <= 30


def test_errors_are_those_of_the_images(small):
    import mitsuba as mi

    out, results = small
    with (out / "errors.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == RENDERINGS
    stems = {r.exr for s in results.sections for c in s.comparisons for r in c.renderings}
    labels = {method.label: method.name for method in ALL}
    assert stems == {f"images/{labels[row['method']]}-{row['spp']}.exr" for row in rows}
    reference = np.array(mi.Bitmap(str(out / "images" / "reference.exr")))[..., :3]
    for row in rows:
        image = np.array(mi.Bitmap(str(out / "images" / f"{labels[row['method']]}-{row['spp']}.exr")))[..., :3]
        # Of the first of two images, whose mean square error is the mean of both but for its spread
        mse = float(np.mean((image - reference) ** 2))
        assert abs(float(row["mse"]) - mse) == pytest.approx(float(row["mse_error"]), rel=0.1, abs=2e-3 * mse)
        assert float(row["relmse"]) > 0
        assert 0 < float(row["flip"]) < 1
        assert 0 < float(row["blur_3"]) < float(row["blur_1.5"]) < float(row["mse"])
        assert float(row["reference_mse"]) < float(row["mse"])


def test_images_with_and_without_weights_differ(small):
    """All methods share the pool's units, and each has sums of its own kind."""
    import mitsuba as mi

    out, _ = small
    for design in ("uniform", "stratified", "sobol"):
        plain, weighted = (np.array(mi.Bitmap(str(out / f"images/{design}{w}-16.exr"))) for w in ("", "-w"))
        assert np.abs(weighted - plain)[..., :3].max() > 1e-3


def test_equal_error_ratios_are_those_of_the_report(small):
    out, _ = small
    errors = read_errors(out / "errors.csv")
    with (out / "errors.csv").open() as file:
        for row in csv.DictReader(file):
            samples = errors.cells[row["method"], int(row["spp"])].ratios["uniform"]
            assert float(row["equal_error_ratio"]) == pytest.approx(samples.n, rel=1e-3)
            assert bool(int(row["extrapolated"])) == samples.extrapolated
    assert errors.cells["uniform", 4].ratios["uniform"].n == pytest.approx(1)


def test_chosen_methods_have_the_images_that_they_have_among_all(small, ball, tmp_path):
    out, _ = small
    chosen = {"spp": (16, 4), "size": (40, 30), "seed": 1, "seeds": 2, "show_progress": False}
    results = comparison.compare(ball, tmp_path / "out", methods=["stratified-w"], **chosen)
    gc.collect()
    assert "--methods stratified-w " in results.command
    assert [section.title for section in results.sections] == ["Images", "Errors"]
    images = {path.name for path in (tmp_path / "out" / "images").glob("*.exr")}
    assert images == {"reference.exr", *(f"{m}-{n}.exr" for m in ("uniform", "stratified-w") for n in (4, 16))}
    for name in images:
        assert (tmp_path / "out" / "images" / name).read_bytes() == (out / "images" / name).read_bytes()


@pytest.mark.parametrize("names", [["nonsense"], ["uniform", ""]])
def test_methods_that_do_not_exist_are_named(ball, tmp_path, names):
    with pytest.raises(ValueError, match=r"^methods: there is no '(nonsense|)' here; choose from uniform, uniform-w, "):
        comparison.compare(ball, tmp_path / "out", size=(8, 6), methods=names)
    assert list(tmp_path.iterdir()) == []


def test_closeups_are_where_the_error_is():
    error = np.zeros((50, 60, 3))
    error[11:15, 20:24] = 1
    error[40:44, 5:8] = -0.5
    windows = closeup_windows(error)
    assert [error[w].any() for w in windows] == [True, True]
    assert [np.abs(error[w]).max() for w in windows] == [1, 0.5]
    assert error[windows[0]].shape == (10, 12, 3)


def test_methods_of_a_domain(ball):
    scene = load_scene(ball)

    def names(domain="lens", jitter=False, spp=(16, 64)):
        return [m.name for m in methods_for(Stage(scene, scene.sensors()[0], domain, jitter), spp)]

    assert names()[:2] == ["uniform", "uniform-w"]
    assert {
        "zero-two",
        "stratified-blend",
        "sobol-blend",
        "mitsuba-independent",
        "mitsuba-ldsampler",
        "owensobol",
    } <= set(names())
    assert "sobol-joint" in names(jitter=True)
    assert "sobol-joint" not in names()
    assert "zero-two" not in names("pixel+light+time", jitter=True)
    assert not [n for n in names("pixel+lens", jitter=True) if n.endswith("-w")]
    # Samplers of Mitsuba's that round the number of samples are left out
    assert [n for n in names(spp=(49,)) if n.startswith("mitsuba")] == [
        "mitsuba-independent", "mitsuba-stratified", "mitsuba-multijitter", "mitsuba-orthogonal"]  # fmt: skip
    assert "mitsuba-orthogonal" not in names(spp=(64,))


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
