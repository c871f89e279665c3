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
from .._support.files import atomic_directory, check_folder
from .._support.progress import progress_bar
from .._support.units import ONE_PROCESS, Advance, LocalFile, Pool
from ..results.manifest import Results
from .bands import Camera, Shot, forgetting
from .comparison_files import write_comparison
from .default_domain import AUTO, settle_domain, tell
from .developing import colour_count
from .loading import default_variant, scene_path, use_variant
from .measurements import MeasuredImages, Reference, errors_of
from .methods import SOBOL, UNIFORM, RenderMethod, Stage, methods_for
from .pilot import candidates
from .render import Image, check_seed
from .settling import choose

REFERENCE_FACTOR = 16  # samples of the reference over the most samples of a method
MAX_WAVEFRONT = 2**26  # rays of the reference in flight: about 1 GiB


@forgetting()
def compare(
    scene: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    domain: str = AUTO,
    spp: Sequence[int] = (16, 64, 256),
    methods: Sequence[str] | None = None,
    auto: bool = False,
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
    auto : bool
        Take the settings that a render chooses from, see :func:`voroquad.mitsuba.pilot.candidates`, and tell which of
        them the pilot of a render takes at the largest spp.
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
    check_folder(out)
    spp, seeds = sorted({positive_int("spp", n) for n in spp}), positive_int("seeds", seeds)
    use_variant(domain, variant)
    path = scene_path(scene).resolve()
    shot = Shot(LocalFile(path), mi.variant(), size, "plain", {}, sensor, dict(parameters or {}))
    loaded, camera_sensor = shot.stage()
    domain, choice = settle_domain(domain, loaded, camera_sensor, jitter=jitter)
    stage = Stage(loaded, camera_sensor, domain, jitter)
    chosen = _chosen(_choices(stage, spp) if auto else methods_for(stage, spp), methods)
    for method in chosen:
        for n in spp:
            method.check(stage, n)
    pool.begin(shot.key() | {
        "command": "compare", "domain": domain, "spp": spp, "methods": methods, "auto": auto, "seed": seed,
        "seeds": seeds, "jitter": jitter,
    })  # fmt: skip
    studio = Studio(shot, stage, pool)
    rounds = reference_rounds(stage, max(spp), seed)
    images = [_Image(m, n, seed, k) for n in spp for m in chosen if m.makes(n) for k in range(seeds)]
    command = _command(scene, out, shot, spp, methods, auto, seed, seeds, domain, jitter)
    taken = f"A render at {max(spp)} samples: {choose(stage, max(spp), seed)[1]}. " if auto else ""
    with atomic_directory(out) as folder:
        tell(choice, show=show_progress)
        reference, measured = _measured(studio, rounds, images, seeds, show_progress)
        sections = write_comparison(folder, reference, measured, jitter, taken)
        results = Results(f"{Path(scene).stem}: renderings compared", command, sections)
        results.write(folder)
    return results


def _measured(
    studio: Studio, rounds: Sequence[_Image], images: Sequence[_Image], seeds: int, show_progress: bool
) -> tuple[Reference, list[MeasuredImages]]:
    """Render the rounds of the reference and the images, of each method and spp so many seeds; their errors."""
    total = sum(studio.units(image) for image in (*rounds, *images))
    with progress_bar(total, show=show_progress) as advance:
        developed = studio.developed([*rounds, *images], advance)
        reference = make_reference(rounds, developed)
        groups = (images[start : start + seeds] for start in range(0, len(images), seeds))
        return reference, [measure(of_one, reference, developed) for of_one in groups]


def summary(results: Results, out: str | os.PathLike[str]) -> dict[str, Any]:
    """What ``voroquad compare --json`` prints: the folder and the errors of each image."""
    with (Path(out) / "errors.csv").open(newline="", encoding="utf-8") as file:
        rows = [
            {k: v if k == "method" else float(v) if v else None for k, v in row.items()} for row in csv.DictReader(file)
        ]
    return {"output": os.fspath(out), "command": results.command, "errors": rows}


def _chosen(known: list[RenderMethod], names: Sequence[str] | None) -> list[RenderMethod]:
    """The methods of those names, and the uniform sets that all are compared with."""
    if names is None:
        return known
    if unknown := sorted(set(names) - {method.name for method in known}):
        raise ValueError(f"methods: there is no {unknown[0]!r} here; choose from {', '.join(m.name for m in known)}")
    return [method for method in known if method is UNIFORM or method.name in names]


def _choices(stage: Stage, spp: Sequence[int]) -> list[RenderMethod]:
    """What a render chooses from, and the uniform sets that all are compared with."""
    if found := candidates(stage, spp):
        return [UNIFORM, *found]
    raise ValueError("auto has nothing to choose from where objects move in slices; leave it out")


@dataclass(frozen=True)
class _Image:
    """What is rendered once, and the seeds of its samples."""

    method: RenderMethod
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
        """The colours of the images, and λ where they blend, one after the other; the seconds that each took."""
        film = self._camera(images[0].method).sensor.film()
        series = (self._camera(i.method).series(i.name, i.spp, i.render_seed, i.table_seed) for i in images)
        passes = self._camera(images[0].method).passes(series, advance)
        for image, (done, seconds) in zip(images, passes, strict=True):
            shown = self._camera(image.method).develop(done)
            colours = shown[..., : colour_count(film)]
            yield np.concatenate([colours, shown[..., -1:]], -1) if image.method.blends else colours, seconds

    def _camera(self, method: RenderMethod) -> Camera:
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
    mse = float(np.mean((a - b) ** 2)) / 4
    return Reference((a + b) / 2, len(rounds) * rounds[0].spp, len(rounds), mse)


def measure(images: Sequence[_Image], reference: Reference, developed: Iterator[tuple[Image, float]]) -> MeasuredImages:
    """The mean errors of images of one method, which come next, against the reference."""
    method = images[0].method
    shown: list[tuple[Image, Image | None]] = []
    errors: list[dict[str, float]] = []
    for image, seconds in islice(developed, len(images)):
        image, share = (image[..., :-1], image[..., -1]) if method.blends else (image, None)
        errors.append(errors_of(image, reference.image) | {"seconds": seconds})
        shown.append((image, share))
    mse = [error["mse"] for error in errors]
    spread = float(np.std(mse, ddof=1) / np.sqrt(len(images))) if len(images) > 1 else float("nan")
    means = {name: float(np.mean([error[name] for error in errors])) for name in errors[0]}
    return MeasuredImages(method, images[0].spp, shown[0][0], mse_error=spread, share=shown[0][1], **means)


def _seed(*key: int) -> int:
    """A 32-bit seed for a purpose, independent of the others."""
    return int(np.random.SeedSequence(key).generate_state(1)[0] >> np.uint32(1))


def _command(
    scene: str | os.PathLike[str],
    out: str | os.PathLike[str],
    shot: Shot,
    spp: Sequence[int],
    methods: Sequence[str] | None,
    auto: bool,
    seed: int,
    seeds: int,
    domain: str,
    jitter: bool,
) -> str:
    """The command that makes the same folder."""
    command = ["voroquad", "compare", os.fspath(scene), "-o", os.fspath(out), "--domain", domain]
    command += ["--spp", ",".join(map(str, spp)), "--jitter" if jitter else "--no-jitter", "--seed", str(seed)]
    command += ["--methods", ",".join(methods)] if methods is not None else []
    command += ["--auto"] if auto else []
    command += ["--seeds", str(seeds)] if seeds > 1 else []
    command += ["--size", f"{shot.size[0]}x{shot.size[1]}"] if shot.size else []
    for name, value in shot.parameters.items():
        command += ["-D", f"{name}={value}"]
    command += ["--sensor", str(shot.sensor)] if shot.sensor else []
    command += ["--variant", shot.variant] if shot.variant != default_variant(domain) else []
    return shlex.join(command)
