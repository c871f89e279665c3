"""Moving objects: the image is rendered in slices of time, the scene set to each slice's time before."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..designs.sampling import sample
from ..sample_tables import SampleTable
from .accumulation import Footprint
from .blend import Floats
from .domains import CameraSample
from .integrator import HALVES, Reweighted
from .motion import Track, TransformTrack, key_of_dict, keyframes
from .owen_sobol import OwenSobol
from .plain import Plain, band_seed
from .recipes import SCENE

#: What a parameter of the scene is at a time
Course = Callable[[Any], Any]


class ReweightedSlices(Reweighted):
    """Domain ``time`` with objects that move, deform or change (``reweighted`` with properties ``parameter@time``).

    .. pluginparameters::

     * - PARAMETER@TIME
       - |transform|, |float| or |vector|
       - Value of a parameter of the scene at a time, such as ``ball/to_world@0``: the parameter as
         `mitsuba.traverse` names it, with ``/`` for ``.``, and the time as a decimal or a fraction, such as ``1/2``
         (`mitsuba.load_dict` allows no points). Transforms go by slerp, numbers and vectors linearly.
         ``NAME/to_world@TIME`` moves a mesh too, which has no such parameter: the transform is applied to the vertices
         it was loaded with.
     * - slices
       - |bool|
       - Render in slices even without such properties: for parameters in `motion`. (Default: false)
     * - interleave
       - |int|
       - Even: pixels of a square of this side see different sets of times. (Default: 2)

    All properties of `Reweighted`, whose domain must be ``time``.

    Attributes
    ----------
    keys : dict
        The properties ``parameter@time``, for `mitsuba.load_dict`.
    motion : dict of callable
        For each moving parameter, a function of the time (`mitsuba.Float`, one value) that returns its value; to be
        extended from Python with anything that `mitsuba.traverse` exposes.

    Notes
    -----
    With m² interleaved sets of N times, pixel (x, y) takes set (x mod m, y mod m). Each of the m² N times is a slice:
    the scene is set to it and one ray per pixel of that set is traced. So all rays of a slice share their time and
    their weight; the scene is left as it was found. With equal weights and the sampler ``owensobol`` in Morton order,
    the m² sets of a square are parts of one set of m² N times.
    """

    def __init__(self, props: mi.Properties) -> None:
        props.mark_queried("slices")
        self.interleave = props.get("interleave", 2)
        if not isinstance(self.interleave, int) or self.interleave < 2 or self.interleave % 2:
            raise ValueError(f"interleave must be an even number of at least 2, got {self.interleave!r}")
        self.keys = {key_of_dict(key): props[key] for key in props if "@" in key}
        # A '.' is not allowed in the keys of load_dict
        self._tracks = {name.replace("/", "."): track for name, track in keyframes(props).items()}
        if single := next((name for name, track in self._tracks.items() if len(track.times) == 1), None):
            raise ValueError(f"{single!r} has a value at one time only; give its value at another time too")
        self.motion: dict[str, Course] = {}
        self._slice: Floats = np.zeros(1)  # time, N·w and N·c of the current slice, as the table has them
        super().__init__(props)
        if self.domain.name != "time":
            raise ValueError(f"moving objects need domain 'time', got {self.domain.name!r}; set domain to 'time'")
        if not self.tabled:
            raise ValueError(
                f"moving objects need the times of a table's sets; sampler {SCENE!r} has no table, so name another"
            )

    def check(self, scene: mi.Scene, sensor: mi.Sensor) -> None:
        """Raise ValueError if the shutter is closed, or if a moving parameter does not exist."""
        super().check(scene, sensor)
        known = list(mi.traverse(scene).keys())
        for name in (*self._tracks, *self.motion):
            if name not in known and f"{_shape(name)}.vertex_positions" not in known:
                near = difflib.get_close_matches(name, known, n=3, cutoff=0.3)
                raise ValueError(
                    f"the scene has no parameter {name!r} to move; near it are {', '.join(near) or 'none'}"
                )

    def prepare(self, *args: Any, **named: Any) -> tuple[mi.Sampler, int]:
        """Settle the samples per pixel; the sampler gives one of them at a time."""
        sampler, spp = super().prepare(*args, **named)
        sampler.set_samples_per_wavefront(1)
        return sampler, spp

    def band_means(self, scene: mi.Scene, sensor: mi.Sensor, seed: int, spp: int, number: int) -> Floats:
        """Means over the rays of each pixel of a band, slice by slice."""
        sampler, spp = self.prepare(sensor, seed, spp, self.aov_names(), number=number)
        columns, _ = Footprint(sensor.film()).window
        band, key = Footprint(sensor.film()).bands(spp)[number], band_seed(seed, number)
        shared = self._shared_times(sampler, spp, key)
        means: Floats = np.zeros(0)
        with self._moving(scene) as set_time:
            for y in range(self.interleave):
                for x in range(self.interleave):
                    rows = [row for row in band if row % self.interleave == y]
                    column, row = np.meshgrid(np.arange(x, columns, self.interleave), rows)
                    if column.size == 0:
                        continue
                    rng = np.random.default_rng((x, y, key))
                    pixels = np.stack([column.ravel(), row.ravel()])
                    of_pixels = self._begun(sampler, sensor, pixels, seed, int(rng.integers(2**32)))
                    slices = shared[x + self.interleave * y] if shared else self._rows(rng, (x + y) % 2, spp)
                    found = self._slices(scene, sensor, of_pixels, set_time, pixels, slices) / spp
                    if means.size == 0:
                        means = np.zeros((len(band), columns, found.shape[-1]))
                    means[row - band.start, column] = found.reshape(*row.shape, -1)
        return means.reshape(len(band) * columns, -1)

    def _slices(
        self,
        scene: mi.Scene,
        sensor: mi.Sensor,
        sampler: mi.Sampler,
        set_time: Callable[[float], None],
        pixels: Any,
        slices: Iterable[Floats],
    ) -> Floats:
        """Sums over slices of the pixels (2, n) of the window that share them."""
        film, footprint = sensor.film(), Footprint(sensor.film())
        corner = mi.Point2i(pixels.astype(np.int32)) + mi.ScalarPoint2i(film.crop_offset()) - footprint.border
        index = dr.arange(mi.UInt32, pixels.shape[1])
        sums: list[mi.Float] = []
        for self._slice in slices:
            set_time(sensor.shutter_open() + float(self._slice[0]) * sensor.shutter_open_time())
            values = self.columns(scene, film, sampler, self.rays_of(sensor, sampler, index, corner))
            sums = [s + v for s, v in zip(sums, values, strict=True)] if sums else values
            sampler.advance()
            sampler.schedule_state()
            dr.eval(sums)
        width = pixels.shape[1]
        return np.stack([np.broadcast_to(np.array(s, dtype=np.float64), width) for s in sums], -1)

    def _begun(self, sampler: mi.Sampler, sensor: mi.Sensor, pixels: Any, seed: int, salt: int) -> mi.Sampler:
        """A sampler for pixels (2, n), one sample at a time: `OwenSobol` draws what it draws in the whole image."""
        sampler = sampler.clone()
        sampler.set_samples_per_wavefront(1)
        if isinstance(sampler, OwenSobol):
            width, height = Footprint(sensor.film()).window
            sampler.cover(width, height, range(height), order=self.pixel_order)
            sampler.pick(mi.UInt32((pixels[1] * width + pixels[0]).astype(np.uint32)))
        sampler.seed(dr.opaque(mi.UInt32, seed if isinstance(sampler, OwenSobol) else salt), pixels.shape[1])
        return sampler

    def _rows(self, rng: np.random.Generator, half: int, spp: int) -> Iterator[Floats]:
        """Rows of the table for `spp` slices: those of sets drawn from a half's."""
        halves = min(HALVES, self._sets)
        own = np.arange(half % halves, self._sets, halves)
        for chosen in rng.choice(own, spp // self._n):
            yield from self._rows_of_sets[chosen]

    def _shared_times(self, sampler: mi.Sampler, spp: int, seed: int) -> list[Floats]:
        """For each pixel of a square, the rows (spp, 1) of its slices; none where the table's sets are to be used.

        Where pixels near each other complement each other, the sets of a square are parts of one set of as many times
        together: of each run of neighbouring times, every pixel has one. A design that has no sets of so many times
        leaves each pixel its own.
        """
        settings, squares = self._settings, self.interleave**2
        if settings is None or self.weighted or not isinstance(sampler, OwenSobol) or sampler.order == "none":
            return []
        rng = np.random.default_rng((squares, seed))
        parts = []
        for _ in range(spp // self._n):
            try:
                drawn = sample(settings.design, squares * self._n, 1, rng=rng)
            except ValueError:  # of this number: `check_samples` has drawn a set of n
                return []
            times = np.sort(drawn.points.ravel())
            parts.append(rng.permuted(times.reshape(self._n, squares), axis=1))
        return list(np.concatenate(parts).T[..., None])

    def _upload(self, table: SampleTable) -> Floats:
        """Keep times and weights here too: the scene is set to a time, and all rays of a slice have them in common."""
        self._rows_of_sets = super()._upload(table)
        return self._rows_of_sets

    def camera_sample(
        self, sensor: mi.Sensor, sampler: mi.Sampler, index: mi.UInt32, corner: mi.Point2i
    ) -> CameraSample:
        """Draw the camera sample, at the time and with the weight of the slice."""
        drawn = Plain.camera_sample(self, sensor, sampler, index, corner)
        time, *weights = (dr.opaque(mi.Float, float(value)) for value in self._slice)
        drawn.time = time
        if self.weighted:
            drawn.factor, drawn.noise = weights[:2]
        return drawn

    @contextmanager
    def _moving(self, scene: mi.Scene) -> Iterator[Callable[[float], None]]:
        """Yield a function that sets the scene to a time; leave the scene as it was."""
        parameters = mi.traverse(scene)
        courses: dict[str, Course] = dict(self.motion)
        for name, track in self._tracks.items():
            courses |= _courses(parameters, name, track)
        before = {name: type(parameters[name])(parameters[name]) for name in courses}

        def set_time(time: float) -> None:
            now = dr.opaque(mi.Float, time)  # a literal would be compiled into every kernel that sees it
            for name, course in courses.items():
                parameters[name] = course(now)
            parameters.update()

        try:
            yield set_time
        finally:
            for name, value in before.items():
                parameters[name] = value
            parameters.update()

    def render_forward(self, *args: Any, **named: Any) -> mi.TensorXf:
        """Derivatives of the mean over slices are not made."""
        raise NotImplementedError("derivatives of moving objects are not supported; take those at fixed times")

    render_backward = render_forward

    def to_string(self) -> str:
        return f"{super().to_string()[:-1]}, moving = {sorted({*self._tracks, *self.motion})}]"


def _shape(name: str) -> str:
    """The shape that a name moves."""
    return name.removesuffix(".to_world")


def _courses(parameters: mi.SceneParameters, name: str, track: Track) -> dict[str, Course]:
    """What a track sets: the parameter of its name, or the vertices of a mesh that has no transform."""
    if name in parameters:
        kind = type(parameters[name])
        if isinstance(track, TransformTrack):
            return {name: track.at}
        if kind is float:
            return {name: lambda time: float(track.at(time)[0][0])}
        return {name: lambda time: kind(*track.at(time))}

    def vertices(key: str, kind: Any) -> Course:
        start = dr.unravel(kind, mi.Float(parameters[key]))
        return lambda time: dr.ravel(track.at(time) @ start)

    courses = {f"{_shape(name)}.vertex_positions": vertices(f"{_shape(name)}.vertex_positions", mi.Point3f)}
    normals = f"{_shape(name)}.vertex_normals"
    if normals in parameters and dr.width(parameters[normals]) > 0:
        courses[normals] = vertices(normals, mi.Normal3f)
    return courses


def make_reweighted(props: mi.Properties) -> Reweighted:
    """The plug-in ``reweighted``: in slices of time if objects move, else in one go."""
    moves = props.get("slices", False) or any("@" in key for key in props)
    return (ReweightedSlices if moves else Reweighted)(props)


mi.register_integrator("reweighted", make_reweighted)
