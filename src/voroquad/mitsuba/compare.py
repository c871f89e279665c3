"""Weighted sample sets against other samplers at equal samples per pixel, and one reference."""

from __future__ import annotations

import csv
import os
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from .._support.checks import positive_int
from .._support.files import atomic_directory
from .._support.progress import progress_bar
from .._support.units import ONE_PROCESS, Advance, LocalFile, Pool
from ..results.equal_error import equal_error_ratio
from ..results.manifest import Figure, ImageComparison, ImageGrid, Plot, Rendering, Results, Section
from ..results.power_law import fit_power_law
from .bands import Camera, Shot, forgetting
from .default_domain import AUTO, settle_domain, tell
from .figures import Curve, Window, closeup_windows, difference_png, image_png, mse_figure, share_png
from .loading import default_variant, scene_path, use_variant
from .methods import SOBOL, UNIFORM, Method, Stage, methods_for
from .render import Image, check_seed, rgb, srgb, write_image

REFERENCE_FACTOR = 16  # samples of the reference over the most samples of a method
MAX_WAVEFRONT = 2**26  # rays of the reference in flight: about 1 GiB
RELATIVE_FLOOR = 1e-2  # added to the squared reference in the relative MSE


@dataclass
class Measurement:
    """Images of one method at one spp against the reference: the first of them, and means over all."""

    method: Method
    spp: int
    image: Image
    mse: float
    mse_error: float  # standard error over the images; NaN for one
    relmse: float
    flip: float
    seconds: float
    share: Image | None = None  # the blend's λ (height, width) in the image


@dataclass
class Reference:
    """The mean of independent rounds and what is known of its error."""

    image: Image
    spp: int
    rounds: int
    mse: float  # estimated from its two halves


@forgetting()
def compare(
    scene: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    domain: str = AUTO,
    spp: Sequence[int] = (16, 64, 256),
    methods: Sequence[str] | None = None,
    size: tuple[int, int] | None = None,
    parameters: Mapping[str, str] | None = None,
    sensor: int = 0,
    variant: str | None = None,
    seed: int = 0,
    seeds: int = 1,
    jitter: bool = False,
    pool: Pool = ONE_PROCESS,
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
        What the sets sample, see :class:`voroquad.mitsuba.integrator.Reweighted`; by default what the scene has, see
        :func:`voroquad.mitsuba.default_domain.choose_domain`.
    spp : sequence of int
        Samples per pixel.
    methods : sequence of str, optional
        Names of methods, such as ``stratified-w``, to compare with ``uniform``; by default all that the scene and
        the domain have.
    size : (int, int), optional
        Width and height in pixels; by default those of the scene.
    parameters, sensor, variant
        As in :func:`voroquad.mitsuba.render.render`.
    seed : int
        Seed of everything random. Methods on the same design share their samples.
    seeds : int
        Images of each method at each spp, from independent samples: errors are means over them.
    jitter : bool
        Sample the pixel's area? If false, every method, Mitsuba's own samplers too, samples the pixel's centre.
    pool : Pool
        What computes the units of work, such as :class:`voroquad.cluster.OnDask`; the images are the same bits.
    show_progress : bool
        A progress bar on standard error.

    Returns
    -------
    Results
        What was also written as ``results.json``.

    Raises
    ------
    ValueError
        There is no such scene or it is malformed, the sensor lacks the domain, a method is not known, or a sampler
        cannot make sets of one of the sizes.

    Notes
    -----
    All methods run the scene's own integrator. The reference takes 16 times the samples of the largest spp:
    rounds of independent unweighted Owen-scrambled Sobol' sets, averaged. Half the rounds against the other half,
    mean((A − B)²)/4, estimates its own mean squared error; it is in ``errors.csv``, beside MSE, relative MSE
    (mean of (image − reference)² / (reference² + 0.01)), ꟻLIP, seconds and the equal-error ratio: the samples per pixel
    with which ``uniform`` has the same MSE, over those of the image
    (:func:`voroquad.results.equal_error.equal_error_ratio`). Seconds are those of rendering an image, in all, whoever
    rendered, and without compilation. Mitsuba's own samplers are compared at those spp that they make exactly;
    objects that move in slices have none of them.
    """
    check_seed(seed)
    spp, seeds = sorted({positive_int("spp", n) for n in spp}), positive_int("seeds", seeds)
    use_variant(domain, variant)
    path = scene_path(scene).resolve()
    shot = Shot(LocalFile(path), mi.variant(), size, "plain", {}, sensor, dict(parameters or {}))
    loaded, camera_sensor = shot.stage()
    domain, choice = settle_domain(domain, loaded, camera_sensor, jitter=jitter)
    stage = Stage(loaded, camera_sensor, domain, jitter)
    chosen = _chosen(methods_for(stage, spp), methods)
    for method in chosen:
        for n in spp:
            method.check(stage, n)
    pool.begin(shot.key() | {
        "command": "compare", "domain": domain, "spp": spp, "methods": methods, "seed": seed, "seeds": seeds,
        "jitter": jitter,
    })  # fmt: skip
    tell(choice, show=show_progress)
    studio = Studio(shot, stage, pool)
    rounds = reference_rounds(stage, max(spp), seed)
    images = [_Image(m, n, seed, k) for n in spp for m in chosen if m.makes(n) for k in range(seeds)]

    total = sum(studio.units(image) for image in (*rounds, *images))
    with progress_bar(total, show=show_progress) as advance, atomic_directory(out) as folder:
        developed = studio.developed([*rounds, *images], advance)
        reference = make_reference(rounds, developed)
        measured = [
            measure(of_one, reference, developed)
            for of_one in (images[start : start + seeds] for start in range(0, len(images), seeds))
        ]
        command = _command(scene, out, shot, spp, methods, seed, seeds, domain, jitter)
        title = f"{Path(scene).stem}: renderings compared"
        results = Results(title, command, _sections(folder, reference, measured, jitter))
        results.write(folder)
    return results


def summary(results: Results, out: str | os.PathLike[str]) -> dict[str, Any]:
    """What ``voroquad compare --json`` prints: the folder and the errors of each image."""
    with (Path(out) / "errors.csv").open(newline="", encoding="utf-8") as file:
        rows = [
            {k: v if k == "method" else float(v) if v else None for k, v in row.items()} for row in csv.DictReader(file)
        ]
    return {"output": os.fspath(out), "command": results.command, "errors": rows}


def _chosen(known: list[Method], names: Sequence[str] | None) -> list[Method]:
    """The methods of those names, and the uniform sets that all are compared with."""
    if names is None:
        return known
    if unknown := sorted(set(names) - {method.name for method in known}):
        raise ValueError(f"methods: there is no {unknown[0]!r} here; choose from {', '.join(m.name for m in known)}")
    return [method for method in known if method is UNIFORM or method.name in names]


@dataclass(frozen=True)
class _Image:
    """What is rendered once, and the seeds of its samples."""

    method: Method
    spp: int
    seed: int
    number: int
    of_reference: bool = False

    @property
    def name(self) -> str:
        """Its name among all."""
        return f"{'reference' if self.of_reference else self.method.name}-{self.spp}-{self.number}"

    @property
    def table_seed(self) -> int:
        """Seed of the sets."""
        return self._seed(1 if self.of_reference else 3)

    @property
    def render_seed(self) -> int:
        """Seed of all else."""
        return self._seed(2 if self.of_reference else 4)

    def _seed(self, purpose: int) -> int:
        if self.of_reference:
            return _seed(self.seed, purpose, self.number)
        return _seed(self.seed, purpose, self.spp, *([self.number] if self.number else []))


class Studio:
    """Renders images by many methods, in units of a pool."""

    def __init__(self, shot: Shot, stage: Stage, pool: Pool) -> None:
        self._shot = shot
        self._stage = stage
        self._pool = pool
        self._cameras: dict[str, Camera] = {}

    def units(self, image: _Image) -> int:
        """The number of units of an image."""
        return self._camera(image.method).bands(image.spp)

    def developed(self, images: Sequence[_Image], advance: Advance) -> Iterator[tuple[Image, float]]:
        """The images, one after the other, and the seconds that each took."""
        series = (self._camera(i.method).series(i.name, i.spp, i.render_seed, i.table_seed) for i in images)
        passes = self._camera(images[0].method).passes(series, advance)
        for image, (done, seconds) in zip(images, passes, strict=True):
            yield self._camera(image.method).develop(done), seconds

    def _camera(self, method: Method) -> Camera:
        if method.name not in self._cameras:
            shot = replace(self._shot, kind=method.kind, properties=self._stage.properties(method))
            self._cameras[method.name] = Camera(shot, self._pool)
        return self._cameras[method.name]


def reference_rounds(stage: Stage, most: int, seed: int) -> list[_Image]:
    """At least two rounds of Sobol' sets, as large as the wavefront allows."""
    total = REFERENCE_FACTOR * most
    n = total // 2
    while n % 2 == 0 and n * int(np.prod(stage.sensor.film().crop_size())) > MAX_WAVEFRONT:
        n //= 2
    return [_Image(SOBOL[0], n, seed, k, of_reference=True) for k in range(total // n)]


def make_reference(rounds: Sequence[_Image], developed: Iterator[tuple[Image, float]]) -> Reference:
    """The mean of the rounds, which come first."""
    halves: list[Any] = [0.0, 0.0]
    for k, (image, _) in enumerate(islice(developed, len(rounds))):
        halves[k % 2] += image
    a, b = (half / (len(rounds) // 2) for half in halves)
    mse = float(np.mean((a - b)[..., :3] ** 2)) / 4
    return Reference((a + b) / 2, len(rounds) * rounds[0].spp, len(rounds), mse)


def measure(images: Sequence[_Image], reference: Reference, developed: Iterator[tuple[Image, float]]) -> Measurement:
    """The mean errors of images of one method, which come next, against the reference."""
    method = images[0].method
    shown: list[tuple[Image, Image | None]] = []
    mse, relmse, flip, seconds = [], [], [], []
    for image, time in islice(developed, len(images)):
        seconds.append(time)
        image, share = (image[..., :-1], image[..., -1]) if method.blends else (image, None)
        squared = (image - reference.image)[..., :3] ** 2
        mse.append(float(squared.mean()))
        relmse.append(float((squared / (reference.image[..., :3] ** 2 + RELATIVE_FLOOR)).mean()))
        flip.append(mean_flip(reference.image, image))
        shown.append((image, share))
    error = float(np.std(mse, ddof=1) / np.sqrt(len(images))) if len(images) > 1 else float("nan")
    means = {"mse": mse, "relmse": relmse, "flip": flip, "seconds": seconds}
    return Measurement(
        method,
        images[0].spp,
        shown[0][0],
        mse_error=error,
        share=shown[0][1],
        **{name: float(np.mean(each)) for name, each in means.items()},
    )


def mean_flip(reference: Image, image: Image) -> float:
    """Mean ꟻLIP of the images as shown (sRGB, clipped), 0 to 1."""
    import flip_evaluator

    shown = [srgb(rgb(x)).astype(np.float32) for x in (reference, image)]
    _, mean, _ = flip_evaluator.evaluate(*shown, "LDR", inputsRGB=True, applyMagma=False, computeMeanError=True)
    return float(mean)


def _seed(*key: int) -> int:
    """A 32-bit seed for a purpose, independent of the others."""
    return int(np.random.SeedSequence(key).generate_state(1)[0] >> np.uint32(1))


# ---------------------------------------------------------------------- what is left in the folder


def _sections(folder: Path, reference: Reference, measured: list[Measurement], jitter: bool) -> list[Section]:
    """Write images, numbers and plot; say what they are."""
    for name in ("images", "differences", "closeups", "lambda"):
        (folder / name).mkdir()
    write_image(reference.image, folder / "images" / "reference.exr")
    write_image(reference.image, folder / "images" / "reference.png")
    for m in measured:
        write_image(m.image, folder / "images" / f"{_stem(m)}.exr")
        write_image(m.image, folder / "images" / f"{_stem(m)}.png")

    spp = sorted({m.spp for m in measured})
    _write_errors(folder / "errors.csv", reference, measured)
    methods = list({m.method.name: m.method for m in measured}.values())
    mse_figure(folder / "mse", [_curve(measured, method) for method in methods], reference.mse)
    _write_differences(folder / "differences", reference, measured, _middle(spp))
    windows = _write_closeups(folder / "closeups", reference, [m for m in measured if m.spp == _middle(spp)])
    where = "the pixel's area" if jitter else "the pixel's centre"
    comparison = ImageComparison(
        "images/reference.exr",
        [Rendering(m.method.label, m.spp, f"images/{_stem(m)}.exr") for m in measured],
        "errors.csv",
        UNIFORM.label,
        "Two renderings under a divider, and what they miss of the reference. Below, all methods at equal samples per "
        "pixel in the window marked in the image, which is where uniform samples err most, or in the view once "
        "zoomed; each with its error on the one scale of the colour bar.",
        [(w[1].start, w[0].start, w[1].stop - w[1].start, w[0].stop - w[0].start) for w in windows],
    )
    blended = [m for m in measured if m.share is not None]
    mse = "mean squared error"
    error_figure = Figure(
        "mse.png",
        "Mean squared error against samples per pixel and against render time; weighted sets solid, others dashed. "
        "Beside each line's name, the slope of log MSE by least squares.",
        "Log-log plot of the mean squared error of each method",
        "mse.svg",
        "errors.csv",
        [Plot("spp", "mse", "samples per pixel", mse, None, 1), Plot("seconds", "mse", "seconds", mse, None, 0)],
        lines={method.label: method.line for method in methods},
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
        *([Section("Blend", grids=[_shares(folder, blended, spp)])] if blended else []),
    ]


def _shares(folder: Path, blended: list[Measurement], spp: list[int]) -> ImageGrid:
    """Write the maps of λ."""
    for m in blended:
        assert m.share is not None
        share_png(m.share, folder / "lambda" / f"{_stem(m)}.png")
    methods = list(dict.fromkeys(m.method.label for m in blended))
    pngs = {(m.method.label, m.spp): f"lambda/{_stem(m)}.png" for m in blended}
    return ImageGrid(
        methods,
        [f"{n} spp" for n in spp],
        [[pngs.get((label, n)) for n in spp] for label in methods],
        "λ, the share of the weights that the blend uses, per tile: 0 dark blue, 1 yellow.",
    )


def _stem(m: Measurement) -> str:
    return f"{m.method.name}-{m.spp}"


def _curve(measured: list[Measurement], method: Method) -> Curve:
    own = [m for m in measured if m.method is method]
    spp, mse = [m.spp for m in own], [m.mse for m in own]
    law = fit_power_law(spp, mse)
    return Curve(method.label, method.line, spp, mse, None if law is None else law.slope)


_COLUMNS = (
    "method,spp,mse,uniform_mse_over_mse,flip,seconds,reference_mse,mse_error,relmse,equal_error_ratio,extrapolated"
)


def _write_errors(path: Path, reference: Reference, measured: list[Measurement]) -> None:
    plain = {m.spp: m.mse for m in measured if m.method is UNIFORM}
    baseline = [(float(n), mse) for n, mse in sorted(plain.items())]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(_COLUMNS.split(","))
        for m in measured:
            ratio = f"{plain[m.spp] / m.mse:.3f}" if m.mse > 0 else "inf"
            numbers = (f"{m.mse:.4e}", ratio, f"{m.flip:.5f}", f"{m.seconds:.3f}", f"{reference.mse:.2e}")
            error = "" if np.isnan(m.mse_error) else f"{m.mse_error:.1e}"
            equal = equal_error_ratio(baseline, m.spp, m.mse)
            spp_ratio = ("", "") if np.isnan(equal.n) else (f"{equal.n:.4g}", int(equal.extrapolated))
            writer.writerow([m.method.label, m.spp, *numbers, error, f"{m.relmse:.4e}", *spp_ratio])


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
    shot: Shot,
    spp: Sequence[int],
    methods: Sequence[str] | None,
    seed: int,
    seeds: int,
    domain: str,
    jitter: bool,
) -> str:
    """The command that makes the same folder."""
    command = ["voroquad", "compare", os.fspath(scene), "-o", os.fspath(out), "--domain", domain]
    command += ["--spp", ",".join(map(str, spp)), "--jitter" if jitter else "--no-jitter", "--seed", str(seed)]
    command += ["--methods", ",".join(methods)] if methods is not None else []
    command += ["--seeds", str(seeds)] if seeds > 1 else []
    command += ["--size", f"{shot.size[0]}x{shot.size[1]}"] if shot.size else []
    for name, value in shot.parameters.items():
        command += ["-D", f"{name}={value}"]
    command += ["--sensor", str(shot.sensor)] if shot.sensor else []
    command += ["--variant", shot.variant] if shot.variant != default_variant(domain) else []
    return shlex.join(command)
