"""Makes the scene moving-objects: balls and a box that move, with their shadows, while the shutter is open.

    python scenes/moving_objects.py

The objects move in slices of time, by keyframes of the integrator ``reweighted``. One sun and constant fill light: a
ray's radiance is a function of time alone, so that what noise an image has comes from the motion.
"""

from __future__ import annotations

from pathlib import Path

import common as c
from common import add, glow, move, place, scale, turn

NAME = "moving-objects"


def make(folder: Path) -> Path:
    """Make the scene in `folder`; returns the path of its XML file."""
    root = c.new_scene("moving_objects.py")
    integrator = add(root, "integrator", type="reweighted")
    add(integrator, "string", name="domain", value="time")
    c.add_integrator(integrator, "direct", emitter_samples=1, bsdf_samples=0)
    camera = c.add_camera(root, "perspective", 38, shutter_open=0, shutter_close=1)
    c.look_at(camera, [0.4, 1.9, 7.2], [0.1, 0.55, 0])
    sun = add(root, "emitter", type="directional")
    add(sun, "vector", name="direction", value=[0.55, -0.9, -0.35])
    add(sun, "rgb", name="irradiance", value=[2.7, 2.5, 2.1])

    c.checks(root, "floor", [0.62, 0.60, 0.55], [0.10, 0.16, 0.20], 24)
    c.plastic(root, "red", [0.72, 0.10, 0.06])
    c.plastic(root, "blue", [0.08, 0.25, 0.60])
    c.plastic(root, "yellow", [0.80, 0.55, 0.08])
    glow(c.shape(root, "rectangle", "floor", turn("x", -90), scale(12)), [0.06, 0.07, 0.09])
    wall = c.shape(root, "rectangle", "floor", scale(12), move(0, 0, -6))
    glow(wall, [0.05, 0.06, 0.08])

    # What moves is placed by its keyframes
    for name, material, fill in (("ball", "red", [0.06, 0.02, 0.02]), ("hopper", "yellow", [0.07, 0.05, 0.02])):
        glow(add_ball(root, name, material), fill)
    glow(c.shape(root, "cube", "blue", scale(0.45), id="box"), [0.02, 0.03, 0.07])
    for k in range(5):  # what stands still, to compare with
        glow(c.sphere(root, "blue", [-3.4 + 1.7 * k, 0.3, -2.2], 0.3), [0.02, 0.03, 0.07])

    place(integrator, scale(0.55), move(-2.1, 0.55, 0.4), name="ball/to_world@0")
    place(integrator, scale(0.55), turn("z", -40), move(-1.72, 0.55, 0.5), name="ball/to_world@1")
    for time, (x, y) in {0: (1.6, 0.4), 0.5: (1.78, 0.75), 1: (1.96, 0.4)}.items():
        place(integrator, scale(0.4), move(x, y, 0.2), name=f"hopper/to_world@{time}")
    place(integrator, move(0.45, 0.47, -0.5), name="box/to_world@0")
    place(integrator, turn("y", 30), move(0.45, 0.47, -0.5), name="box/to_world@1")
    return c.write(root, folder, NAME)


def add_ball(root: c.xml.Element, name: str, material: str) -> c.xml.Element:
    """A unit sphere, named to be moved."""
    return c.sphere(root, material, [0, 0, 0], 1, id=name)


if __name__ == "__main__":
    c.main(NAME, make)
