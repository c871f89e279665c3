"""The integrator plug-ins ``plain`` and ``reweighted``; made anew for each Mitsuba variant."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

import drjit as dr
import mitsuba as mi
import numpy as np
from mitsuba.python.ad.integrators.common import ADIntegrator, RBIntegrator

from .._checks import one_of, positive_int
from ..samplers import DESIGNS, sample
from ..tables import SampleTable
from ..weights import find_rule
from .accumulation import Floats, Footprint, Pass, pixel_means, quotient
from .bands import table_of
from .blend import TILE
from .domains import CameraSample, Domain, Joint, find_domain
from .lights import FirstHit
from .rounds import Rounds

#: Samples of a table, about
TABLE_SIZE = 2**18


@dataclass
class CameraRays:
    """The camera rays of a wavefront: the rays of a pixel are consecutive; pixels go row by row."""

    ray: Any  # mi.RayDifferential3f
    weight: Any  # mi.Spectrum
    index: Any  # mi.UInt32, pixel · spp + (sample of the pixel)
    corner: Any  # mi.Point2i, of the pixel on the film
    drawn: CameraSample

    @property
    def position(self) -> mi.Point2f:
        """Where they start on the film."""
        return mi.Point2f(self.corner) + self.drawn.pixel


class Plain(ADIntegrator):
    """Renders through a nested integrator, with all camera samples from the scene's sampler (``plain``).

    The baseline of ``reweighted``: its images differ from the nested integrator's own in nothing but the
    pixel samples, if `jitter` is false.

    .. pluginparameters::

     * - (nested plug-in)
       - :paramtype:`integrator`
       - The integrator that traces the camera rays: any sampling integrator of Mitsuba, or one that
         computes derivatives by radiative backpropagation (``prb``, ...).
     * - (nested plug-in)
       - :paramtype:`sampler`
       - Sampler for all that the sets do not sample. (Default: that of the scene's sensor)
     * - jitter
       - |bool|
       - Sample the pixel's area? If false, all its rays start at its centre. (Default: |true|)

    Notes
    -----
    A subclass replaces coordinates of the camera sample (`camera_sample`).
    """

    def __init__(self, props: mi.Properties) -> None:
        # Not ADIntegrator's own: it would accept max_depth and rr_depth, which belong to the nested one
        super(ADIntegrator, self).__init__(props)
        self.nested, self._sampler = _nested_objects(props)
        self.jitter = _property(props, "jitter", True)
        self._seed = mi.UInt32(0)
        self.weighted = self.blend = False
        self.samples = 0
        self._rays: CameraRays | None = None  # those of sample_rays, until sample has traced them

    def aov_names(self) -> list[str]:
        """Names of the nested integrator's extra channels."""
        return list(self.nested.aov_names())

    def prepare(
        self,
        sensor: mi.Sensor,
        seed: mi.UInt32 = 0,
        spp: int = 0,
        aovs: list[str] | None = None,
        *,
        rows: int | None = None,
    ) -> tuple[mi.Sampler, int]:
        """Seed the sampler for one wavefront of so many rows (without a number, all), ready the film, keep the seed.

        The seed is opaque to the compiler, so that a new one costs no compilation.
        """
        film = sensor.film()
        sampler = self._sampler_of(sensor, spp)
        spp = sampler.sample_count()
        sampler.set_samples_per_wavefront(spp)
        columns, height = Footprint(film).window
        rays = columns * (height if rows is None else rows) * spp
        if rays > 2**32:
            raise ValueError(f"{rays} samples in one pass are more than 2^32; render in rounds of fewer samples")
        self._seed = dr.opaque(mi.UInt32, seed) if isinstance(seed, int) else mi.UInt32(seed)
        sampler.seed(self._seed, rays)
        film.prepare(aovs or [])
        return sampler, spp

    def granted(self, sensor: mi.Sensor, spp: int = 0) -> int:
        """The samples per pixel that the sampler makes when asked for so many, or for none in particular."""
        return int(self._sampler_of(sensor, spp).sample_count())

    def _sampler_of(self, sensor: mi.Sensor, spp: int) -> mi.Sampler:
        sampler = (self._sampler or sensor.sampler()).clone()
        if spp != 0:
            sampler.set_sample_count(spp)
        return sampler

    # ------------------------------------------------------------------ the steps of a camera sample

    def camera_sample(
        self, sensor: mi.Sensor, sampler: mi.Sampler, index: mi.UInt32, corner: mi.Point2i
    ) -> CameraSample:
        """Draw the camera sample of ray `index`, of the pixel with this corner."""
        pixel = mi.Point2f(sampler.next_2d()) if self.jitter else mi.Point2f(0.5)
        lens = mi.Point2f(sampler.next_2d()) if sensor.needs_aperture_sample() else mi.Point2f(0.5)
        time = sampler.next_1d() if sensor.shutter_open_time() > 0 else mi.Float(0)
        wavelength = sampler.next_1d() if mi.is_spectral else mi.Float(0)
        return CameraSample(pixel, lens, time, wavelength)

    def camera_rays(self, sensor: mi.Sensor, sampler: mi.Sampler, band: range | None = None) -> CameraRays:
        """Camera rays of the wavefront, of a band of rows or of all, by their camera samples."""
        film = sensor.film()
        spp = sampler.sample_count()
        width, height = Footprint(film).window
        band = band or range(height)

        index = dr.arange(mi.UInt32, width * len(band) * spp)
        pixel_index = quotient(index, spp)
        row_of_band = pixel_index // int(width)  # a literal: multiplied by its inverse
        column = pixel_index - row_of_band * width
        row = row_of_band + dr.opaque(mi.UInt32, band.start)
        corner = mi.Point2i(mi.Int32(column), mi.Int32(row)) + mi.ScalarPoint2i(film.crop_offset())
        return self.rays_of(sensor, sampler, index, corner - Footprint(film).border)

    def rays_of(self, sensor: mi.Sensor, sampler: mi.Sampler, index: mi.UInt32, corner: mi.Point2i) -> CameraRays:
        """Camera rays of given numbers, in the pixels with these corners."""
        film = sensor.film()

        # Map the sample to the sensor, whose film coordinates span the crop window
        drawn = self.camera_sample(sensor, sampler, index, corner)
        position = mi.Point2f(corner) + drawn.pixel
        on_film = (position - mi.ScalarVector2f(film.crop_offset())) / mi.ScalarVector2f(film.crop_size())
        with dr.resume_grad():
            ray, weight = sensor.sample_ray_differential(
                time=sensor.shutter_open() + drawn.time * sensor.shutter_open_time(),
                sample1=drawn.wavelength,
                sample2=on_film,
                sample3=drawn.lens,
            )

        # spp rays share a pixel: texture filters should look at 1/spp of its area, as in Mitsuba's C++ integrators
        if ray.has_differentials:
            ray.scale_differential(dr.rsqrt(mi.Float(dr.opaque(mi.Float, sampler.sample_count()))))
        return CameraRays(ray, weight, index, corner, drawn)

    def sample_rays(
        self, scene: mi.Scene, sensor: mi.Sensor, sampler: mi.Sampler
    ) -> tuple[mi.RayDifferential3f, mi.Spectrum, mi.Point2f]:
        """Camera rays of the wavefront, their weights, and where on the film they count."""
        rays = self.camera_rays(sensor, sampler)
        self._rays = rays
        # A box filter counts the whole pixel: its corner avoids rounding into the next one
        box = sensor.film().rfilter().is_box_filter()
        return rays.ray, rays.weight, mi.Point2f(rays.corner) if box else rays.position

    # ------------------------------------------------------------------ what the nested integrator does

    def sample(
        self, mode: Any = None, scene: Any = None, sampler: Any = None, *rest: Any, **known: Any
    ) -> tuple[mi.Spectrum, mi.Bool, list[mi.Float], Any]:
        """Radiance along the rays of `sample_rays`, by the nested integrator."""
        if self._rays is None:
            raise RuntimeError(
                f"'{_plugin_name(self)}' must be the outermost integrator: another one around it (such as 'aov') "
                "draws its own camera rays; put that one inside"
            )
        rays, self._rays = self._rays, None
        radiance, valid, aovs = self.follow(scene, sampler, rays, known.get("active", mi.Bool(True)))
        return radiance, valid, aovs, None

    def follow(
        self, scene: mi.Scene, sampler: mi.Sampler, rays: CameraRays, active: mi.Bool
    ) -> tuple[mi.Spectrum, mi.Bool, list[mi.Float]]:
        """Radiance along camera rays, whether they hit something, and the extra channels."""
        if not isinstance(self.nested, ADIntegrator):
            radiance, valid, aovs = self.nested.sample(scene, sampler, rays.ray, None, active)
            return radiance, valid, list(aovs)
        radiance, valid, aovs, _ = self.nested.sample(
            mode=dr.ADMode.Primal,
            scene=scene,
            sampler=sampler,
            ray=rays.ray,
            depth=mi.UInt32(0),
            δL=None,
            δaovs=None,
            state_in=None,
            active=active,
        )
        return radiance, valid, list(aovs)

    # ------------------------------------------------------------------ the image

    def render(
        self,
        scene: mi.Scene,
        sensor: int | mi.Sensor = 0,
        seed: mi.UInt32 = 0,
        spp: int = 0,
        develop: bool = True,
        evaluate: bool = True,
    ) -> mi.TensorXf:
        """The image, also left in the sensor's film."""
        if isinstance(sensor, int):
            sensor = scene.sensors()[sensor]
        with dr.suspend_grad():
            done = self.render_pass(scene, sensor, seed, spp)
            rounds = Rounds(done.plain.shape, blend=self.blend)
            rounds.add(done)
            return self.develop(sensor.film(), rounds)

    def render_pass(self, scene: mi.Scene, sensor: mi.Sensor, seed: mi.UInt32, spp: int) -> Pass:
        """Trace all rays, band after band; the image with equal weights, and what the weights change."""
        footprint, spp = Footprint(sensor.film()), self.granted(sensor, spp)
        bands = footprint.bands(spp)
        seed = int(np.array(seed).ravel()[0])
        strips = (self.render_band(scene, sensor, seed, spp, number) for number in range(len(bands)))
        return footprint.whole(strips, bands, self.channels(sensor.film()))

    def render_band(self, scene: mi.Scene, sensor: mi.Sensor, seed: int, spp: int, number: int) -> Floats:
        """The strip of a band, see `Footprint`: the same bits whenever and wherever it is rendered."""
        self.check(scene, sensor)
        footprint = Footprint(sensor.film())
        band = footprint.bands(spp)[number]
        means = self.band_means(scene, sensor, band_seed(seed, number), spp, band)
        return footprint.strip(means, self.channels(sensor.film()), band)

    def band_means(self, scene: mi.Scene, sensor: mi.Sensor, seed: int, spp: int, band: range) -> Floats:
        """Means over the rays of each pixel of a band of what they give, see `Footprint.spread`."""
        sampler, spp = self.prepare(sensor, seed, spp, self.aov_names(), rows=len(band))
        rays = self.camera_rays(sensor, sampler, band)
        channels, change = self.values(scene, sensor.film(), sampler, rays)
        return pixel_means(Footprint(sensor.film()).spread(channels, change, rays.drawn.pixel), rays.index, spp)

    def check(self, scene: mi.Scene, sensor: mi.Sensor) -> None:
        """Raise ValueError if the film has no colours."""
        film = sensor.film()
        if mi.has_flag(film.flags(), mi.FilmFlags.Special):
            name = _plugin_name(self)
            raise ValueError(f"{name!r} renders to films of colours such as 'hdrfilm', not {film.class_name()}")

    def channels(self, film: mi.Film) -> int:
        """The number of channels that are rendered: colours, alpha where the film has it, the nested integrator's."""
        return 3 + mi.has_flag(film.flags(), mi.FilmFlags.Alpha) + len(self.nested.aov_names())

    def values(
        self, scene: mi.Scene, film: mi.Film, sampler: mi.Sampler, rays: CameraRays
    ) -> tuple[list[mi.Float], list[mi.Float]]:
        """What rays bring to the channels of the film (colours, alpha, others), and what weights add to colours."""
        radiance, valid, aovs = self.follow(scene, sampler, rays, mi.Bool(True))
        return self._film_channels(film, rays, radiance, valid, aovs), []

    @staticmethod
    def _film_channels(
        film: mi.Film, rays: CameraRays, radiance: mi.Spectrum, valid: mi.Bool, aovs: list[mi.Float]
    ) -> list[mi.Float]:
        channels = [*_colour(radiance * rays.weight, rays.ray.wavelengths)]
        if mi.has_flag(film.flags(), mi.FilmFlags.Alpha):
            channels.append(dr.select(valid, mi.Float(1), mi.Float(0)))
        return channels + aovs

    def develop(self, film: mi.Film, rounds: Rounds) -> mi.TensorXf:
        """Put the mean of rounds into the film, and develop it."""
        image = rounds.image
        base = 4 if mi.has_flag(film.flags(), mi.FilmFlags.Alpha) else 3
        own = [rounds.mean_lambda[..., None]] if "lambda" in self.aov_names() else []
        channels = [image[..., :base], np.ones((*image.shape[:2], 1)), image[..., base:], *own]  # 1: the film's weight
        block = mi.ImageBlock(mi.TensorXf(np.concatenate(channels, -1, dtype=np.float32)), offset=film.crop_offset())
        film.prepare(self.aov_names())
        film.put_block(block)
        return film.develop()

    def render_forward(self, scene: mi.Scene, params: Any, *args: Any, **named: Any) -> mi.TensorXf:
        """Forward derivative of the image."""
        with self._derivatives() as integrator:
            return integrator.render_forward(scene, params, *args, **named)

    def render_backward(self, scene: mi.Scene, params: Any, grad_in: mi.TensorXf, *args: Any, **named: Any) -> None:
        """Backward derivative of the image."""
        with self._derivatives() as integrator:
            integrator.render_backward(scene, params, grad_in, *args, **named)

    @contextmanager
    def _derivatives(self) -> Iterator[Any]:
        """What computes derivatives: an integrator of radiative backpropagation by its own means, others by unrolling
        their loops, as Dr.Jit asks.
        """
        if isinstance(self.nested, ADIntegrator):
            with self._camera_lent():
                yield self.nested
        else:
            with dr.scoped_set_flag(dr.JitFlag.SymbolicLoops, False):
                yield super()

    @contextmanager
    def _camera_lent(self) -> Iterator[None]:
        """Let the nested integrator draw its camera rays by our steps."""
        self.nested.prepare, self.nested.sample_rays = self.prepare, self.sample_rays
        try:
            yield
        finally:
            del self.nested.prepare, self.nested.sample_rays
            self._rays = None

    def to_string(self) -> str:
        return f"{type(self).__name__}[jitter = {self.jitter}, nested = {self.nested}]"


class Reweighted(Plain):
    """Renders through a nested integrator with camera samples from weighted sample sets (``reweighted``).

    .. pluginparameters::

     * - (nested plug-in)
       - :paramtype:`integrator`
       - The integrator that traces the camera rays: any sampling integrator of Mitsuba, or one that
         computes derivatives by radiative backpropagation (``prb``, ...).
     * - (nested plug-in)
       - :paramtype:`sampler`
       - Sampler for all that the sets do not sample. (Default: that of the scene's sensor)
     * - domain
       - |string|
       - What the sets sample: ``lens``, the aperture of a thin lens; ``time``, between opening and closing of the
         shutter; ``wavelength``, in a spectral variant; ``light``, the emitter sample at the first hit; ``pixel``, its
         area; or several of them at once, such as ``pixel+time``. (Default: ``lens``)
     * - sampler
       - |string|
       - Design of the sets: ``uniform``, ``stratified``, ``regular``, ``sobol``, ``halton`` or ``zero-two``.
         (Default: ``stratified``)
     * - order
       - |int|
       - Order of the weights, see `voroquad.weights`. (Default: 0, Voronoi cells)
     * - debias
       - |string|
       - How the bias of the weights is removed, see `voroquad.weights`. (Default: ``none``)
     * - weighted
       - |bool|
       - If false, the same samples count equally. (Default: |true|)
     * - blend
       - |string|
       - ``auto``: per tile of 16 × 16 pixels, the share λ of the weights that leaves least noise, from 0 (equal
         weights) to 1, see `voroquad.mitsuba.blend`. ``off``: the weights as they are. (Default: ``auto``)
     * - samples
       - |int|
       - Samples of a set. They must divide the samples per pixel: a pixel of 64 samples takes one set of
         64 or, independently, four sets of 16. (Default: 0, all samples of a pixel form one set)
     * - jitter
       - |bool|
       - Sample the pixel's area? If false, all its rays start at its centre. (Default: |true|)
     * - sets
       - |int|
       - Sets of the table, 2 or more for blend. (Default: 0, from 64 to 1024 by the size of a set)
     * - reuse
       - |string|
       - Which pixels share sets: ``hash``, a hash of pixel and render seed picks one; ``tile``, all tiles of
         16 × 16 pixels have the same sets at the same places. (Default: ``hash``)
     * - table_seed
       - |int|
       - Seed of the table; that of seed 0 is kept on disk for the next time. (Default: 0)
     * - table
       - |string|
       - File of a table made by ``voroquad table``. It settles sampler, order, debias, samples, sets
         and table_seed, which must then be absent.
     * - aovs
       - |string|
       - ``lambda`` adds the channel of that name: the blend's λ. (Default: none)

    Notes
    -----
    Sample i of a set of N multiplies its ray's weight by N·w_i. The image is then Σ w f over the set, with f
    averaged over everything else that the path samples: w depends on the set's coordinates only, so unbiased
    weights give an unbiased image. With the domain ``light`` alone, the weights multiply what the emitter sample
    brings, and nothing else. Weights sum to 1, hence a constant image stays constant, exactly. Extra
    channels (``aov`` inside) and alpha are not weighted. With ``jitter`` false the image is that of point
    samples at the pixel centres. The same seeds give the same bits on any number of threads (on processors).

    Derivatives are those of the image without blend.
    """

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        self.domain = find_domain(_property(props, "domain", "lens"))
        if "pixel" in self.domain.name and not self.jitter:
            raise ValueError(f"jitter must be true for domain {self.domain.name!r}: it samples the pixel's area")
        self._first_hit = FirstHit(self.nested) if "light" in self.domain.name else None
        self.weighted = _property(props, "weighted", True)
        self.blend = one_of("blend", _property(props, "blend", "auto"), ("auto", "off")) == "auto" and self.weighted
        self.reuse = one_of("reuse", _property(props, "reuse", "hash"), ("hash", "tile"))
        self.aovs = _names("aovs", _property(props, "aovs", ""), ("lambda",))
        self._file = _table_file(props, self.domain)
        if self._file is None:
            self.samples = _count(props, "samples")
            self._recipe = _recipe(props, self.domain, self.weighted)
        else:
            self.samples, self._recipe = self._file.n, {}
        sets = self._file.sets if self._file else self._recipe["sets"]
        if self.blend and sets == 1:
            raise ValueError("sets must be 2 or more for blend='auto', got 1; or set blend to 'off'")
        self._n = 0  # samples of a set of the table at hand

    def aov_names(self) -> list[str]:
        """Names of the extra channels: those of the nested integrator, then one's own."""
        return [*super().aov_names(), *self.aovs]

    def check(self, scene: mi.Scene, sensor: mi.Sensor) -> None:
        """Raise ValueError if the scene does not have the domain, or its film no colours."""
        self.domain.check(scene, sensor)
        super().check(scene, sensor)

    def prepare(self, *args: Any, **named: Any) -> tuple[mi.Sampler, int]:
        """Settle the samples per pixel, and make the table if it is not there."""
        sampler, spp = super().prepare(*args, **named)
        n = self.samples or spp
        if spp % n:
            raise ValueError(f"sets of samples={n} do not divide {spp} samples per pixel; take a multiple of {n}")
        if n != self._n:
            self._upload(self._file or table_of(self.recipe(n)))
        return sampler, spp

    def recipe(self, n: int, seed: int | None = None) -> dict[str, Any]:
        """How to make the table for sets of n samples: with the seed of the properties, or another."""
        sets = self._recipe["sets"] or max(64, min(1024, TABLE_SIZE // n))
        return self._recipe | {"n": n, "sets": sets} | ({} if seed is None else {"rng": seed})

    def take(self, table: SampleTable) -> None:
        """Take another table from the next render on."""
        if self._file is not None:
            raise ValueError("table= names a file, and rounds need a new table each; name its sampler instead")
        self._upload(table)

    def _upload(self, table: SampleTable) -> None:
        """Hand points and N·w to the device in its own precision."""
        below_one = np.nextafter(np.float32(1), np.float32(0))
        points = np.minimum(table.points.astype(np.float32), below_one)
        self._points = mi.Float(points.ravel())
        self._factors = mi.Float((table.n * table.weights).astype(np.float32).ravel())
        self._n, self._sets = table.n, table.sets

    # ------------------------------------------------------------------ samples and weights from the table

    def row(self, index: mi.UInt32, spp: int, corner: mi.Point2i) -> mi.UInt32:
        """The row of the table for ray `index` of the pixel with this corner.

        The pixels of a checkerboard's halves share no set, so that one half may choose λ for the other.
        """
        group = quotient(index, self._n)
        if self.reuse == "tile":
            place = (corner.x & (TILE - 1)) + TILE * (corner.y & (TILE - 1))
            groups = spp // self._n
            key = mi.UInt32(place) * groups + (group - quotient(index, spp) * groups)
        else:
            key = group
        hashed, _ = mi.sample_tea_32(key, self._seed)
        halves = min(2, self._sets)
        half = mi.UInt32((corner.x + corner.y) & (halves - 1))
        of_half = (self._sets + halves - 1 - half) // halves  # every other set, from the half's first
        chosen = halves * dr.mul_hi(hashed, of_half) + half  # ⌊hash · of_half / 2³²⌋
        return (chosen - group) * self._n + index

    def camera_sample(
        self, sensor: mi.Sensor, sampler: mi.Sampler, index: mi.UInt32, corner: mi.Point2i
    ) -> CameraSample:
        """Draw the camera sample, replace its coordinates of the domain, and weigh it."""
        drawn = super().camera_sample(sensor, sampler, index, corner)
        row = self.row(index, sampler.sample_count(), corner)
        d = self.domain.dimension
        self.domain.place(drawn, [dr.gather(mi.Float, self._points, row * d + axis) for axis in range(d)])
        if self.weighted:
            drawn.factor = dr.gather(mi.Float, self._factors, row)
        return drawn

    @property
    def _weighs_all(self) -> bool:
        """Do the weights multiply all that a ray brings, not only the emitter sample at its first hit?"""
        return self._first_hit is None or isinstance(self.domain, Joint)

    def sample_rays(
        self, scene: mi.Scene, sensor: mi.Sensor, sampler: mi.Sampler
    ) -> tuple[mi.RayDifferential3f, mi.Spectrum, mi.Point2f]:
        """Camera rays of the wavefront, their weights (times N·w), and where on the film they count."""
        ray, weight, position = super().sample_rays(scene, sensor, sampler)
        assert self._rays is not None
        factor = self._rays.drawn.factor
        return ray, weight if factor is None or not self._weighs_all else weight * factor, position

    def follow(
        self, scene: mi.Scene, sampler: mi.Sampler, rays: CameraRays, active: mi.Bool
    ) -> tuple[mi.Spectrum, mi.Bool, list[mi.Float]]:
        """Radiance along camera rays (but for their own weight), whether they hit something, the extra channels."""
        weighed, rest, valid, aovs = self.split(scene, sampler, rays, active)
        factor = rays.drawn.factor
        return weighed * (1 if factor is None or self._weighs_all else factor) + rest, valid, aovs

    def split(
        self, scene: mi.Scene, sampler: mi.Sampler, rays: CameraRays, active: mi.Bool
    ) -> tuple[mi.Spectrum, mi.Spectrum, mi.Bool, list[mi.Float]]:
        """Radiance that the weights multiply, radiance that they do not, whether rays hit, and the extra channels."""
        if self._first_hit is None:
            radiance, valid, aovs = super().follow(scene, sampler, rays, active)
            return radiance, mi.Spectrum(0), valid, aovs
        light = self._first_hit.trace(scene, sampler, rays.ray, rays.drawn.light, active)
        if self._weighs_all:
            return light.sampled + light.rest, mi.Spectrum(0), light.valid, []
        return light.sampled, light.rest, light.valid, []

    def values(
        self, scene: mi.Scene, film: mi.Film, sampler: mi.Sampler, rays: CameraRays
    ) -> tuple[list[mi.Float], list[mi.Float]]:
        """What rays bring to the channels of the film (colours, alpha, others), and what the weights add to colours."""
        weighed, rest, valid, aovs = self.split(scene, sampler, rays, mi.Bool(True))
        channels = self._film_channels(film, rays, weighed + rest, valid, aovs)
        if rays.drawn.factor is None:
            return channels, []
        return channels, [*_colour(weighed * (rays.drawn.factor - 1) * rays.weight, rays.ray.wavelengths)]

    def render_forward(self, scene: mi.Scene, params: Any, sensor: Any = 0, *args: Any, **named: Any) -> mi.TensorXf:
        """Forward derivative of the image without blend."""
        self.check(scene, scene.sensors()[sensor] if isinstance(sensor, int) else sensor)
        return super().render_forward(scene, params, sensor, *args, **named)

    def render_backward(
        self, scene: mi.Scene, params: Any, grad_in: mi.TensorXf, sensor: Any = 0, *args: Any, **named: Any
    ) -> None:
        """Backward derivative of the image without blend."""
        self.check(scene, scene.sensors()[sensor] if isinstance(sensor, int) else sensor)
        super().render_backward(scene, params, grad_in, sensor, *args, **named)

    def to_string(self) -> str:
        return (
            f"{type(self).__name__}[domain = {self.domain.name}, weighted = {self.weighted}, blend = {self.blend}, "
            f"{self._recipe}, nested = {self.nested}]"
        )


def band_seed(seed: int, number: int) -> int:
    """The seed of a band: of the first the image's own, of the others independent ones."""
    return seed if number == 0 else int(np.random.SeedSequence((seed, number), spawn_key=(1,)).generate_state(1)[0])


def _colour(radiance: mi.Spectrum, wavelengths: Any) -> mi.Color3f:
    """Linear sRGB of radiance along rays."""
    if mi.is_polarized:
        radiance = mi.unpolarized_spectrum(radiance)
    if mi.is_spectral:
        return mi.spectrum_to_srgb(radiance, wavelengths)
    return mi.Color3f(radiance.x) if mi.is_monochromatic else mi.Color3f(radiance)


# ---------------------------------------------------------------------- properties


def _plugin_name(integrator: Plain) -> str:
    return "reweighted" if isinstance(integrator, Reweighted) else "plain"


_KINDS = {bool: "true or false", int: "a whole number", str: "a name"}
Value = TypeVar("Value", bool, int, str)


def _property(props: mi.Properties, name: str, default: Value) -> Value:
    """A property, of the type of its default."""
    value = props.get(name, default)
    if type(value) is not type(default):
        raise ValueError(f"{name} must be {_KINDS[type(default)]}, got {value!r}")
    return value


def _nested_objects(props: mi.Properties) -> tuple[mi.Integrator, mi.Sampler | None]:
    """The nested integrator, which must be able to follow given camera rays, and the nested sampler if any."""
    nested = [value for _, value in props.objects()]
    name = props.plugin_name()
    integrators = [value for value in nested if isinstance(value, mi.Integrator)]
    samplers = [value for value in nested if isinstance(value, mi.Sampler)]
    if len(integrators) != 1 or len(samplers) > 1 or len(nested) != len(integrators) + len(samplers):
        raise ValueError(f"'{name}' needs one nested integrator (and at most one sampler), got {len(nested)} objects")
    integrator = integrators[0]
    follows_rays = isinstance(integrator, mi.SamplingIntegrator) and (
        not isinstance(integrator, ADIntegrator) or isinstance(integrator, RBIntegrator)
    )
    if not follows_rays:
        raise ValueError(
            f"'{name}' cannot wrap {integrator.class_name()}: it draws its own rays; "
            "nest one that follows given ones, such as 'path', 'direct', 'volpath' or 'prb'"
        )
    return integrator, samplers[0] if samplers else None


def _count(props: mi.Properties, name: str) -> int:
    """A property that counts something; 0 leaves the choice to us."""
    return positive_int(name, count) if (count := _property(props, name, 0)) else 0


def _names(name: str, text: str, known: Iterable[str]) -> list[str]:
    """The names of a property that lists some, separated by commas."""
    return [one_of(name, part.strip(), known) for part in text.split(",") if part.strip()]


def _recipe(props: mi.Properties, domain: Domain, weighted: bool) -> dict[str, Any]:
    """How to make the table, but for the size of its sets."""
    recipe: dict[str, Any] = {
        "design": one_of("sampler", _property(props, "sampler", "stratified"), DESIGNS),
        "d": domain.dimension,
        "sets": _count(props, "sets"),
        "order": _property(props, "order", 0),
        "debias": _property(props, "debias", "none"),
        "rng": _property(props, "table_seed", 0),
    }
    recipe["periodic"] = domain.periodic and (recipe["order"], recipe["debias"]) == (0, "none")
    # Whether the rule exists does not depend on n: say so before anything is rendered
    drawn = sample(recipe["design"], 2**domain.dimension, domain.dimension, sets=1)
    if weighted:
        find_rule(drawn, recipe["order"], recipe["debias"])
    return recipe | {"weighted": weighted}


def _table_file(props: mi.Properties, domain: Domain) -> SampleTable | None:
    """The table of the property ``table``, or None without it."""
    if "table" not in props:
        return None
    settled = [key for key in ("sampler", "order", "debias", "samples", "sets", "table_seed") if key in props]
    if settled:
        raise ValueError(f"table={props['table']!r} settles {', '.join(settled)}; leave them out")
    table = SampleTable.load(props["table"])
    if table.d != domain.dimension:
        raise ValueError(
            f"table={props['table']!r} has d = {table.d}, but domain {domain.name!r} has d = {domain.dimension}"
        )
    return table


mi.register_integrator("plain", Plain)
