"""Weighted sample sets against other samplers at equal samples per pixel, and one reference."""

from __future__ import annotations

import csv
import os
import shlex
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from .._checks import positive_int
from .._files import atomic_directory
from .._progress import progress_bar
from ..results import Figure, ImageComparison, Plot, Rendering, Results, Section
from ..samplers import sample
from .figures import Window, closeup_windows, difference_png, image_png, line_style, mse_figure
from .render import Image, check_seed, load_scene, make_integrator, own_integrator, render_image, rgb, srgb, write_image

Advance = Callable[[str, int], None]

REFERENCE_FACTOR = 16  # samples of the reference over the most samples of a method
MAX_WAVEFRONT = 2**26  # rays of the reference in flight: about 1 GiB


@dataclass(frozen=True)
class Method:
    """A way to sample the domain; all else is the same for all methods."""

    name: str
    label: str
    kind: str  # plug-in around the nested integrator
    properties: dict[str, Any]

    def integrator(self, nested: mi.Integrator, domain: str, jitter: bool, seed: int) -> mi.Integrator:
        """The plug-in."""
        own: dict[str, Any] = {"jitter": jitter}
        if self.kind == "reweighted":
            own |= {"domain": domain, "blend": "off", "table_seed": seed}
        return make_integrator(self.kind, nested, **own, **self.properties)


def _sets(design: str, weighted: bool) -> dict[str, Any]:
    return {"sampler": design, "weighted": weighted}


METHODS = (
    Method("uniform", "uniform", "reweighted", _sets("uniform", False)),
    Method("uniform-w", "uniform + w", "reweighted", _sets("uniform", True)),
    Method("stratified", "stratified", "reweighted", _sets("stratified", False)),
    Method("stratified-w", "stratified + w", "reweighted", _sets("stratified", True)),
    Method("zero-two", "zero-two", "reweighted", _sets("zero-two", False)),
    Method("sobol", "Sobol'", "reweighted", _sets("sobol", False)),
    Method("sobol-w", "Sobol' + w", "reweighted", _sets("sobol", True)),
    Method("halton", "Halton", "reweighted", _sets("halton", False)),
    Method("independent", "Mitsuba independent", "plain", {"scene_sampler": {"type": "independent"}}),
    Method("multijitter", "Mitsuba multijitter", "plain", {"scene_sampler": {"type": "multijitter"}}),
)


@dataclass
class Measurement:
    """One image against the reference."""

    method: Method
    spp: int
    image: Image
    mse: float
    flip: float
    seconds: float


@dataclass
class Reference:
    """The mean of independent rounds and what is known of its error."""

    image: Image
    spp: int
    rounds: int
    mse: float  # estimated from its two halves


def compare(
    scene: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    domain: str = "lens",
    spp: Sequence[int] = (16, 64, 256),
    size: tuple[int, int] | None = None,
    seed: int = 0,
    jitter: bool = False,
    show_progress: bool = True,
) -> Results:
    """Render a scene by every method at equal samples per pixel and measure the errors.

    Parameters
    ----------
    scene : str or path
        Mitsuba XML file, or the name of a built-in scene.
    out : str or path
        Folder for images (EXR and PNG), differences, close-ups, ``errors.csv``, the plot of the errors and
        ``results.json``. Written whole or not at all.
    domain : str
        What the sets sample, see :class:`voroquad.mitsuba.integrator.Reweighted`.
    spp : sequence of int
        Samples per pixel.
    size : (int, int), optional
        Width and height in pixels; by default those of the scene.
    seed : int
        Seed of everything random. Methods on the same design share their samples.
    jitter : bool
        Sample the pixel's area? If false, every method, Mitsuba's own samplers too, samples the pixel's centre.
    show_progress : bool
        A progress bar on standard error.

    Returns
    -------
    Results
        What was also written as ``results.json``.

    Raises
    ------
    ValueError
        There is no such scene or it is malformed, the sensor lacks the domain, or a sampler cannot make sets of
        one of the sizes.

    Notes
    -----
    All methods run the scene's own integrator. The reference takes 16 times the samples of the largest spp:
    rounds of independent unweighted Owen-scrambled Sobol' sets, averaged. Half the rounds against the other half,
    mean((A − B)²)/4, estimates its own mean squared error; it is in ``errors.csv``.
    """
    check_seed(seed)
    spp = sorted({positive_int("spp", n) for n in spp})
    loaded = load_scene(scene, size, domain)
    _check(loaded, domain, spp, jitter)

    total = REFERENCE_FACTOR * max(spp) + len(METHODS) * sum(spp)
    with progress_bar(total, show=show_progress) as advance, atomic_directory(out) as folder:
        reference = make_reference(loaded, domain, jitter, max(spp), seed, advance)
        measured = []
        for n in spp:
            for method in METHODS:
                advance(f"{method.label}, {n} spp", 0)
                measured.append(measure(loaded, method, reference, domain, jitter, n, seed))
                advance(f"{method.label}, {n} spp", n)
        command = _command(scene, out, domain, spp, size, seed, jitter)
        title = f"{Path(scene).stem}: renderings compared"
        results = Results(title, command, _sections(folder, reference, measured, jitter))
        results.write(folder)
    return results


def summary(results: Results, out: str | os.PathLike[str]) -> dict[str, Any]:
    """What ``voroquad compare --json`` prints: the folder and the errors of each image."""
    with (Path(out) / "errors.csv").open(newline="", encoding="utf-8") as file:
        rows = [{k: v if k == "method" else float(v) for k, v in row.items()} for row in csv.DictReader(file)]
    return {"output": os.fspath(out), "command": results.command, "errors": rows}


def _check(scene: mi.Scene, domain: str, spp: Sequence[int], jitter: bool) -> None:
    """Find what would fail half-way: ValueError before anything is rendered."""
    nested = own_integrator(scene)
    for method in METHODS:
        integrator = method.integrator(nested, domain, jitter, seed=0)
        if method.kind == "reweighted":
            integrator.check(scene, scene.sensors()[0])
            for n in spp:
                sample(method.properties["sampler"], n, integrator.domain.dimension, rng=0)
    for n in spp:
        granted = mi.load_dict({"type": "multijitter", "sample_count": n}).sample_count()
        if granted != n:
            raise ValueError(f"Mitsuba's multijitter sampler makes {granted} samples of spp={n}; take spp={granted}")


def make_reference(scene: mi.Scene, domain: str, jitter: bool, most: int, seed: int, advance: Advance) -> Reference:
    """The mean of at least two rounds of Sobol' sets, as large as the wavefront allows."""
    total = REFERENCE_FACTOR * most
    n = total // 2
    while n % 2 == 0 and n * int(np.prod(scene.sensors()[0].film().crop_size())) > MAX_WAVEFRONT:
        n //= 2
    rounds = total // n
    method = Method("reference", "reference", "reweighted", _sets("sobol", False))
    halves: list[Any] = [0.0, 0.0]
    for k in range(rounds):
        integrator = method.integrator(own_integrator(scene), domain, jitter, seed=_seed(seed, 1, k))
        halves[k % 2] += render_image(scene, integrator, n, _seed(seed, 2, k))
        advance(f"reference, round {k + 1} of {rounds}", n)
    a, b = (half / (rounds // 2) for half in halves)
    return Reference((a + b) / 2, total, rounds, float(np.mean((a - b)[..., :3] ** 2)) / 4)


def measure(
    scene: mi.Scene, method: Method, reference: Reference, domain: str, jitter: bool, spp: int, seed: int
) -> Measurement:
    """Render by one method; its mean squared error and mean ꟻLIP against the reference."""
    integrator = method.integrator(own_integrator(scene), domain, jitter, seed=_seed(seed, 3, spp))
    start = time.perf_counter()
    image = render_image(scene, integrator, spp, _seed(seed, 4, spp))
    seconds = time.perf_counter() - start
    mse = float(np.mean((image - reference.image)[..., :3] ** 2))
    return Measurement(method, spp, image, mse, mean_flip(reference.image, image), seconds)


def mean_flip(reference: Image, image: Image) -> float:
    """Mean ꟻLIP of the images as shown (sRGB, clipped), 0 to 1."""
    import flip_evaluator

    shown = [srgb(rgb(x)).astype(np.float32) for x in (reference, image)]
    _, mean, _ = flip_evaluator.evaluate(*shown, "LDR", inputsRGB=True, applyMagma=False, computeMeanError=True)
    return float(mean)


def _seed(*key: int) -> int:
    """A 32-bit seed for a purpose, independent of the others."""
    return int(np.random.SeedSequence(key).generate_state(1)[0] >> np.uint32(1))


def slope(spp: Sequence[int], mse: Sequence[float]) -> float | None:
    """Slope of log MSE against log spp by least squares; None for a single spp."""
    if len(spp) < 2:
        return None
    return float(np.polyfit(np.log(spp), np.log(mse), 1)[0])


# ---------------------------------------------------------------------- what is left in the folder


def _sections(folder: Path, reference: Reference, measured: list[Measurement], jitter: bool) -> list[Section]:
    """Write images, numbers and plot; say what they are."""
    for name in ("images", "differences", "closeups"):
        (folder / name).mkdir()
    write_image(reference.image, folder / "images" / "reference.exr")
    write_image(reference.image, folder / "images" / "reference.png")
    for m in measured:
        write_image(m.image, folder / "images" / f"{_stem(m)}.exr")
        write_image(m.image, folder / "images" / f"{_stem(m)}.png")

    spp = sorted({m.spp for m in measured})
    _write_errors(folder / "errors.csv", reference, measured)
    mse_figure(folder / "mse", {method.label: _curve(measured, method) for method in METHODS}, reference.mse)
    _write_differences(folder / "differences", reference, measured, _middle(spp))
    windows = _write_closeups(folder / "closeups", reference, [m for m in measured if m.spp == _middle(spp)])
    where = "the pixel's area" if jitter else "the pixel's centre"
    comparison = ImageComparison(
        "images/reference.exr",
        [Rendering(m.method.label, m.spp, f"images/{_stem(m)}.exr") for m in measured],
        "errors.csv",
        METHODS[0].label,
        "Two renderings under a divider, and what they miss of the reference. Below, all methods at equal samples per "
        "pixel in the window marked in the image, which is where uniform samples err most, or in the view once "
        "zoomed; each with its error on the one scale of the colour bar.",
        [[w[1].start, w[0].start, w[1].stop - w[1].start, w[0].stop - w[0].start] for w in windows],
    )
    mse = "mean squared error"
    error_figure = Figure(
        "mse.png",
        "Mean squared error against samples per pixel and against render time; weighted sets solid, others dashed. "
        "Beside each line's name, the slope of log MSE by least squares.",
        "Log-log plot of the mean squared error of each method",
        "mse.svg",
        "errors.csv",
        [Plot("spp", "mse", "samples per pixel", mse, None, 1), Plot("seconds", "mse", "seconds", mse, None, 0)],
        lines={method.label: line_style(method.label) for method in METHODS},
    )
    return [
        Section(
            "Images",
            f"All methods render the scene's own integrator and sample {where}, at equal samples per pixel. The "
            f"reference is the mean of {reference.rounds} rounds of unweighted Sobol' sets, {reference.spp} samples "
            f"per pixel in all; half of it against the other half puts its own MSE at {reference.mse:.2g}.",
            comparisons=[comparison],
        ),
        Section("Errors", figures=[error_figure]),
    ]


def _stem(m: Measurement) -> str:
    return f"{m.method.name}-{m.spp}"


def _curve(measured: list[Measurement], method: Method) -> tuple[list[int], list[float], float | None]:
    own = [m for m in measured if m.method is method]
    spp, mse = [m.spp for m in own], [m.mse for m in own]
    return spp, mse, slope(spp, mse)


def _write_errors(path: Path, reference: Reference, measured: list[Measurement]) -> None:
    plain = {m.spp: m.mse for m in measured if m.method.name == "uniform"}
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["method", "spp", "mse", "uniform_mse_over_mse", "flip", "seconds", "reference_mse"])
        for m in measured:
            ratio = f"{plain[m.spp] / m.mse:.3f}" if m.mse > 0 else "inf"
            numbers = (f"{m.mse:.4e}", ratio, f"{m.flip:.5f}", f"{m.seconds:.3f}", f"{reference.mse:.2e}")
            writer.writerow([m.method.label, m.spp, *numbers])


def _write_differences(folder: Path, reference: Reference, measured: list[Measurement], middle: int) -> None:
    """Signed differences of all images, mean of the channels, on one scale: three rms errors of uniform at `middle`."""
    errors = {(m.method.name, m.spp): (m.image - reference.image)[..., :3].mean(-1) for m in measured}
    scale = 3 * float(np.sqrt(np.mean(errors["uniform", middle] ** 2)))
    for (name, n), error in errors.items():
        difference_png(error, scale, folder / f"{name}-{n}.png")


def _write_closeups(folder: Path, reference: Reference, measured: list[Measurement]) -> list[Window]:
    """Windows where uniform samples err most, as each method renders them at one spp."""
    images = {m.method.name: m.image for m in measured}
    windows = closeup_windows((images["uniform"] - reference.image)[..., :3])
    for name, image in [("reference", reference.image), *images.items()]:
        for k, window in enumerate(windows):
            image_png(image[window], folder / f"{name}-{k + 1}.png", magnify=4)
    return windows


def _middle(spp: list[int]) -> int:
    """The spp at which images are shown."""
    return spp[len(spp) // 2]


def _command(
    scene: str | os.PathLike[str],
    out: str | os.PathLike[str],
    domain: str,
    spp: Sequence[int],
    size: tuple[int, int] | None,
    seed: int,
    jitter: bool,
) -> str:
    command = ["voroquad", "compare", os.fspath(scene), "-o", os.fspath(out), "--domain", domain]
    command += ["--spp", ",".join(map(str, spp)), "--jitter" if jitter else "--no-jitter", "--seed", str(seed)]
    return shlex.join(command + (["--size", f"{size[0]}x{size[1]}"] if size else []))
