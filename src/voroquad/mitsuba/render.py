"""Load a scene, render it with weighted sample sets, write the image."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from .._checks import one_of, positive_int
from .._files import atomic_path

SCENES = Path(__file__).parent / "scenes"
VARIANT, SPECTRAL_VARIANT = "llvm_ad_rgb", "llvm_ad_spectral"

Image = NDArray[np.float64]


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
    return positive_int("width", int(match[1])), positive_int("height", int(match[2]))


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


def check_seed(seed: int) -> None:
    """Raise ValueError for a seed that Mitsuba, whose seeds have 32 bits, does not take."""
    if not 0 <= seed < 2**32:
        raise ValueError(f"seed must be a whole number from 0 to 2^32 − 1, got {seed}")


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


def render_image(scene: mi.Scene, integrator: mi.Integrator, spp: int, seed: int) -> Image:
    """Render to an array (height, width, channels) of linear radiance."""
    with one_line_errors():
        return np.array(mi.render(scene, integrator=integrator, spp=spp, seed=seed), dtype=np.float64)


def own_integrator(scene: mi.Scene) -> mi.Integrator:
    """The scene's integrator; a path tracer if it names none."""
    return scene.integrator() or mi.load_dict({"type": "path"})


def make_integrator(kind: str, nested: mi.Integrator, **properties: Any) -> mi.Integrator:
    """The plug-in ``plain`` or ``reweighted`` around `nested`."""
    with one_line_errors():
        return mi.load_dict({"type": kind, "nested": nested, **properties})


def write_image(image: Image, path: str | os.PathLike[str]) -> None:
    """Write an image, whole or not at all: linear as .exr, sRGB as .png."""
    suffix = one_of("image format", Path(path).suffix.lower(), (".exr", ".png"))
    with atomic_path(path) as temporary:
        if suffix == ".exr":
            mi.Bitmap(image.astype(np.float32)).write(str(temporary))
        else:
            mi.Bitmap((srgb(rgb(image)) * 255 + 0.5).astype(np.uint8)).write(str(temporary))


def rgb(image: Image) -> Image:
    """The colours (height, width, 3) of an image with or without alpha, grey or not."""
    return image[..., :3] if image.shape[-1] >= 3 else np.repeat(image[..., :1], 3, axis=-1)


def srgb(linear: Image) -> Image:
    """The sRGB transfer function (IEC 61966-2-1), clipped to [0, 1]."""
    clipped = np.clip(linear, 0, 1)
    return np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)


def render(
    scene: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    domain: str = "lens",
    spp: int = 64,
    sampler: str = "stratified",
    order: int = 0,
    debias: str = "none",
    weighted: bool = True,
    blend: str = "auto",
    jitter: bool = True,
    size: tuple[int, int] | None = None,
    seed: int = 0,
) -> dict[str, Any]:
    """Render a scene with its own integrator inside ``reweighted`` and write the image.

    Parameters
    ----------
    scene : str or path
        Mitsuba XML file, or the name of a built-in scene.
    out : str or path
        Image file to write: .exr (linear) or .png (sRGB).
    domain, sampler, order, debias, weighted, blend, jitter
        As the properties of the plug-in, :class:`voroquad.mitsuba.integrator.Reweighted`.
    spp : int
        Samples per pixel.
    size : (int, int), optional
        Width and height in pixels; by default those of the scene.
    seed : int
        Seed of the table and of the rendering.

    Returns
    -------
    dict
        The path written, the size, and the mean radiance.

    Raises
    ------
    ValueError
        There is no such scene or it is malformed; the scene lacks the domain; what the plug-in refuses.
    """
    spp = positive_int("spp", spp)
    check_seed(seed)
    one_of("image format", Path(out).suffix.lower(), (".exr", ".png"))
    loaded = load_scene(scene, size, domain)
    integrator = make_integrator(
        "reweighted",
        own_integrator(loaded),
        domain=domain,
        sampler=sampler,
        order=order,
        debias=debias,
        weighted=weighted,
        blend=blend,
        jitter=jitter,
        table_seed=seed,
    )
    image = render_image(loaded, integrator, spp, seed)
    write_image(image, out)
    height, width = image.shape[:2]
    return {
        "output": os.fspath(out),
        "width": width,
        "height": height,
        "spp": spp,
        "mean": float(image[..., :3].mean()),
    }
