"""Makes the scene sky: things under an environment map, made here too.

    python scenes/sky.py

The sky is bright around a veiled sun, and blue elsewhere. Path tracing with multiple importance sampling and three
bounces: the light is most of the noise on rough things, the reflection on glossy ones.
"""

from __future__ import annotations

from pathlib import Path

import common as c
import mitsuba as mi
import numpy as np
from common import add, move, scale, turn

NAME = "sky"
HEIGHT = 64  # of the map in pixels


def sky() -> np.ndarray:
    """Radiance (HEIGHT, 2 HEIGHT, 3) by direction: longitude and latitude."""
    polar = (np.arange(HEIGHT) + 0.5) / HEIGHT * np.pi
    around = (np.arange(2 * HEIGHT) + 0.5) / HEIGHT * np.pi
    theta, phi = np.meshgrid(polar, around, indexing="ij")
    direction = np.stack([np.sin(phi) * np.sin(theta), np.cos(theta), -np.cos(phi) * np.sin(theta)], -1)
    sun = np.array([-0.45, 0.62, 0.64])
    towards = np.clip(direction @ (sun / np.linalg.norm(sun)), 0, 1)[..., None]
    up = np.clip(direction[..., 1:2], 0, 1) ** 0.6
    blue = (1 - up) * [0.75, 0.78, 0.80] + up * [0.16, 0.32, 0.70]
    ground = np.array([0.10, 0.09, 0.08])
    veil = 14 * towards**160 + 1.5 * towards**12
    return np.where(direction[..., 1:2] > 0, blue + veil * [1.0, 0.93, 0.80], ground)


def make(folder: Path) -> Path:
    """Make the scene and its map in `folder`; returns the path of its XML file."""
    (folder / "maps").mkdir(parents=True, exist_ok=True)
    mi.Bitmap(sky().astype(np.float16)).write(str(folder / "maps" / "sky.exr"))

    root = c.new_scene("sky.py")
    c.add_integrator(root, "path", max_depth=4)
    camera = c.add_camera(root, "perspective", 40)
    c.look_at(camera, [0.3, 1.5, 5.6], [0, 0.7, 0])
    map_ = add(root, "emitter", type="envmap")
    add(map_, "string", name="filename", value="maps/sky.exr")

    c.checks(root, "floor", [0.55, 0.53, 0.50], [0.20, 0.20, 0.21], 20)
    c.diffuse(root, "clay", [0.60, 0.38, 0.26])
    c.plastic(root, "green", [0.07, 0.32, 0.16])
    metal = add(root, "bsdf", type="roughconductor", id="metal")
    add(metal, "string", name="material", value="none")
    add(metal, "rgb", name="specular_reflectance", value=[0.93, 0.88, 0.80])
    add(metal, "float", name="alpha", value=0.25)
    c.shape(root, "rectangle", "floor", turn("x", -90), scale(10))
    c.sphere(root, "clay", [-1.25, 0.7, -0.2], 0.7)
    c.sphere(root, "green", [0.35, 0.55, 0.5], 0.55)
    c.sphere(root, "metal", [1.6, 0.6, -0.5], 0.6)
    for k in range(7):
        c.shape(root, "cube", "clay", scale(0.05, 0.55, 0.05), turn("y", 20 * k), move(-1.8 + 0.6 * k, 0.55, -1.6))
    return c.write(root, folder, NAME)


if __name__ == "__main__":
    c.main(NAME, make)
