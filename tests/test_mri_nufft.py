"""The density method of mri-nufft, and the example that compares it."""

from __future__ import annotations

import csv
import runpy
import sys
from pathlib import Path

import mrinufft
import numpy as np
import pytest
from matplotlib.image import imread

import voroquad as vq
import voroquad.mri_nufft  # registers "voroquad"

EXAMPLE = Path(__file__).parents[1] / "examples" / "mri_density.py"


def spokes() -> np.ndarray:
    return mrinufft.initialize_2D_radial(20, 32, in_out=True)


@pytest.mark.parametrize("unit", [1.0, 2 * np.pi])
def test_operators_take_it_by_name(unit):
    expected = vq.density_compensation(spokes(), (16, 16))
    operator = mrinufft.get_operator("finufft")(spokes() * unit, (16, 16), density="voroquad")
    np.testing.assert_allclose(operator.density, expected, rtol=1e-5)
    operator.compute_density({"name": "voroquad", "rim": "box"})
    assert np.sum(operator.density) == pytest.approx(1)


def test_wrong_positions_and_options_are_named():
    weigh = mrinufft.get_density("voroquad")
    with pytest.raises(ValueError, match="cycles per voxel"):
        weigh(spokes() * 20, (16, 16))
    with pytest.raises(ValueError, match="unknown rim"):
        weigh(spokes(), (16, 16), rim="disc")


def test_the_example(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", [str(EXAMPLE), "-o", str(tmp_path), "--scale", "0.12"])
    runpy.run_path(str(EXAMPLE), run_name="__main__")
    with (tmp_path / "density.csv").open(newline="") as file:
        error = {(row["trajectory"], row["method"]): float(row["error"]) for row in csv.DictReader(file)}
    for trajectory in {name for name, _ in error}:
        assert error[trajectory, "voroquad"] < error[trajectory, "voronoi"]
        assert error[trajectory, "voroquad"] < 0.3 * error[trajectory, "cell_count"]
    repeated = "radial, every other spoke twice"
    assert error[repeated, "voroquad"] == pytest.approx(error["radial", "voroquad"], rel=1e-3)
    assert error[repeated, "voronoi"] > 1.5 * error["radial", "voronoi"]
    assert imread(tmp_path / "density.png").std() > 0.1
