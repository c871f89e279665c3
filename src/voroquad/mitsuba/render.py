"""Load a scene, render it with weighted sample sets, write the image."""

from __future__ import annotations

import errno
import itertools
import math
import os
import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from .._support.arrays import Array
from .._support.checks import one_of, positive_int
from .._support.files import atomic_path, check_writable, parents_of
from .._support.locks import only_writer
from .._support.progress import progress_bar
from .._support.units import ONE_PROCESS, LocalFile, Pool
from .allocation import Sharing
from .bands import Camera, Shot, forgetting
from .blend import Floats
from .default_domain import AUTO, tell
from .denoising import check_denoiser, denoised
from .errors import one_line_errors
from .loading import FIRST_HITS, scene_path, use_variant
from .rounds import Rounds, round_seed
from .settling import Settled, Wanted, settle

DEFAULT_SPP = 64
#: Samples per pixel of an image at most
MOST_SPP = 2**32
#: Samples per pixel of a round at most, unless asked for
LONGEST_ROUND = 256
#: Where rounds come fast, from many workers: time between two images of them over the time to write one
PICTURES = 10
#: Extra channels that a user may ask for
AOVS = (*FIRST_HITS, "variance", "samples")
#: Seconds that rounds have at least, where what comes before them takes all of the time
SHORTEST = 1e-3
#: Rounds before their error is trusted
FEWEST_TO_JUDGE = 4

Image = Array


def check_seed(seed: int) -> None:
    """Raise ValueError for a seed that Mitsuba, whose seeds have 32 bits, does not take."""
    if not 0 <= seed < 2**32:
        raise ValueError(f"seed must be a whole number from 0 to 2^32 − 1, got {seed}")


def render_image(scene: mi.Scene, integrator: mi.Integrator, spp: int, seed: int) -> Image:
    """Render to an array (height, width, channels) of linear radiance."""
    with one_line_errors():
        return np.array(mi.render(scene, integrator=integrator, spp=spp, seed=seed), dtype=np.float64)


def write_image(image: Image, path: str | os.PathLike[str]) -> None:
    """Write an image, whole or not at all: linear as .exr, sRGB as .png."""
    suffix = one_of("image format", Path(path).suffix.lower(), (".exr", ".png"))
    with atomic_path(path) as temporary:
        if suffix == ".exr":
            _write(mi.Bitmap(image.astype(np.float32)), temporary)
        else:
            _write(mi.Bitmap((srgb(rgb(image)) * 255 + 0.5).astype(np.uint8)), temporary)


def _write(bitmap: mi.Bitmap, path: Path) -> None:
    """Write a bitmap. An error gives the reason only, as the path is temporary: the caller names the file."""
    try:
        bitmap.write(str(path))
    except RuntimeError as error:
        raise OSError(errno.EIO, str(error).rpartition(": ")[2]) from None


def rgb(image: Image) -> Image:
    """The colours (height, width, 3) of an image with or without alpha, grey or not."""
    return image[..., :3] if image.shape[-1] >= 3 else np.repeat(image[..., :1], 3, axis=-1)


def srgb(linear: Image) -> Image:
    """The sRGB transfer function (IEC 61966-2-1), clipped to [0, 1]."""
    clipped = np.clip(linear, 0, 1)
    return np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)


# ---------------------------------------------------------------------- rounds


@dataclass(frozen=True)
class Budget:
    """How long to render.

    Parameters
    ----------
    spp : int, optional
        Samples per pixel in all; without it 64, or as many as the other limits allow if there are any.
    per_round : int, optional
        Those of a round, which must divide `spp`; without it `spp` up to 256, or 64 if `spp` is open.
    seconds : float, optional
        No round is begun that would end later, as long as the rounds before took on average.
    target_error : float, optional
        Standard error of a pixel over the mean radiance, see `Rounds.error`; judged from the fourth round on.
    """

    spp: int | None = None
    per_round: int | None = None
    seconds: float | None = None
    target_error: float | None = None

    def __post_init__(self) -> None:
        for name in ("spp", "per_round"):
            if getattr(self, name) is not None:
                called = {"per_round": "round"}.get(name, name)
                positive_int(called, getattr(self, name), MOST_SPP)
        for name, value in (("time", self.seconds), ("target_error", self.target_error)):
            if value is not None and not 0 < value < math.inf:
                raise ValueError(f"{name} must be a number above 0, got {value}")
        if self.samples is not None and self.rounds is not None and self.rounds * self.n != self.samples:
            small = [n for n in range(1, math.isqrt(self.samples) + 1) if self.samples % n == 0]
            divisors = [*small, *(self.samples // n for n in small)]
            raise ValueError(
                f"rounds of {self.n} do not divide spp={self.samples}; take spp={self.rounds * self.n}, "
                f"or a --round that divides, such as {min(divisors, key=lambda n: abs(n - self.n))}"
            )

    @property
    def samples(self) -> int | None:
        """Samples per pixel in all; None if open."""
        open_end = self.seconds is not None or self.target_error is not None
        return self.spp if self.spp is not None or open_end else DEFAULT_SPP

    @property
    def n(self) -> int:
        """Samples per pixel of a round."""
        if self.per_round is not None:
            return self.per_round
        return DEFAULT_SPP if self.samples is None else min(self.samples, LONGEST_ROUND)

    @property
    def rounds(self) -> int | None:
        """Number of rounds; None if open."""
        return None if self.samples is None else max(1, self.samples // self.n)

    def less(self, seconds: float) -> Budget:
        """What is left of the plan after so many seconds."""
        return self if self.seconds is None else replace(self, seconds=max(self.seconds - seconds, SHORTEST))

    @property
    def several(self) -> bool:
        """May there be more than one round?"""
        return self.rounds != 1

    def end(self, rounds: Rounds, seconds: float, here: int) -> int | None:
        """After how many rounds to stop, as it looks now: `here` of the rounds took so many seconds in this run."""
        limits = [] if self.rounds is None else [self.rounds]
        if self.target_error is not None and rounds.count >= FEWEST_TO_JUDGE:
            # The error falls as 1/√rounds; where it cannot be told, more rounds do not tell it either
            ratio = rounds.error / self.target_error
            limits.append(rounds.count if math.isnan(ratio) else max(rounds.count, math.ceil(rounds.count * ratio**2)))
        if self.seconds is not None and here > 0:
            limits.append(rounds.count + max(0, int((self.seconds - seconds) * here / seconds)))
        return min(limits, default=None)


def parse_seconds(text: str | None) -> float | None:
    """Read "60s", "5m", "1.5h" or a number of seconds."""
    if text is None:
        return None
    match = re.fullmatch(r"(\d+(?:\.\d+)?)([smh]?)", text)
    if match is None:
        raise ValueError(f"time must look like 60s, 5m or 2h, got {text!r}")
    return float(match[1]) * {"": 1, "s": 1, "m": 60, "h": 3600}[match[2]]


def state_path(out: str | os.PathLike[str]) -> Path:
    """Where the state of a render in rounds is kept: beside the image."""
    return Path(f"{os.fspath(out)}.state.npz")


def denoised_path(out: str | os.PathLike[str]) -> Path:
    """Where the denoised image goes: beside the image."""
    return Path(out).with_suffix(f".denoised{Path(out).suffix}")


def check_aovs(aovs: Sequence[str], out: str | os.PathLike[str], plan: Budget) -> None:
    """Raise ValueError for channels that are not known, or that the image cannot have."""
    for name in aovs:
        one_of("aov", name, AOVS)
    if aovs and Path(out).suffix.lower() != ".exr":
        raise ValueError(f"aov={','.join(aovs)} needs an image with channels; write to a file .exr, got {str(out)!r}")
    if "variance" in aovs and not plan.several:
        raise ValueError(f"aov=variance needs two rounds or more; take --round {max(1, plan.n // 2)}, or fewer samples")


def write_rounds(camera: Camera, rounds: Rounds, out: str | os.PathLike[str], samples: int | None = None) -> None:
    """Write the image so far; as .exr with the channels lambda and variance, and samples if their number is given."""
    image, names = camera.film(rounds)
    if Path(out).suffix.lower() == ".png":
        write_image(image, out)
        return
    layers: list[Floats] = [image]
    own = list(names)
    if camera.integrator.blend:
        layers, own = [*layers, rounds.mean_lambda[..., None]], [*own, "lambda"]
    if rounds.count > 1:
        layers, own = [*layers, rounds.variance], [*own, "variance.R", "variance.G", "variance.B"]
    if samples is not None and "samples" not in own:
        layers, own = [*layers, np.full((*image.shape[:2], 1), float(samples))], [*own, "samples"]
    with atomic_path(out) as temporary:
        pixels = np.concatenate(layers, -1, dtype=np.float32)
        _write(mi.Bitmap(pixels, mi.Bitmap.PixelFormat.MultiChannel, channel_names=own), temporary)


@forgetting()
def render(
    scene: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    domain: str = AUTO,
    spp: int | None = None,
    sampler: str = AUTO,
    order: int | None = None,
    debias: str = "auto",
    weighted: bool = True,
    blend: str = "auto",
    jitter: bool = True,
    sharing: Sharing | None = None,
    aovs: Sequence[str] = (),
    denoise: bool = False,
    size: tuple[int, int] | None = None,
    parameters: Mapping[str, str] | None = None,
    sensor: int = 0,
    variant: str | None = None,
    seed: int = 0,
    per_round: int | None = None,
    seconds: float | None = None,
    target_error: float | None = None,
    resume: bool = False,
    pool: Pool = ONE_PROCESS,
    on_round: OnRound | None = None,
    show_progress: bool = True,
) -> dict[str, Any]:
    """Render a scene with its own integrator inside ``reweighted`` or ``plain`` and write the image.

    Parameters
    ----------
    scene : str or path
        Mitsuba XML file, or the name of a built-in scene.
    out : str or path
        Image file to write: .exr (linear; with the channels ``lambda``, the blend's λ, and ``variance``, the
        estimated variance of each pixel, if there are two rounds) or .png (sRGB).
    domain, sampler, order, debias, weighted, blend, jitter
        As the properties of the plug-in, :class:`voroquad.mitsuba.integrator.Reweighted`. `sampler` may be "owensobol"
        too: then there are no sets, and :class:`voroquad.mitsuba.owen_sobol.OwenSobol` samples everything. By default
        a pilot chooses, see :mod:`voroquad.mitsuba.pilot`. Where only some of these are named, the domain is what the
        scene has, see :func:`voroquad.mitsuba.default_domain.choose_domain`, and the sampler "stratified".
    sharing : Sharing, optional
        Samples go where a pilot finds noise, see :class:`voroquad.mitsuba.adaptive.Adaptive`. There are no sets then,
        but the sampler "owensobol"; all rounds have the numbers of samples that the pilot of the first tells.
    aovs : sequence of str
        Extra channels of an .exr: "albedo", "normal" and "depth" of what camera rays meet first, "variance" (there with
        two rounds anyway) and "samples", those of each pixel in a round.
    denoise : bool
        Write a denoised image too, ``out.denoised.exr`` beside ``out.exr``, with the channels "albedo" and "normal" as
        guides if they are rendered. It is a preview: it has a bias, and needs the extra ``denoise``.
    spp, per_round, seconds, target_error
        How long to render, see :class:`Budget`. Each round takes new sample sets.
    size : (int, int), optional
        Width and height in pixels; by default those of the scene.
    parameters : mapping of str to str, optional
        Values of the scene's ``$name`` parameters.
    sensor : int
        Number of the scene's sensor that takes the image, from 0.
    variant : str, optional
        Mitsuba's; by default the current one, or ``llvm_ad_rgb`` (``llvm_ad_spectral`` for the domain ``wavelength``).
    seed : int
        Seed of the tables and of the rendering.
    resume : bool
        Go on from the state beside the image. After each round of several, the image so far and the file
        ``out.state.npz`` are on disk; a render that is resumed ends with the same bits as one that is not interrupted.
    pool : Pool
        What computes the units of work, such as :class:`voroquad.cluster.OnDask`; the image is the same bits. One that
        keeps finished units goes on from those, leaves no state beside the image, and writes the image so far only as
        often as that takes a tenth of the time.
    on_round : callable, optional
        Called with a :class:`FilmSoFar` after each round, once its files are written. An exception that it raises ends
        the render; what is on disk can be resumed.
    show_progress : bool
        A progress bar on standard error.

    Returns
    -------
    dict
        The path written, the size, the sampler and the domain (None without sets), the rounds and samples per pixel,
        the mean radiance, the error (`Rounds.error`, None where it cannot be told, as after a single round), the number
        of pixels that are not finite. Mean and error are over the finite ones.

    Raises
    ------
    ValueError
        There is no such scene or it is malformed; the scene lacks the domain; what the plug-in refuses; there is
        nothing to resume from, or it belongs to other options.
    """
    plan = Budget(spp, per_round, seconds, target_error)
    check_seed(seed)
    one_of("image format", Path(out).suffix.lower(), (".exr", ".png"))
    check_aovs(aovs, out, plan)
    if denoise:
        check_denoiser()
    for file in [out, state_path(out)] if plan.several else [out]:
        check_writable(file)
    path = scene_path(scene).resolve()
    use_variant(domain, variant)
    wanted = Wanted(domain, sampler, order, debias, weighted, blend, jitter, sharing)
    channels = tuple(name for name in FIRST_HITS if name in aovs)
    shot = Shot(LocalFile(path), mi.variant(), size, "plain", {}, sensor, dict(parameters or {}), channels)
    begun = time.monotonic()
    with parents_of(out), only_writer(out):
        settled = settle(wanted, shot, plan.n, seed)
        camera, key = _ready(settled, plan, seed, pool)
        found = Rounds.load(state_path(out), key) if resume else None
        tell(settled.line, show=show_progress)
        pool.begin(key)
        camera.integrator.explore(camera.scene, camera.sensor, seed, plan.n)
        plan = plan.less(time.monotonic() - begun)
        output = Output(out, key, pool.keeps, on_round, plan.n if "samples" in aovs else None)
        rounds = _all_rounds(camera, plan, seed, found, output, show_progress)
        if denoise:
            film, names = camera.film(rounds)
            write_image(denoised(film, names), denoised_path(out))
    chosen = {"domain": settled.key["domain"], "sampler": settled.key["sampler"]}
    return _summary(rounds, plan) | chosen | {"output": os.fspath(out)}


def _ready(settled: Settled, plan: Budget, seed: int, pool: Pool) -> tuple[Camera, dict[str, Any]]:
    """The camera, which can render by the plan, and what the state of its rounds belongs to."""
    scene, sensor, integrator = settled.shot.loaded()
    integrator.check(scene, sensor)
    integrator.check_samples(sensor, plan.n)
    if integrator.blend and plan.rounds is not None:
        integrator.check_blend(sensor, plan.rounds)
    pixels = [int(n) for n in sensor.film().crop_size()]
    key = settled.key | settled.shot.key() | {"size": pixels, "round": plan.n, "seed": seed}
    return Camera(settled.shot, pool), key


@dataclass(frozen=True)
class FilmSoFar:
    """What a render has after a round.

    Attributes
    ----------
    image : ndarray, (height, width, channels)
        The mean of the rounds, as the film shows it: linear radiance.
    channels : list of str
        Their names.
    rounds, spp : int
        Rounds so far, and samples per pixel.
    end : int or None
        Rounds in all, as it looks now; None if it cannot be told yet.
    error : float
        See `Rounds.error`; infinite before the second round.
    seconds : float
        Since the first round of this run began.
    left : float or None
        Seconds until the last round ends, as it looks now.
    """

    image: Image
    channels: list[str]
    rounds: int
    spp: int
    end: int | None
    error: float
    seconds: float
    left: float | None


OnRound = Callable[[FilmSoFar], None]


@dataclass
class Output:
    """Where the image so far goes, and the state of its rounds beside it.

    Parameters
    ----------
    path : str or path
        Of the image.
    key : dict
        What the state belongs to.
    kept : bool
        Do finished units outlive the run? Then there is no state, and images are written only as often as that takes a
        tenth of the time.
    on_round : callable, optional
        Called after each round.
    samples : int, optional
        Samples of each pixel in a round, to be told in a channel.
    """

    path: str | os.PathLike[str]
    key: dict[str, Any]
    kept: bool
    on_round: OnRound | None = None
    samples: int | None = None
    _next: float = -math.inf

    def write(self, camera: Camera, rounds: Rounds, *, state: bool, last: bool) -> None:
        """Write the state of several rounds if it is wanted, then the image."""
        if state and not self.kept:
            rounds.save(state_path(self.path), self.key)
        begun = time.monotonic()
        if not self.kept or last or begun >= self._next:
            write_rounds(camera, rounds, self.path, self.samples)
            end = time.monotonic()
            self._next = end + PICTURES * (end - begun)

    def tell(self, camera: Camera, rounds: Rounds, n: int, end: int | None, seconds: float, here: int) -> None:
        """Call what wants to know of each round; `here` of them took so many seconds in this run."""
        if self.on_round is None:
            return
        image, names = camera.film(rounds)
        left = None if end is None else (end - rounds.count) * seconds / here
        self.on_round(FilmSoFar(image, names, rounds.count, rounds.count * n, end, rounds.error, seconds, left))


def _all_rounds(
    camera: Camera, plan: Budget, seed: int, rounds: Rounds | None, output: Output, show_progress: bool
) -> Rounds:
    """The rounds of a plan, after those that are found already."""
    if rounds is not None:  # perhaps nothing is left to do, and the image was not written
        output.write(camera, rounds, state=False, last=True)
    bands = camera.bands(plan.n)
    numbers = itertools.count(rounds.count if rounds else 0)
    series = (
        camera.series(f"round-{k}", plan.n, round_seed(seed, k))
        for k in itertools.takewhile(lambda k: plan.rounds is None or k < plan.rounds, numbers)
    )
    start, here = time.monotonic(), 0
    with progress_bar(None, show=show_progress and (plan.several or bands > 1)) as advance:
        end = plan.rounds if rounds is None else plan.end(rounds, 0, 0)
        advance(_progress(rounds), rounds.count * bands if rounds else 0, end and end * bands)
        passes = camera.passes(series, lambda _, steps: advance(_progress(rounds), steps))
        while rounds is None or end is None or rounds.count < end:
            done, _ = next(passes)
            rounds = rounds or Rounds(done.plain.shape, blend=camera.integrator.blend)
            rounds.add(done)
            here += 1
            end = plan.end(rounds, time.monotonic() - start, here)
            output.write(camera, rounds, state=plan.several, last=rounds.count == end)
            output.tell(camera, rounds, plan.n, end, time.monotonic() - start, here)
            advance(_progress(rounds), 0, end and end * bands)
    return rounds


def _summary(rounds: Rounds, plan: Budget) -> dict[str, Any]:
    """What there is to say of an image."""
    height, width = rounds.mean_lambda.shape
    return {
        "width": width,
        "height": height,
        "spp": rounds.count * plan.n,
        "rounds": rounds.count,
        "mean": rounds.mean if math.isfinite(rounds.mean) else None,
        "error": rounds.error if math.isfinite(rounds.error) else None,
        "not_finite": int((~rounds.finite).sum()),
    }


def _progress(rounds: Rounds | None) -> str:
    """What the progress bar says."""
    if rounds is None:
        return "round 1"
    error = f", error {rounds.error:.2%}" if math.isfinite(rounds.error) else ""
    return f"round {rounds.count}{error}{not_finite(int((~rounds.finite).sum()))}"


def not_finite(pixels: int) -> str:
    """What to say of so many pixels that are not finite."""
    return f", {pixels} pixels not finite" if pixels else ""
