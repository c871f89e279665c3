"""Images in units of work: a band of rows each."""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .._support.arrays import Array
from .._support.checks import thread_count
from .._support.units import Advance, File, Pool, Series
from .._support.version import __version__
from ..sample_tables import Recipe, SampleTable
from .accumulation import Footprint, Layout, Pass
from .dependencies import file_hashes, scene_files
from .errors import one_line_errors
from .loading import find_sensor, load_scene, make_integrator, motion_of, traced
from .rounds import Rounds, alone


@dataclass(frozen=True)
class Shot:
    """Everything that determines an image except its samples; it is sent to workers.

    Parameters
    ----------
    scene : File
        Mitsuba XML file.
    variant : str
        Mitsuba's, where it is rendered.
    size : (int, int), optional
        Width and height in pixels; by default those of the scene.
    kind : str
        Plug-in around the scene's own integrator.
    properties : dict
        Of the plug-in.
    sensor : int
        Number of the scene's sensor that takes the image.
    parameters : dict
        Values of the scene's ``$name`` parameters.
    channels : tuple of str
        Extra channels, of `FIRST_HITS`.
    """

    scene: File
    variant: str
    size: tuple[int, int] | None
    kind: str
    properties: dict[str, Any]
    sensor: int = 0
    parameters: dict[str, str] = field(default_factory=dict)
    channels: tuple[str, ...] = ()

    @property
    def plugin(self) -> str:
        """Tells its plug-in from others."""
        return f"{self.kind} {sorted(self.properties.items())} {self.channels}"

    def key(self) -> dict[str, Any]:
        """Everything that the image depends on except the plug-in and its samples: files by their hashes, sensor,
        versions."""
        files = file_hashes(self.scene.path, self.parameters)
        versions = {"voroquad": __version__, "mitsuba": mi.__version__, "drjit": dr.__version__}
        settings = {"variant": self.variant, "sensor": self.sensor, "size": self.size}
        settings |= {"channels": list(self.channels)} if self.channels else {}
        values = {f"parameter {name}": value for name, value in sorted(self.parameters.items())}
        return settings | values | versions | {f"file {name}": hashed for name, hashed in files.items()}

    def stage(self) -> tuple[mi.Scene, mi.Sensor]:
        """Scene and sensor; the last scene stays in memory."""
        if mi.variant() != self.variant:
            mi.set_variant(self.variant)
        key = f"{self.scene.path} {self.variant} {self.size} {self.sensor} {sorted(self.parameters.items())}"
        if key not in _last.scenes:
            _last.forget()
            _last.scenes[key] = load_scene(self.scene.path, self.size, parameters=self.parameters, sensor=self.sensor)
        return _last.scenes[key], find_sensor(_last.scenes[key], self.sensor)

    def loaded(self) -> tuple[mi.Scene, mi.Sensor, mi.Integrator]:
        """Scene, sensor and plug-in; the last ones stay in memory."""
        scene, sensor = self.stage()
        if self.plugin not in _last.integrators:
            _last.integrators.clear()
            properties = self.properties | (motion_of(scene) if self.kind == "reweighted" else {})
            _last.integrators[self.plugin] = make_integrator(self.kind, traced(scene, self.channels), **properties)
        return scene, sensor, _last.integrators[self.plugin]


@dataclass(frozen=True)
class Exposure:
    """Everything that the units of an image share, except the table of sample sets.

    Attributes
    ----------
    shot : Shot
        What the image is of.
    layout : Layout
        The columns of a unit's sums.
    shape : (int, int, int)
        Of the sums of the first unit; the last one may have fewer rows.
    spp : int
        Samples per pixel.
    seed : int
        Of the image.
    """

    shot: Shot
    layout: Layout
    shape: tuple[int, int, int]
    spp: int
    seed: int


class _Last:
    """The last scene and the last plug-in: a live scene slows other renders."""

    def __init__(self) -> None:
        self.scenes: dict[str, mi.Scene] = {}
        self.integrators: dict[str, mi.Integrator] = {}
        self.lock = threading.Lock()  # Mitsuba's current variant and Dr.Jit's state are those of a process

    def forget(self) -> None:
        """Drop both."""
        self.scenes.clear()
        self.integrators.clear()


_last = _Last()


@contextmanager
def forgetting() -> Iterator[None]:
    """Leave no scene in memory."""
    try:
        yield
    finally:
        _last.forget()


class Camera:
    """Makes series of units of images by one plug-in, and images of the values of any.

    Parameters
    ----------
    shot : Shot
        Of a scene on this machine.
    pool : Pool
        What computes the units.
    """

    def __init__(self, shot: Shot, pool: Pool) -> None:
        self.scene, self.sensor, self.integrator = shot.loaded()
        self._pool = pool
        scene, *others = scene_files(shot.scene.path, shot.parameters)
        self._shot = replace(shot, scene=pool.send(scene, others))
        self._footprint = Footprint(self.sensor.film())

    def series(self, name: str, spp: int, seed: int, table_seed: int | None = None) -> Series:
        """The units of an image; its table, if it has one, is of the image's seed or of another that is named."""
        spp = self.integrator.granted(self.sensor, spp)
        table = None
        if self.integrator.tabled:
            recipe = self.integrator.recipe(self.sensor, seed if table_seed is None else table_seed, spp)
            table = self._pool.share(table_of, recipe)
        layout = self.integrator.layout(self.sensor.film())
        exposure = Exposure(self._shot, layout, self._footprint.strip_shape(spp, layout), spp, seed)
        count = len(self._footprint.bands(spp))
        return Series(name, count, (1 + math.prod(exposure.shape),), _band, (exposure, table))

    def bands(self, spp: int) -> int:
        """The number of units of an image."""
        return len(self._footprint.bands(self.integrator.granted(self.sensor, spp)))

    def develop(self, done: Pass) -> Array:
        """The image (height, width, channels) that a render in one round gives."""
        image = alone(done, blend=self.integrator.blend)
        return np.array(self.integrator.develop(self.sensor.film(), *image), dtype=np.float64)

    def film(self, rounds: Rounds) -> tuple[Array, list[str]]:
        """What the film shows of rounds, (height, width, channels), and the names of its channels."""
        film = self.sensor.film()
        image = np.array(self.integrator.develop(film, rounds.image, rounds.mean_lambda), dtype=np.float64)
        return image, self.integrator.developed_names(film)

    def passes(self, series: Iterable[Series], advance: Advance) -> Generator[tuple[Pass, float]]:
        """The images of series, and the seconds that their units took, in all."""
        coming: list[Series] = []

        def noted() -> Iterator[Series]:
            for one in series:
                coming.append(one)
                yield one

        values = self._pool.values(noted(), advance)
        for first in values:
            one = coming.pop(0)
            exposure: Exposure = one.arguments[0]
            seconds = 0.0

            def strips(one: Series = one, exposure: Exposure = exposure, first: Array = first) -> Iterator[Array]:
                nonlocal seconds
                for value in (first, *islice(values, one.count - 1)):
                    seconds += float(value[0])
                    yield value[1:].reshape(exposure.shape)

            bands = self._footprint.bands(exposure.spp)
            yield self._footprint.whole(strips(), bands, exposure.layout), seconds


def table_of(recipe: Recipe) -> SampleTable:
    """The table of a recipe. Only that of seed 0 of each kind is kept on disk."""
    return recipe.kept() if recipe.seed == 0 else recipe.make()


def _band(exposure: Exposure, table: SampleTable | None, k: int) -> Array:
    """The seconds that rendering took, then the strip of band k, padded to the common shape of strips."""
    with _last.lock, one_line_errors():
        scene, sensor, integrator = exposure.shot.loaded()
        if table is not None:
            integrator.take(table)
        with _threads():
            strip, seconds = timed(integrator.render_band, scene, sensor, exposure.seed, exposure.spp, k)
    value = np.zeros(1 + math.prod(exposure.shape))
    value[0] = seconds
    value[1 : 1 + strip.size] = strip.ravel()
    return value


def timed(function: Callable[..., Array], *arguments: Any) -> tuple[Array, float]:
    """The value of ``function(*arguments)`` and the seconds that it took, without those of compiling kernels."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        start = time.perf_counter()
        value = function(*arguments)
        seconds = time.perf_counter() - start
        milliseconds = sum(kernel.get("backend_time", 0.0) for kernel in dr.kernel_history())
    return value, seconds - milliseconds / 1000


@contextmanager
def _threads() -> Iterator[None]:
    """Render on as many threads as VOROQUAD_NUM_THREADS says; Mitsuba reads and writes images on two at least."""
    before = dr.thread_count()
    if "VOROQUAD_NUM_THREADS" in os.environ:
        dr.set_thread_count(thread_count(None))
    try:
        yield
    finally:
        if dr.thread_count() != before:
            dr.set_thread_count(before)
