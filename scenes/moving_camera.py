"""Makes the scene moving-camera: the table of depth-of-field, seen sharply by a camera that moves and turns.

    python scenes/depth_of_field.py && python scenes/moving_camera.py

The meshes are those of depth-of-field, so is the light: one sun and a fill that needs no samples. A ray's radiance is a
function of the ray alone: what noise an image has comes from the time and the pixel.
"""

from __future__ import annotations

import copy
from pathlib import Path
from xml.etree import ElementTree as xml

import common as c
import numpy as np
from depth_of_field import EYE, TARGET

NAME = "moving-camera"


def make(folder: Path) -> Path:
    """Make the scene in `folder`, beside that of depth-of-field; returns the path of its XML file."""
    still = xml.parse(folder.parent / "depth-of-field" / "depth-of-field.xml").getroot()
    root = c.new_scene("moving_camera.py")
    for element in still:
        if element.tag in ("integrator", "emitter", "bsdf", "shape"):
            root.append(copy.deepcopy(element))
    for name in root.iterfind(".//string[@name='filename']"):
        name.set("value", f"../depth-of-field/{name.get('value')}")

    moving = c.add(root, "sensor", type="moving")
    c.add_camera(moving, "perspective", 36, shutter_open=0, shutter_close=1)
    # Past the table and a little down, turning to the knot
    c.look_at(moving, EYE + np.array([-0.14, 0.05, 0]), TARGET + np.array([-0.05, 0, 0]), name="to_world@0")
    c.look_at(moving, EYE, TARGET, name="to_world@0.5")
    c.look_at(moving, EYE + np.array([0.14, -0.02, 0.1]), TARGET + np.array([0.09, 0.02, 0]), name="to_world@1")
    return c.write(root, folder, NAME)


if __name__ == "__main__":
    c.main(NAME, make)
