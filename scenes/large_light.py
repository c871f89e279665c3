"""Makes the scene large-light: diffuse things under a large lamp, with fine bars between.

    python scenes/large_light.py

The integrator takes one emitter sample and nothing else, so that the light makes all of the noise: half-shadows of fine
occluders, whose edges no sample set knows.
"""

from __future__ import annotations

from pathlib import Path

import common as c
from common import add, move, scale, turn

NAME = "large-light"


def make(folder: Path) -> Path:
    """Make the scene in `folder`; returns the path of its XML file."""
    root = c.new_scene("large_light.py")
    c.add_integrator(root, "direct", emitter_samples=1, bsdf_samples=0)
    camera = c.add_camera(root, "perspective", 42)
    c.look_at(camera, [0, 2.1, 6.0], [0, 0.9, 0])

    c.diffuse(root, "wall", [0.72, 0.70, 0.66])
    c.diffuse(root, "bars", [0.22, 0.13, 0.08])
    c.diffuse(root, "red", [0.62, 0.12, 0.08])
    c.diffuse(root, "blue", [0.10, 0.24, 0.52])

    light = c.shape(root, "rectangle", "wall", turn("x", 75), scale(2.2, 1.6, 1.6), move(0, 4.2, 1.2))
    add(add(light, "emitter", type="area"), "rgb", name="radiance", value=[7.0, 6.6, 6.0])
    c.shape(root, "rectangle", "wall", turn("x", -90), scale(8))
    c.shape(root, "rectangle", "wall", scale(8), move(0, 0, -2.6))
    for k in range(9):  # a trellis
        bar = add(root, "shape", type="cylinder")
        add(bar, "point", name="p0", value=[-1.9 + 0.475 * k, 0, -0.9])
        add(bar, "point", name="p1", value=[-1.9 + 0.475 * k, 1.9, -0.9])
        add(bar, "float", name="radius", value=0.03)
        add(bar, "ref", id="bars")
    for k in range(3):
        bar = add(root, "shape", type="cylinder")
        add(bar, "point", name="p0", value=[-2.0, 0.45 + 0.65 * k, -0.9])
        add(bar, "point", name="p1", value=[2.0, 0.45 + 0.65 * k, -0.9])
        add(bar, "float", name="radius", value=0.025)
        add(bar, "ref", id="bars")
    c.sphere(root, "red", [-0.9, 0.5, 0.7], 0.5)
    c.shape(root, "cube", "blue", scale(0.38), turn("y", 32), move(0.95, 0.38, 0.6))
    return c.write(root, folder, NAME)


if __name__ == "__main__":
    c.main(NAME, make)
