"""What Voronoi cells make of arrays, threads, interrupts and processors, and what they refuse."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest
from cpu_time import cpu_time

import voroquad as vq
from voroquad import _core


@pytest.mark.parametrize("shape", [(30_000, 1), (30_000, 2), (10_000, 3), (50, 64, 1), (50, 64, 2), (50, 64, 3)])
@pytest.mark.parametrize("periodic", [False, True])
def test_bits_do_not_depend_on_threads(shape, periodic):
    points = np.random.default_rng(3).random(shape)
    one, two, four = (vq.cells(points, periodic=periodic, threads=t).measures for t in (1, 2, 4))
    assert one.tobytes() == two.tobytes() == four.tobytes()


@pytest.mark.parametrize("d", [1, 2, 3])
def test_every_version_of_the_core_gives_the_same_bits(d):
    program = """
import sys, numpy as np, voroquad as vq
x = np.random.default_rng(3).random((3000, int(sys.argv[1])))
x[:500] *= 1e-3
print(vq.cells(x).measures.tobytes().hex())
for seed in range(200):  # many sites that are equally near to a corner: octaves along a few rays
    rng = np.random.default_rng(seed)
    angle, height, octave = np.pi / 6 * rng.integers(0, 12, 26), rng.integers(-1, 2, 26), rng.integers(0, 60, 26)
    rays = 0.5 + 0.49 * (2.0**-octave * [np.cos(angle), np.sin(angle), height]).T[:, : x.shape[1]]
    for periodic in (False, True):
        print(vq.cells(rays, periodic=periodic).measures.tobytes().hex())
"""
    levels = _core.installed_levels()
    if len(levels) < 2:
        pytest.skip(f"needs two levels of the processor to compare; here are {levels}: make install builds all")
    outputs = [
        subprocess.run(
            [sys.executable, "-c", program, str(d)],
            env={**os.environ, "VOROQUAD_PROCESSOR": level},
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        for level in levels
    ]
    assert len(set(outputs)) == 1


def test_an_unknown_version_of_the_core_is_refused():
    asked = {**os.environ, "VOROQUAD_PROCESSOR": "v9"}
    program = "import voroquad; voroquad.cells([[0.5]])"
    failed = subprocess.run([sys.executable, "-c", program], env=asked, capture_output=True, text=True)
    assert failed.returncode != 0
    message = failed.stderr.splitlines()[-1]
    assert message.startswith("ImportError: VOROQUAD_PROCESSOR is 'v9'; here are ")
    assert "take one of these, or unset it" in message
    with pytest.raises(ImportError, match=r"is 'baseline'; here are v4: .*VOROQUAD_LEVELS=all PATH"):
        _core.choose_level(["v4"], "baseline")


def test_the_best_version_is_chosen_unless_another_is_asked_for():
    assert _core.choose_level(["v3", "baseline"], None) == "v3"
    assert _core.choose_level(["v3", "baseline"], "baseline") == "baseline"


@pytest.mark.parametrize("d", [1, 2, 3])
def test_batch_equals_its_sets(d):
    sets = np.random.default_rng(4).random((20, 33, d))
    np.testing.assert_array_equal(vq.cells(sets).measures, [vq.cells(s).measures for s in sets])


@pytest.mark.parametrize("d", [1, 2, 3])
def test_any_strides(d):
    wide = np.asfortranarray(np.random.default_rng(5).random((2 * d, 400, 8)))
    for view in (wide[::2].T, wide[::-2, 5:300:3].T, wide.T[..., :d].astype(">f8")):
        np.testing.assert_array_equal(vq.cells(view).measures, vq.cells(np.array(view, order="C")).measures)


def test_interrupt_ends_a_long_call():
    points = np.random.default_rng(8).random((1_000_000, 3))
    timer = threading.Timer(0.3, signal.raise_signal, [signal.SIGINT])
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        vq.cells(points, threads=2).measures  # noqa: B018


@pytest.mark.parametrize(("shape", "what"), [((2, 500_000, 3), "measures"), ((2_000_000, 2), "polygons")])
def test_interrupt_ends_sets_and_polygons_early(shape, what):
    points = np.random.default_rng(8).random(shape)
    cells = vq.cells(points, threads=1)
    timer = threading.Timer(0.1, signal.raise_signal, [signal.SIGINT])
    timer.start()
    with cpu_time() as seconds, pytest.raises(KeyboardInterrupt):
        cells.polygons() if what == "polygons" else cells.measures
    assert seconds() < 0.6  # all of it takes seconds


@pytest.mark.parametrize("as_given", [np.asarray, memoryview])
def test_later_changes_of_what_was_given_are_not_seen(as_given):
    points = np.random.default_rng(12).random((1000, 2))
    cells = vq.cells(as_given(points))
    points[::2] = np.nan
    assert abs(cells.measures.sum() - 1) <= 1e-12


def test_cells_keep_their_own_points():
    points = np.random.default_rng(0).random((50, 2))
    kept = vq.cells(points)
    before = vq.cells(points.copy()).measures
    points[:] = np.nan
    np.testing.assert_array_equal(kept.measures, before)


def test_masked_points_are_refused():
    with pytest.raises(ValueError, match="must not be masked"):
        vq.cells(np.ma.array([[0.5, 0.5], [0.2, 0.3]], mask=[[0, 0], [1, 1]]))


def test_complex_points_are_refused():
    with pytest.raises(ValueError, match="points must be real, got complex numbers"):
        vq.cells([[0.2 + 0.3j, 0.5]])


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([[0.5, np.nan]], "points"),
        ([[0.5, 1.5]], "points"),
        ([[0.5] * 4], "d = 4"),
        (np.empty((0, 2)), "at least one point"),
        ("abc", "array of numbers"),
    ],
)
def test_bad_points_are_named(points, message):
    with pytest.raises(ValueError, match=message):
        vq.cells(points)


def seam(lo: float, hi: float, dtype: type) -> float:
    """What np.mod makes of a number just below the lower end, or its rounding to the type."""
    return float(dtype(lo + np.mod(-1e-17 * (hi - lo), hi - lo)))


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("bounds", [(0, 1), (0, 2 * np.pi), (0.1, 0.8), (-0.3, 0.1), (1e6, 1e6 + 0.7)])
def test_the_upper_end_of_a_periodic_axis_is_its_lower_end(bounds, dtype):
    lo, hi = bounds
    x = np.array([[lo, lo], [seam(lo, hi, dtype), (lo + hi) / 2], [(lo + hi) / 2, seam(lo, hi, dtype)]], dtype)
    w = vq.cells(x, bounds=bounds, periodic=True).measures
    at_the_end = np.clip(x.astype(float), lo, hi)
    at_the_end[at_the_end == hi] = lo
    np.testing.assert_allclose(w, vq.cells(at_the_end, bounds=bounds, periodic=True).measures, rtol=1e-5)
    assert w.sum() == pytest.approx((hi - lo) ** 2, rel=1e-12)


@pytest.mark.parametrize("x", [1.5, -1e-3, np.inf, np.nan])
def test_other_points_outside_a_periodic_axis_are_refused(x):
    with pytest.raises(ValueError, match=r"is not inside \[0, 1\]\^1; give the box as bounds=.* or wrap"):
        vq.cells([0.5, x], periodic=True)


def test_wrapped_points_coincide_with_those_at_the_lower_end():
    x = np.array([0.99999999, 0.5, 0.0], dtype=np.float32)  # the first is 1
    np.testing.assert_array_equal(vq.cells(x, periodic=True).measures, [0.25, 0.5, 0.25])
    x = np.array([[np.mod(-1e-17, 1), 0.5], [0.5, 0.5]])
    assert x[0, 0] == 1
    np.testing.assert_array_equal(vq.cells(x, periodic=[True, False]).measures, [0.5, 0.5])


def test_single_precision_is_put_on_the_face_that_it_is_rounded_from():
    x = np.array([0.1, 0.05], np.float32)
    assert float(x[0]) > 0.1
    np.testing.assert_allclose(vq.cells(x, bounds=(0, 0.1)).measures, [0.025, 0.075], rtol=1e-6)
    with pytest.raises(ValueError, match=r"points\[0\] .* give the box as bounds"):
        vq.cells(x.astype(float), bounds=(0, 0.1))
