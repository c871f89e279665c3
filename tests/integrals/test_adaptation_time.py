"""benchmarks/adaptation_time.py, at a small size."""

from __future__ import annotations

import csv
import math
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import voroquad as vq

pytest.importorskip("vegas")
BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))
import adaptation  # noqa: E402
import adaptation_time  # noqa: E402


def test_each_point_costs_processor_time() -> None:
    f = adaptation_time.costly(lambda x: 2 * x[0], 1e-5)
    begin = time.process_time()
    np.testing.assert_array_equal(f(np.ones((1, 1000))), np.full(1000, 2.0))
    assert time.process_time() - begin >= 0.01


def test_a_small_race(tmp_path: Path) -> None:
    output = tmp_path / "time.csv"
    options = ["--microseconds", ".5", "--members", "1", "--repetitions", "1", "--integrands", "disc"]
    subprocess.run([sys.executable, BENCHMARKS / "adaptation_time.py", *options, "--output", output], check=True)
    rows = list(csv.DictReader(output.read_text().splitlines()))
    assert [row["peer"] for row in rows] == ["vegas", "tuned"]
    f = next(adaptation.members(adaptation.disc, 2))
    r = vq.quad(f, [0, 0], [1, 1], n_points=adaptation.N, rng=0)
    for row in rows:
        assert float(row["mse"]) == pytest.approx((r.integral - 1) ** 2, rel=0.05)
        assert 0 < float(row["mse_peer"]) < 1
        assert int(row["evaluations"]) > 1000


def test_at_equal_time_quad_is_ahead_of_vegas() -> None:
    """The geometric mean over all families, from the committed results."""
    with adaptation_time.RESULT.open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(adaptation.CASES) * 2
    for peer in ("vegas", "tuned"):
        own = [row for row in rows if row["peer"] == peer]
        times = [float(row["milliseconds_peer"]) / float(row["milliseconds"]) for row in own]
        assert 0.8 < math.exp(np.log(times).mean()) < 1.25
        ratios = [float(row["mse"]) / float(row["mse_peer"]) for row in own]
        assert math.exp(np.log(ratios).mean()) < 1
