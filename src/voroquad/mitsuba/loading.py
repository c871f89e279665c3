"""Scenes: finding and loading them, their sensors and integrators."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi

from .._support.checks import one_of, positive_int
from .._support.memory import physical_memory
from .dependencies import check_nesting
from .errors import one_line_errors

SCENES = Path(__file__).parent / "scenes"
VARIANT, SPECTRAL_VARIANT = "llvm_ad_rgb", "llvm_ad_spectral"
#: Channels that show what camera rays meet first, and what Mitsuba's ``aov`` calls them
FIRST_HITS = {"albedo": "albedo", "normal": "sh_normal", "depth": "depth"}
#: Of an image
MOST_PIXELS = 2**27
#: Bytes that the sums of a pixel take
BYTES_PER_PIXEL = 150


def built_in_scenes() -> list[str]:
    """Names of the scenes that come with the package."""
    return sorted(path.parent.name for path in SCENES.glob("*/*.xml"))


def scene_path(scene: str | os.PathLike[str]) -> Path:
    """The XML file of a scene given by its path or by the name of a built-in one."""
    path = SCENES / scene / f"{scene}.xml" if scene in built_in_scenes() else Path(scene)
    if not path.is_file():
        names = ", ".join(built_in_scenes())
        raise ValueError(
            f"there is no scene {os.fspath(scene)!r}; give the path of a Mitsuba XML file or one of {names}"
        )
    return path


def parse_size(text: str | None) -> tuple[int, int] | None:
    """Read "320x240"."""
    if text is None:
        return None
    match = re.fullmatch(r"(\d+)x(\d+)", text)
    if match is None:
        raise ValueError(f"size must look like 320x240, got {text!r}")
    width, height = positive_int("width", int(match[1])), positive_int("height", int(match[2]))
    if width * height > MOST_PIXELS:
        raise ValueError(f"size {text} has {width * height} pixels; take {MOST_PIXELS} at most")
    return width, height


def parse_parameters(texts: Iterable[str]) -> dict[str, str]:
    """Read the values of a scene's ``$name`` parameters: "name=value" each."""
    values: dict[str, str] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals):
            raise ValueError(f"a parameter of the scene must look like name=value, got {text!r}")
        if values.setdefault(name, value) != value:
            raise ValueError(f"parameter {name!r} is given twice: {values[name]!r} and {value!r}; give it once")
    return values


def default_variant(domain: str) -> str:
    """The variant that is taken where none is named: spectral for the domain ``wavelength``, else rgb."""
    return SPECTRAL_VARIANT if "wavelength" in domain.split("+") else VARIANT


def use_variant(domain: str = "", variant: str | None = None) -> None:
    """Set a Mitsuba variant, one with just-in-time compilation.

    Parameters
    ----------
    domain : str
        Where no variant is named or set, the spectral one is taken for the domain ``wavelength``, else the rgb one.
    variant : str, optional
        Name of a variant of the installed Mitsuba.
    """
    if variant is not None:
        compiled = [name for name in mi.variants() if not name.startswith("scalar")]
        chosen = one_of("variant", variant, compiled)
        if chosen.startswith("cuda") and not dr.has_backend(dr.JitBackend.CUDA):
            raise ValueError(f"variant {chosen!r} needs an NVIDIA GPU and its driver, and there is none; take 'llvm_…'")
        mi.set_variant(chosen)
    elif mi.variant() is None or mi.variant().startswith("scalar"):
        mi.set_variant(default_variant(domain))


def load_scene(
    scene: str | os.PathLike[str],
    size: tuple[int, int] | None = None,
    domain: str = "",
    *,
    parameters: Mapping[str, str] | None = None,
    sensor: int = 0,
) -> mi.Scene:
    """Load a scene.

    Parameters
    ----------
    scene : str or path
        Mitsuba XML file, or the name of a built-in scene.
    size : (int, int), optional
        Width and height of the sensor's film in pixels, in place of the scene's.
    domain : str
        Where no variant is set, one is that has this domain.
    parameters : mapping of str to str, optional
        Values of the scene's ``$name`` parameters.
    sensor : int
        Number of the sensor, from 0.

    Raises
    ------
    ValueError
        There is no such scene, it is malformed, it lacks the sensor, or the film has no pixels or too many.
    """
    path = scene_path(scene)
    use_variant(domain)
    check_nesting(path, parameters)
    with one_line_errors():
        loaded = mi.load_file(str(path), **(parameters or {}))
    if not isinstance(loaded, mi.Scene) or not loaded.sensors():
        raise ValueError(f"{os.fspath(path)!r} describes no scene with a sensor")
    found = find_sensor(loaded, sensor)
    if size is not None:
        changed = mi.traverse(found)
        changed["film.size"] = size
        changed.update()
    check_film(found.film())
    return loaded


def find_sensor(scene: mi.Scene, number: int) -> mi.Sensor:
    """The sensor of that number, from 0."""
    sensors = scene.sensors()
    if not 0 <= number < len(sensors):
        raise ValueError(f"sensor must be a whole number from 0 to {len(sensors) - 1}, got {number}")
    return sensors[number]


def check_film(film: mi.Film) -> None:
    """Raise ValueError for a film with no pixels, or with more than there is memory for."""
    width, height = (int(n) for n in film.crop_size())
    if not 0 < width * height <= MOST_PIXELS:
        raise ValueError(
            f"the film has {width} x {height} pixels; give the scene's film a width and a height of 1 or more, "
            f"and {MOST_PIXELS} pixels at most"
        )
    needed, there = width * height * BYTES_PER_PIXEL, physical_memory()
    if needed > there:
        raise ValueError(
            f"the film has {width} x {height} pixels, whose sums take {needed / 2**30:.1f} GiB, and this machine has "
            f"{there / 2**30:.1f} GiB; take fewer pixels"
        )


def own_integrator(scene: mi.Scene) -> mi.Integrator:
    """The scene's integrator, or the one nested in `plain` or `reweighted`; a path tracer if there is none."""
    own = scene.integrator()
    if own is None:
        return mi.load_dict({"type": "path"})
    return own.nested if hasattr(own, "nested") else own


def traced(scene: mi.Scene, channels: Sequence[str] = ()) -> mi.Integrator:
    """The scene's own integrator, inside an ``aov`` that adds channels of `FIRST_HITS` if any are wanted."""
    own = own_integrator(scene)
    if not channels:
        return own
    return mi.load_dict({"type": "aov", "aovs": ",".join(f"{c}:{FIRST_HITS[c]}" for c in channels), "image": own})


def motion_of(scene: mi.Scene) -> dict[str, Any]:
    """The properties by which the scene's integrator ``reweighted`` moves objects; none if it is another."""
    return dict(getattr(scene.integrator(), "keys", {}))


def make_integrator(kind: str, nested: mi.Integrator, **properties: Any) -> mi.Integrator:
    """The plug-in ``plain`` or ``reweighted`` around `nested`."""
    with one_line_errors():
        return mi.load_dict({"type": kind, "nested": nested, **properties})
