"""Scenes: where they are, what files they name, their integrators; errors of one line."""

from __future__ import annotations

import hashlib
import os
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mitsuba as mi

from .._support.checks import positive_int

SCENES = Path(__file__).parent / "scenes"
VARIANT, SPECTRAL_VARIANT = "llvm_ad_rgb", "llvm_ad_spectral"
#: Of an image: its sums take some hundred bytes a pixel
MOST_PIXELS = 2**27


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


def use_variant(domain: str = "") -> None:
    """Set a Mitsuba variant with just-in-time compilation, spectral where the domain needs it, unless one is set."""
    spectral = "wavelength" in domain.split("+")
    if mi.variant() is None or mi.variant().startswith("scalar"):
        mi.set_variant(SPECTRAL_VARIANT if spectral else VARIANT)


@contextmanager
def one_line_errors() -> Iterator[None]:
    """Turn Mitsuba's errors, which carry tracebacks and parser positions, into a ValueError of one line."""
    try:
        yield
    except RuntimeError as error:
        if "KeyboardInterrupt" in str(error) or isinstance(error.__cause__, KeyboardInterrupt):
            raise KeyboardInterrupt from None  # it passed through a callback of Mitsuba's
        raise ValueError(_message(error)) from None


def _message(error: BaseException) -> str:
    """The message of the error that started it all."""
    cause = error.__cause__
    if cause is not None:
        return _message(cause)
    text = str(error)
    raised = re.findall(r"^\w*(?:Error|Exception): (.*)$", text, re.MULTILINE)
    text = raised[-1] if raised else re.sub(r"\[\w+\.cpp:\d+\] ", "", text)
    return " ".join(text.split())


def load_scene(scene: str | os.PathLike[str], size: tuple[int, int] | None = None, domain: str = "") -> mi.Scene:
    """Load a scene, with its film resized to (width, height) if `size` is given.

    Where no variant is set, one is that has the `domain`.

    Raises
    ------
    ValueError
        There is no such scene, it is malformed, or it has no sensor.
    """
    path = scene_path(scene)
    use_variant(domain)
    with one_line_errors():
        loaded = mi.load_file(str(path))
    if not isinstance(loaded, mi.Scene) or not loaded.sensors():
        raise ValueError(f"{os.fspath(path)!r} describes no scene with a sensor")
    if size is not None:
        parameters = mi.traverse(loaded.sensors()[0])
        parameters["film.size"] = size
        parameters.update()
    return loaded


def own_integrator(scene: mi.Scene) -> mi.Integrator:
    """The scene's integrator, or the one inside if that is a plug-in of ours; a path tracer if it names none."""
    own = scene.integrator()
    if own is None:
        return mi.load_dict({"type": "path"})
    return own.nested if hasattr(own, "nested") else own


def motion_of(scene: mi.Scene) -> dict[str, Any]:
    """The properties by which the scene's integrator ``reweighted`` moves objects; none if it is another."""
    return dict(getattr(scene.integrator(), "keys", {}))


def make_integrator(kind: str, nested: mi.Integrator, **properties: Any) -> mi.Integrator:
    """The plug-in ``plain`` or ``reweighted`` around `nested`."""
    with one_line_errors():
        return mi.load_dict({"type": kind, "nested": nested, **properties})


def scene_files(path: Path) -> list[Path]:
    """An XML scene and the files that it names: textures, meshes, included scenes and theirs."""
    files = dict.fromkeys([path])
    for element in ElementTree.parse(path).iter():
        name = element.get("filename") if element.tag == "include" else None
        if element.tag == "string" and element.get("name", "").endswith("filename"):
            name = element.get("value")
        if not name or not (path.parent / name).is_file():
            continue
        found = path.parent / name
        files |= dict.fromkeys(scene_files(found) if element.tag == "include" else [found])
    return list(files)


def scene_hash(path: Path) -> str:
    """A hash of a scene and of the files that it names."""
    digest = hashlib.sha256()
    for file in scene_files(path):
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()
