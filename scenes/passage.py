"""Makes the scene passage: a moving camera with a lens, glossy things, a sky and a lamp.

    python scenes/passage.py

Everything makes noise at once: the time, the lens, two kinds of light and three bounces. Weights on the time must not
hurt.
"""

from __future__ import annotations

from pathlib import Path

import common as c
from common import add, move, scale, turn

NAME = "passage"


def make(folder: Path) -> Path:
    """Make the scene in `folder`; returns the path of its XML file."""
    root = c.new_scene("passage.py")
    c.add_integrator(root, "path", max_depth=4)
    moving = add(root, "sensor", type="moving")
    c.add_camera(moving, "thinlens", 44, aperture_radius=0.04, focus_distance=4.6, shutter_open=0, shutter_close=1)
    c.look_at(moving, [-0.25, 1.3, 4.9], [-0.1, 0.7, 0], name="to_world@0")
    c.look_at(moving, [0.25, 1.35, 4.7], [0.05, 0.7, 0], name="to_world@1")

    add(add(root, "emitter", type="constant"), "rgb", name="radiance", value=[0.30, 0.38, 0.50])
    c.checks(root, "floor", [0.50, 0.48, 0.46], [0.12, 0.13, 0.15], 22)
    c.diffuse(root, "pillar", [0.62, 0.58, 0.50])
    c.plastic(root, "glossy", [0.60, 0.12, 0.08], 0.15)
    metal = add(root, "bsdf", type="roughconductor", id="metal")
    add(metal, "string", name="material", value="none")
    add(metal, "rgb", name="specular_reflectance", value=[0.90, 0.90, 0.93])
    add(metal, "float", name="alpha", value=0.2)

    c.shape(root, "rectangle", "floor", turn("x", -90), scale(10))
    lamp = c.shape(root, "rectangle", "pillar", turn("x", 90), scale(0.7, 1, 0.7), move(-1.2, 3.2, 0.4))
    add(add(lamp, "emitter", type="area"), "rgb", name="radiance", value=[14, 12, 9])
    for k in range(8):
        c.shape(root, "cube", "pillar", scale(0.12, 0.9, 0.12), move(-2.1 + 1.4 * (k % 4), 0.9, -0.6 - 1.6 * (k // 4)))
    c.sphere(root, "glossy", [-0.7, 0.45, 0.9], 0.45)
    c.sphere(root, "metal", [0.75, 0.5, 0.4], 0.5)
    return c.write(root, folder, NAME)


if __name__ == "__main__":
    c.main(NAME, make)
