"""The integrator plug-in ``plain``: how rays are drawn, followed and summed; made anew for each Mitsuba variant."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

import drjit as dr
import mitsuba as mi
import numpy as np
from mitsuba.python.ad.integrators.common import ADIntegrator, RBIntegrator

from .accumulation import Footprint, Pass, pixel_means, quotient
from .blend import Floats
from .domains import CameraSample
from .rounds import alone


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

    plugin_name = "plain"

    def __init__(self, props: mi.Properties) -> None:
        # Not ADIntegrator's own: it would accept max_depth and rr_depth, which belong to the nested one
        super(ADIntegrator, self).__init__(props)
        self.nested, self._sampler = _nested_objects(props)
        self.jitter = read_property(props, "jitter", True)
        self._seed = mi.UInt32(0)
        self.weighted = self.blend = self.tabled = False
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

    def check_samples(self, sensor: mi.Sensor, spp: int) -> None:
        """Raise ValueError if the sampler makes another number of samples per pixel when asked for so many."""
        if (granted := self.granted(sensor, spp)) != spp:
            raise ValueError(
                f"the scene's sampler makes {granted} samples per pixel where {spp} are asked for; "
                f"take {granted} (of a round, if there are several), or another sampler in the scene"
            )

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

    def lent_rays(
        self, scene: mi.Scene, sensor: mi.Sensor, sampler: mi.Sampler
    ) -> tuple[mi.RayDifferential3f, mi.Spectrum, mi.Point2f]:
        """Those of `sample_rays`, for a nested integrator that follows them by itself."""
        return self.sample_rays(scene, sensor, sampler)

    # ------------------------------------------------------------------ what the nested integrator does

    def sample(
        self, mode: Any = None, scene: Any = None, sampler: Any = None, *rest: Any, **known: Any
    ) -> tuple[mi.Spectrum, mi.Bool, list[mi.Float], Any]:
        """Radiance along the rays of `sample_rays`, by the nested integrator."""
        if self._rays is None:
            raise RuntimeError(
                f"'{self.plugin_name}' must be the outermost integrator: another one around it (such as 'aov') "
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
            return self.develop(sensor.film(), *alone(self.render_pass(scene, sensor, seed, spp), blend=self.blend))

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
            name = self.plugin_name
            raise ValueError(f"{name!r} renders to films of colours such as 'hdrfilm', not {film.class_name()}")

    def channels(self, film: mi.Film) -> int:
        """The number of channels that are rendered: colours, alpha where the film has it, the nested integrator's."""
        return 3 + mi.has_flag(film.flags(), mi.FilmFlags.Alpha) + len(self.nested.aov_names())

    def values(
        self, scene: mi.Scene, film: mi.Film, sampler: mi.Sampler, rays: CameraRays
    ) -> tuple[list[mi.Float], list[mi.Float]]:
        """What rays bring to the channels of the film (colours, alpha, others), and what weights add to colours."""
        radiance, valid, aovs = self.follow(scene, sampler, rays, mi.Bool(True))
        return self._film_channels(film, colour(radiance * rays.weight, rays.ray.wavelengths), valid, aovs), []

    @staticmethod
    def _film_channels(film: mi.Film, colours: mi.Color3f, valid: mi.Bool, aovs: list[mi.Float]) -> list[mi.Float]:
        channels = [*colours]
        if mi.has_flag(film.flags(), mi.FilmFlags.Alpha):
            channels.append(dr.select(valid, mi.Float(1), mi.Float(0)))
        return channels + aovs

    def develop(self, film: mi.Film, image: Floats, share: Floats) -> mi.TensorXf:
        """Put an image (height, width, channels) and its λ (height, width) into the film, and develop it."""
        base = 4 if mi.has_flag(film.flags(), mi.FilmFlags.Alpha) else 3
        names = self.aov_names()
        channels = np.ones((*share.shape, base + 1 + len(names)), np.float32)  # 1: the film's weight
        channels[..., :base] = image[..., :base]
        channels[..., base + 1 : image.shape[-1] + 1] = image[..., base:]
        if "lambda" in names:
            channels[..., -1] = share
        block = mi.ImageBlock(mi.TensorXf(channels), offset=film.crop_offset())
        film.prepare(names)
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
        self.nested.prepare, self.nested.sample_rays = self.prepare, self.lent_rays
        try:
            yield
        finally:
            del self.nested.prepare, self.nested.sample_rays
            self._rays = None

    def to_string(self) -> str:
        return f"{type(self).__name__}[jitter = {self.jitter}, nested = {self.nested}]"


def band_seed(seed: int, number: int) -> int:
    """The seed of a band: of the first the image's own, of the others independent ones."""
    return seed if number == 0 else int(np.random.SeedSequence((seed, number), spawn_key=(1,)).generate_state(1)[0])


def colour(radiance: mi.Spectrum, wavelengths: Any) -> mi.Color3f:
    """Linear sRGB of radiance along rays."""
    if mi.is_polarized:
        radiance = mi.unpolarized_spectrum(radiance)
    if mi.is_spectral:
        return mi.spectrum_to_srgb(radiance, wavelengths)
    return mi.Color3f(radiance.x) if mi.is_monochromatic else mi.Color3f(radiance)


# ---------------------------------------------------------------------- properties

#: Mitsuba's integrators that follow given camera rays
FOLLOWING = (
    "path", "direct", "depth", "volpath", "volpathmis", "aov", "moment", "prb", "prb_basic", "prbvolpath",
)  # fmt: skip
_KINDS = {bool: "true or false", int: "a whole number", str: "a name"}
Value = TypeVar("Value", bool, int, str)


def read_property(props: mi.Properties, name: str, default: Value) -> Value:
    """A property, of the type of its default."""
    value = props.get(name, default)
    if type(value) is not type(default):
        raise ValueError(f"{name} must be {_KINDS[type(default)]}, got {value!r}")
    return value


def name_of(integrator: mi.Integrator) -> str:
    """Name of an integrator's class: those written in Python all have one `class_name`, their C++ base's."""
    python = type(integrator)
    return str(integrator.class_name()) if python.__module__ == mi.Integrator.__module__ else python.__name__


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
            f"'{name}' cannot wrap {name_of(integrator)}: it draws its own rays; "
            f"nest one that follows given ones: {', '.join(FOLLOWING)}"
        )
    return integrator, samplers[0] if samplers else None


mi.register_integrator("plain", Plain)
