"""What pictures of cells show."""

from __future__ import annotations

import subprocess
import sys

import matplotlib as mpl
import numpy as np
import pytest

mpl.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.colors import to_rgba

import voroquad as vq

CMAP = mpl.colors.LinearSegmentedColormap.from_list("grey", ["black", "white"])


@pytest.fixture(autouse=True)
def _close():
    yield
    plt.close("all")


def test_on_a_line_bars_are_cells():
    ax = vq.cells([0.25, 0.5, 0.75]).plot(cmap=CMAP)
    assert [(bar.get_x(), bar.get_width()) for bar in ax.patches] == [(0, 0.375), (0.375, 0.25), (0.625, 0.375)]
    assert [bar.get_facecolor() for bar in ax.patches] == [to_rgba(c) for c in ("white", "black", "white")]


def test_in_the_plane_colours_show_values():
    points = np.random.default_rng(1).random((20, 2))
    cells = vq.cells(points)
    ax = cells.plot(np.arange(20), cmap=CMAP)
    (patches,) = ax.collections
    bar = ax.figure.colorbar(patches)
    ax.figure.draw_without_rendering()
    assert (bar.vmin, bar.vmax) == (0, 19)
    np.testing.assert_allclose(patches.get_facecolor()[:, 0], np.arange(20) / 19, atol=0.01)
    boxes = [path.get_extents() for path in patches.get_paths()]
    np.testing.assert_allclose([b.min for b in boxes], [p.min(axis=0) for p in cells.polygons()])


def test_holes_are_holes():
    frame = vq.Polygon([[0, 0], [3, 0], [3, 3], [0, 3]], holes=[[[1, 1], [2, 1], [2, 2], [1, 2]]])
    (patches,) = vq.cells([[0.5, 1.5]], domain=frame).plot().collections
    (path,) = patches.get_paths()
    rings = path.to_polygons()
    twice = [np.cross(ring[:-1], ring[1:]).sum() for ring in (np.pad(r, ((0, 0), (0, 1))) for r in rings)]
    assert sorted(np.abs(twice)) == [2, 18]
    assert np.sign(twice).sum() == 0  # filled once or not at all, by either rule


def test_cells_of_a_disc_end_at_its_rim():
    points = [[0.2, 0.5], [0.8, 0.5]]
    ax = vq.cells(points, domain="ball").plot([0, 1], cmap=CMAP)
    ax.set(xlim=(0, 1), ylim=(0, 1))
    ax.axis("off")
    ax.figure.canvas.draw()
    picture = np.asarray(ax.figure.canvas.buffer_rgba())[..., :3]
    for place, shade in (((0.1, 0.5), 0), ((0.9, 0.5), 255), ((0.02, 0.02), 255), ((0.02, 0.98), 255)):
        column, row = ax.transData.transform(place)
        colour = picture[len(picture) - 1 - int(row), int(column)]
        assert (colour == shade).all(), place  # black and white cells, and white paper beyond the rim


def test_in_space_faces_are_shaded_and_apart():
    ax = vq.cells([[0.25, 0.5, 0.5], [0.75, 0.5, 0.5]]).plot(cmap=CMAP)
    (faces,) = ax.collections
    assert len(faces.get_facecolor()) == 12
    assert not faces.get_facecolor()[:, :3].any()  # black stays black
    light = vq.cells([[0.25, 0.5, 0.5], [0.5, 0.5, 0.5]]).plot([1, 0], cmap=CMAP).collections[0]
    shades = np.unique(light.get_facecolor()[:, 0])
    np.testing.assert_allclose(shades, [0, 0.55, 0.7075, 0.775, 0.9055])  # away from the light, and by each axis
    white = vq.cells([[0.25, 0.5, 0.5], [0.5, 0.5, 0.5]]).polyhedron(0)
    (top,) = (number for number, face in enumerate(white) if (face[:, 2] == 1).all())
    assert light.get_facecolor()[top, 0] > 0.6  # towards the light, as those away have 0.55


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: vq.cells([[0.5, 0.5]]).plot([1, 2]), r"values has shape \(2,\); give one for each of the points"),
        (lambda: vq.cells(np.full((2, 1, 2), 0.5)).plot(), "plot needs one set of points"),
        (lambda: vq.cells([[0.5] * 3], domain="ball").plot(), "cells in a ball have measures but no polyhedra"),
        (lambda: vq.cells([[0.5] * 3]).plot(ax=plt.figure().add_subplot()), "need an ax with projection='3d'"),
        (lambda: vq.cells([0.5]).plot(ax=plt.figure().add_subplot(projection="3d")), "need an ax without"),
    ],
)
def test_refuses(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_says_what_is_missing():
    program = (
        "import sys; sys.modules['matplotlib.pyplot'] = None; import voroquad as vq\n"
        "try: vq.cells([0.5]).plot()\n"
        "except ImportError as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert "pip install '.[study]'" in done.stdout
