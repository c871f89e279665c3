"""Makes the scene spectral: metals, pigments and coloured glass under a fluorescent lamp.

    python scenes/spectral.py

The lamp is far away and its light in narrow lines, as that of mercury and of the phosphors of a fluorescent tube is, so
that the wavelength makes most of the noise. It needs a spectral variant.
"""

from __future__ import annotations

from pathlib import Path

import common as c
import numpy as np
from common import add, move, scale, turn

NAME = "spectral"

#: Lines of the lamp: wavelength, width (standard deviation), height; in nm
LINES = ((405, 3, 1.2), (436, 3, 4.0), (487, 4, 1.4), (544, 3, 7.0), (585, 5, 1.6), (611, 3, 7.5), (630, 4, 1.0))
CONTINUUM = 0.05
#: Irradiance by the lamp, radiance of the wall and of all else around; means over the spectrum
BRIGHTNESS, WALL, SKY = 1.0, 0.06, 0.1


def lamp(wavelength: np.ndarray) -> np.ndarray:
    """Spectrum of the lamp, in units of its own."""
    return CONTINUUM + sum(h * np.exp(-0.5 * ((wavelength - at) / width) ** 2) for at, width, h in LINES)


def pigment(low: float, edge: float, high: float, width: float = 14) -> list[tuple[float, float]]:
    """Reflectance that rises, or falls, from one level to another around a wavelength."""
    nm = np.arange(360, 831, 10.0)
    return list(zip(nm, low + (high - low) / (1 + np.exp(-(nm - edge) / width)), strict=True))


def spectrum(parent: c.xml.Element, name: str, values: list[tuple[float, float]]) -> None:
    """A tabulated spectrum."""
    add(parent, "spectrum", name=name, value=", ".join(f"{nm:g}:{v:.4g}" for nm, v in values))


def make(folder: Path) -> Path:
    """Make the scene in `folder`; returns the path of its XML file."""
    root = c.new_scene("spectral.py")
    c.add_integrator(root, "path", max_depth=4)
    camera = c.add_camera(root, "perspective", 34)
    c.look_at(camera, [0, 1.7, 6.4], [0, 0.62, 0])

    sun = add(root, "emitter", type="directional")
    add(sun, "vector", name="direction", value=[0.5, -1.0, -0.55])
    nm = np.arange(360, 831, 1.0)
    light = lamp(nm) / lamp(nm).mean()
    spectrum(sun, "irradiance", list(zip(nm, BRIGHTNESS * light, strict=True)))

    # What shines all around, for the metals to mirror; no emitter sample looks for it
    sky = add(root, "emitter", type="constant")
    spectrum(sky, "radiance", list(zip(nm, SKY * light, strict=True)))
    add(sky, "float", name="sampling_weight", value=0)

    green = [(n, min(a, b)) for (n, a), (_, b) in zip(pigment(0.03, 495, 0.4), pigment(0.4, 570, 0.03), strict=True)]
    colours = {
        "red": pigment(0.03, 600, 0.6),
        "orange": pigment(0.04, 565, 0.65),
        "green": green,
        "blue": pigment(0.50, 490, 0.03),
        "floor": [(360, 0.16), (830, 0.16)],
    }
    for name, values in colours.items():
        spectrum(add(root, "bsdf", type="diffuse", id=name), "reflectance", values)
    for metal in ("Au", "Cu", "Ag"):
        add(add(root, "bsdf", type="conductor", id=metal), "string", name="material", value=metal)
    for name, values in (("ruby", pigment(0.05, 590, 0.95)), ("cobalt", pigment(0.95, 480, 0.10))):
        glass = add(root, "bsdf", type="thindielectric", id=name)
        spectrum(glass, "specular_transmittance", values)
        add(glass, "float", name="int_ior", value=1.000277)  # that of air: it colours and does not reflect

    c.shape(root, "rectangle", "floor", turn("x", -90), scale(9))
    # The wall shines in the lamp's light instead of being lit: what it sends needs no samples
    wall = c.shape(root, "rectangle", "floor", scale(9), move(0, 0, -3.2))
    spectrum(add(wall, "emitter", type="area"), "radiance", list(zip(nm, WALL * light, strict=True)))
    add(wall.find("emitter"), "float", name="sampling_weight", value=0)
    for k, metal in enumerate(("Au", "Cu", "Ag")):
        c.sphere(root, metal, [-1.35 + 1.35 * k, 0.55, -0.4], 0.55)
    for k, name in enumerate(("red", "orange", "green", "blue")):
        c.shape(root, "cube", name, scale(0.24), turn("y", 25), move(-1.5 + 1.0 * k, 0.24, 1.35))
    for k, name in enumerate(("ruby", "cobalt")):
        side = 2 * k - 1
        c.shape(root, "rectangle", name, scale(0.42, 0.75, 1), turn("y", -20 * side), move(0.95 * side, 0.75, 0.75))
    return c.write(root, folder, NAME)


if __name__ == "__main__":
    c.main(NAME, make)
