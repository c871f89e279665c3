"""Makes the scene room: an interior with glossy things and metal, seen through a lens.

    python scenes/room.py

Everything makes noise at once: a lamp the size of a window, five bounces, a thin lens. Weights on the lens must not
hurt.
"""

from __future__ import annotations

from pathlib import Path

import common as c
import numpy as np
from common import add, move, scale, turn

NAME = "room"
EYE, TARGET = np.array([0.0, 1.25, 4.6]), np.array([0.0, 0.95, 0.0])


def make(folder: Path) -> Path:
    """Make the scene in `folder`; returns the path of its XML file."""
    root = c.new_scene("room.py")
    c.add_integrator(root, "path", max_depth=6)
    camera = c.add_camera(
        root, "thinlens", 46, aperture_radius=0.05, focus_distance=float(np.linalg.norm(TARGET - EYE))
    )
    c.look_at(camera, EYE, TARGET)

    c.diffuse(root, "white", [0.74, 0.72, 0.68])
    c.diffuse(root, "left", [0.55, 0.14, 0.10])
    c.diffuse(root, "right", [0.14, 0.36, 0.20])
    c.checks(root, "floor", [0.58, 0.52, 0.44], [0.22, 0.16, 0.12], 12)
    c.plastic(root, "glossy", [0.12, 0.22, 0.50])
    metal = add(root, "bsdf", type="roughconductor", id="metal")
    add(metal, "string", name="material", value="none")
    add(metal, "rgb", name="specular_reflectance", value=[0.95, 0.78, 0.45])
    add(metal, "float", name="alpha", value=0.3)

    c.shape(root, "rectangle", "floor", turn("x", -90), scale(2.2, 1, 5), move(0, 0, 0))
    c.shape(root, "rectangle", "white", turn("x", 90), scale(2.2, 1, 5), move(0, 2.4, 0))
    c.shape(root, "rectangle", "white", scale(2.2, 1.2, 1), move(0, 1.2, -2.2))
    c.shape(root, "rectangle", "left", turn("y", 90), scale(1, 1.2, 5), move(-2.2, 1.2, 0))
    c.shape(root, "rectangle", "right", turn("y", -90), scale(1, 1.2, 5), move(2.2, 1.2, 0))
    lamp = c.shape(root, "rectangle", "white", turn("x", 90), scale(0.8, 1, 0.5), move(0.2, 2.38, -0.6))
    add(add(lamp, "emitter", type="area"), "rgb", name="radiance", value=[11, 10, 8.5])

    c.sphere(root, "glossy", [-0.8, 0.42, 0.5], 0.42)
    c.sphere(root, "metal", [0.85, 0.45, -0.3], 0.45)
    c.shape(root, "cube", "glossy", scale(0.35, 0.6, 0.35), turn("y", 28), move(-0.7, 0.6, -1.1))
    for k in range(6):  # small things from near the lens to the wall
        c.sphere(root, "left" if k % 2 else "right", [1.3 - 0.34 * k, 0.12, 2.2 - 0.75 * k], 0.12)
    return c.write(root, folder, NAME)


if __name__ == "__main__":
    c.main(NAME, make)
