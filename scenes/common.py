"""What the scenes' generators share: elements of Mitsuba's XML, with numbers of six digits."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from xml.etree import ElementTree as xml

import mitsuba as mi
import numpy as np

PACKAGE = Path(__file__).resolve().parent.parent / "src" / "voroquad" / "mitsuba" / "scenes"

Numbers = Sequence[float]


def add(parent: xml.Element, tag: str, **attributes: object) -> xml.Element:
    """Append an element; numbers and vectors are written with six digits."""

    def text(value: object) -> str:
        if isinstance(value, str):
            return value
        return ", ".join(f"{x:.6g}" for x in np.atleast_1d(np.asarray(value, float)))

    return xml.SubElement(parent, tag, {k: text(v) for k, v in attributes.items()})


def new_scene(generator: str, spp: int = 64) -> xml.Element:
    """A scene of 320×240 pixels; `mitsuba -D width=…` and alike change that."""
    root = xml.Element("scene", version="3.0.0")
    root.append(xml.Comment(f" Made by scenes/{generator} "))
    for name, value in (("width", 320), ("height", 240), ("spp", spp)):
        add(root, "default", name=name, value=value)
    return root


def add_integrator(parent: xml.Element, kind: str, **settings: int) -> xml.Element:
    """An integrator with whole numbers as settings."""
    integrator = add(parent, "integrator", type=kind)
    for name, value in settings.items():
        add(integrator, "integer", name=name, value=value)
    return integrator


def add_camera(parent: xml.Element, kind: str, fov: float, **settings: float) -> xml.Element:
    """A sensor with its film and sampler; fov across."""
    sensor = add(parent, "sensor", type=kind)
    add(sensor, "float", name="fov", value=fov)
    add(sensor, "string", name="fov_axis", value="x")
    for name, value in settings.items():
        add(sensor, "float", name=name, value=value)
    add(add(sensor, "sampler", type="independent"), "integer", name="sample_count", value="$spp")
    film = add(sensor, "film", type="hdrfilm")
    add(film, "integer", name="width", value="$width")
    add(film, "integer", name="height", value="$height")
    add(film, "rfilter", type="box")
    return sensor


def look_at(parent: xml.Element, origin: Numbers, target: Numbers, name: str = "to_world") -> None:
    """A transform that looks from one point to another, y up."""
    add(add(parent, "transform", name=name), "lookat", origin=origin, target=target, up=[0, 1, 0])


def place(parent: xml.Element, *steps: tuple[str, dict[str, object]], name: str = "to_world") -> None:
    """A transform of steps such as ("scale", {"value": 2}), the first applied first."""
    transform = add(parent, "transform", name=name)
    for tag, attributes in steps:
        add(transform, tag, **attributes)


def move(x: float, y: float, z: float) -> tuple[str, dict[str, object]]:
    """A step of `place`: translate."""
    return "translate", {"x": x, "y": y, "z": z}


def turn(axis: str, degrees: float) -> tuple[str, dict[str, object]]:
    """A step of `place`: rotate about x, y or z."""
    return "rotate", {axis: 1.0, "angle": degrees}


def scale(x: float, y: float | None = None, z: float | None = None) -> tuple[str, dict[str, object]]:
    """A step of `place`: scale."""
    return "scale", {"x": x, "y": x if y is None else y, "z": x if z is None else z}


def diffuse(parent: xml.Element, name: str, colour: Numbers) -> None:
    """A diffuse material to refer to."""
    add(add(parent, "bsdf", type="diffuse", id=name), "rgb", name="reflectance", value=colour)


def checks(parent: xml.Element, name: str, light: Numbers, dark: Numbers, squares: float) -> None:
    """A diffuse chequered material to refer to."""
    texture = add(add(parent, "bsdf", type="diffuse", id=name), "texture", type="checkerboard", name="reflectance")
    add(texture, "rgb", name="color0", value=light)
    add(texture, "rgb", name="color1", value=dark)
    place(texture, scale(squares), name="to_uv")


def plastic(parent: xml.Element, name: str, colour: Numbers, roughness: float = 0.12) -> None:
    """A glossy material to refer to."""
    bsdf = add(parent, "bsdf", type="roughplastic", id=name)
    add(bsdf, "rgb", name="diffuse_reflectance", value=colour)
    add(bsdf, "float", name="alpha", value=roughness)


def glow(shape: xml.Element, radiance: Numbers) -> None:
    """Constant fill light of a shape, which no emitter sample looks for: light from all around, without its noise."""
    emitter = add(shape, "emitter", type="area")
    add(emitter, "rgb", name="radiance", value=radiance)
    add(emitter, "float", name="sampling_weight", value=0)


def sphere(parent: xml.Element, material: str, centre: Numbers, radius: float, **attributes: object) -> xml.Element:
    """A sphere of a material."""
    shape = add(parent, "shape", type="sphere", **attributes)
    add(shape, "point", name="center", value=centre)
    add(shape, "float", name="radius", value=radius)
    add(shape, "ref", id=material)
    return shape


def shape(
    parent: xml.Element, kind: str, material: str, *steps: tuple[str, dict[str, object]], **attributes: object
) -> xml.Element:
    """A shape of a material, placed by steps."""
    made = add(parent, "shape", type=kind, **attributes)
    place(made, *steps)
    add(made, "ref", id=material)
    return made


def write(root: xml.Element, folder: Path, name: str) -> Path:
    """Write the scene into a folder; returns the path of its XML file."""
    xml.indent(root)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.xml"
    path.write_text(xml.tostring(root, encoding="unicode") + "\n", encoding="utf-8")
    return path


def main(name: str, make: Callable[[Path], Path]) -> None:
    """Make a scene in the package, or in the folder that the command line names."""
    mi.set_variant("llvm_ad_rgb")
    print(make(Path(sys.argv[1]) if len(sys.argv) > 1 else PACKAGE / name))
