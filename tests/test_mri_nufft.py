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
    with pytest.raises(ValueError, match="unit of the samples cannot be inferred: coordinates up to 10 reach neither"):
        weigh(spokes() * 20, (16, 16))
    with pytest.raises(ValueError, match="unknown rim"):
        weigh(spokes(), (16, 16), rim="disc")


@pytest.mark.parametrize("scale", [6.0, 5.0, 0.2, 0.6])  # up to 3, 2.5, 0.1, 0.3: BART's, or a part of k-space
def test_units_that_cannot_be_told_are_asked_for(scale):
    weigh = mrinufft.get_density("voroquad")
    with pytest.raises(ValueError, match="name it, for operators as density="):
        weigh(spokes() * scale, (64, 64))
    expected = vq.density_compensation(spokes() * scale / (2 * np.pi))
    np.testing.assert_allclose(weigh(spokes() * scale, (64, 64), units="radians/voxel"), expected)
    if scale == 6.0:
        np.testing.assert_allclose(weigh(spokes() * 6, (6, 6), units="cycles/fov"), vq.density_compensation(spokes()))


def test_masked_and_complex_samples_are_refused():
    weigh = mrinufft.get_density("voroquad")
    with pytest.raises(ValueError, match="must not be masked"):
        weigh(np.ma.masked_greater(spokes(), 0.4))
    with pytest.raises(ValueError, match="must be real"):
        weigh(spokes() + 0j)


def test_images_come_back_over_the_squared_norm_factor():
    """As the documentation says: adj_op(op(image)) is image / (4 N²) for N × N pixels, to the error of the weights."""
    n = 32
    trajectory = mrinufft.initialize_2D_radial(128, 128, in_out=True)
    operator = mrinufft.get_operator("finufft")(trajectory, (n, n), density="voroquad", squeeze_dims=True)
    x = (np.arange(n) - n // 2) / n
    image = np.exp(-((x[:, None] / 0.12) ** 2) - (x / 0.12) ** 2).astype(np.complex64)  # nothing in k-space's corners
    back = operator.adj_op(operator.op(image))
    assert operator.norm_factor**2 == pytest.approx(4 * n**2)
    np.testing.assert_allclose(back * 4 * n**2, image, atol=0.03)


def test_a_stack_of_spirals_is_weighed_in_its_cylinder():
    spiral = mrinufft.initialize_2D_spiral(12, 100, nb_revolutions=2)
    operator = mrinufft.get_operator("finufft")(mrinufft.stack(spiral, 8), (16, 16, 8), density="voroquad")
    plane = vq.density_compensation(spiral)
    np.testing.assert_allclose(operator.density, np.tile(plane, 8) / 8, rtol=1e-3, atol=1e-9)


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
