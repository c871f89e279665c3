"""The integrator plug-in ``plain``: how rays are drawn, followed and summed; made anew for each Mitsuba variant."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from mitsuba.python.ad.integrators.common import ADIntegrator

from .accumulation import Contributions, Footprint, Layout, Pass, pixel_means, quotient
from .blend import Floats
from .developing import base_channels, channel_names, develop, has_alpha
from .domains import CameraSample, within_period
from .loading import check_film
from .owen_sobol import OwenSobol
from .properties import nested_objects, read_property
from .rounds import alone
from .tracing import CameraRays, check_differentiable, colour, tracer_of


class Plain(ADIntegrator):
    """Renders through a nested integrator, with all camera samples from the scene's sampler (``plain``).

    The baseline of ``reweighted``. Its image is the nested integrator's own (but see the notes); with `jitter` false,
    that of rays through the pixel centres.

    .. pluginparameters::

     * - (nested plug-in)
       - :paramtype:`integrator`
       - The integrator that traces the camera rays: any sampling integrator of Mitsuba, or one that
         computes derivatives by radiative backpropagation (``prb``, ...).
     * - (nested plug-in)
       - :paramtype:`sampler`
       - Sampler for everything. (Default: that of the scene's sensor)
     * - jitter
       - |bool|
       - Sample the pixel's area? If false, all its rays start at its centre. (Default: |true|)

    Notes
    -----
    A subclass replaces coordinates of the camera sample (`camera_sample`).

    In a spectral variant, what a path brings is a function of its wavelength sample u with a period of ¼, as it carries
    four wavelengths. With the sampler ``owensobol``, u lies in one period, so that all of its strata count; with others
    it is as Mitsuba draws it, and the image is the nested integrator's own.
    """

    plugin_name = "plain"
    #: The order in which `OwenSobol` goes through the pixels; None: its own
    pixel_order: str | None = None
    #: Do samples have something by their numbers, so that `OwenSobol` must keep them in order?
    consecutive = False
    #: The middle part of each side of a pixel that is sampled: below 1 for images that stand for larger ones
    part = 1.0

    def __init__(self, props: mi.Properties) -> None:
        # Not ADIntegrator's own: it would accept max_depth and rr_depth, which belong to the nested one
        super(ADIntegrator, self).__init__(props)
        self.nested, self._sampler = nested_objects(props)
        self._tracer = tracer_of(self.nested)
        self.jitter = read_property(props, "jitter", True)
        self._seed = mi.UInt32(0)
        self.weighted = self.blend = self.tabled = False
        self.samples = 0
        self._rays: CameraRays | None = None  # those of sample_rays, until sample has traced them

    def aov_names(self) -> list[str]:
        """Names of the extra channels, those of the nested integrator, in a film without alpha."""
        return [extra.name for extra in self._tracer.extras(alpha=False)]

    def prepare(
        self,
        sensor: mi.Sensor,
        seed: mi.UInt32 = 0,
        spp: int = 0,
        aovs: list[str] | None = None,
        *,
        number: int | None = None,
    ) -> tuple[mi.Sampler, int]:
        """Seed the sampler for one wavefront, of a band or (without its number) of all, ready the film, keep the seed.

        The seed is opaque to the compiler, so that a new one costs no compilation. That of a band depends on its
        number, but for `OwenSobol`, which draws for each pixel what it would draw without bands.
        """
        film = sensor.film()
        sampler = self._sampler_of(sensor, spp)
        spp = sampler.sample_count()
        sampler.set_samples_per_wavefront(spp)
        columns, height = Footprint(film).window
        rows = range(height) if number is None else Footprint(film).bands(spp)[number]
        rays = columns * len(rows) * spp
        if rays > 2**32:
            raise ValueError(f"{rays} samples in one pass are more than 2^32; render in rounds of fewer samples")
        of_image = dr.opaque(mi.UInt32, seed) if isinstance(seed, int) else mi.UInt32(seed)
        self._seed = dr.opaque(mi.UInt32, band_seed(whole(seed), number)) if number else of_image
        if isinstance(sampler, OwenSobol):
            sampler.cover(columns, height, rows, order=self.pixel_order)
            sampler.consecutive = self.consecutive
            sampler.seed(of_image, rays)
        else:
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
                f"the scene's sampler draws {granted} samples per pixel, not the {spp} that were requested; "
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
        if mi.is_spectral and isinstance(sampler, OwenSobol) and sampler.one_period:
            wavelength = within_period(wavelength)
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

    def rays_of(
        self,
        sensor: mi.Sensor,
        sampler: mi.Sampler,
        index: mi.UInt32,
        corner: mi.Point2i,
        shift: mi.Vector2f | None = None,
    ) -> CameraRays:
        """Camera rays of given numbers, in the pixels with these corners.

        If `part` is below 1 they lie `shift` pixels of the larger image right of and below the middle of each.
        """
        film = sensor.film()

        # Map the sample to the sensor, whose film coordinates span the crop window
        drawn = self.camera_sample(sensor, sampler, index, corner)
        inside = drawn.pixel
        if self.part != 1:
            inside = 0.5 + self.part * (inside - 0.5 + (mi.Vector2f(0) if shift is None else shift))
        position = mi.Point2f(corner) + inside
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
        return CameraRays(sensor, ray, weight, index, corner, drawn)

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
                f"'{self.plugin_name}' must be the outermost integrator: another one around it (such as 'aov') "
                "draws its own camera rays; put that one inside"
            )
        rays, self._rays = self._rays, None
        radiance, valid, aovs = self.follow(scene, sampler, rays, known.get("active", mi.Bool(True)))
        return radiance, valid, aovs, None

    def follow(
        self, scene: mi.Scene, sampler: mi.Sampler, rays: CameraRays, active: mi.Bool, *, alpha: bool = False
    ) -> tuple[mi.Spectrum, mi.Bool, list[mi.Float]]:
        """Radiance along camera rays, whether they hit something, and what they bring to the extra channels."""
        radiance, valid, values = self._tracer.follow(scene, sampler, rays, active)
        return radiance, valid, [values[extra.index] for extra in self._tracer.extras(alpha=alpha)]

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
            return self.develop(sensor.film(), *self.image(scene, sensor, whole(seed), spp))

    def image(self, scene: mi.Scene, sensor: mi.Sensor, seed: int, spp: int) -> tuple[Floats, Floats]:
        """The image (height, width, channels) before it is developed, and its λ (height, width)."""
        return alone(self.render_pass(scene, sensor, seed, spp), blend=self.blend)

    def render_pass(self, scene: mi.Scene, sensor: mi.Sensor, seed: int, spp: int) -> Pass:
        """Trace all rays, band after band; the image with equal weights, and what the weights change."""
        footprint, spp = Footprint(sensor.film()), self.granted(sensor, spp)
        bands = footprint.bands(spp)
        strips = (self.render_band(scene, sensor, seed, spp, number) for number in range(len(bands)))
        return footprint.whole(strips, bands, self.layout(sensor.film()))

    def render_band(self, scene: mi.Scene, sensor: mi.Sensor, seed: int, spp: int, number: int) -> Floats:
        """The strip of a band, see `Footprint`: with the same bits in any process and order."""
        self.check(scene, sensor)
        self.settle(sensor, seed, spp)
        self.explore(scene, sensor, seed, spp)
        footprint = Footprint(sensor.film())
        band = footprint.bands(spp)[number]
        means = self.band_means(scene, sensor, seed, spp, number)
        return footprint.strip(means, self.layout(sensor.film()), band)

    def band_means(self, scene: mi.Scene, sensor: mi.Sensor, seed: int, spp: int, number: int) -> Floats:
        """Means over the rays of each pixel of a band of what they bring, in the columns of `Layout.row`."""
        sampler, spp = self.prepare(sensor, seed, spp, self.aov_names(), number=number)
        rays = self.camera_rays(sensor, sampler, Footprint(sensor.film()).bands(spp)[number])
        return pixel_means(self.columns(scene, sensor.film(), sampler, rays), rays.index, spp)

    def columns(self, scene: mi.Scene, film: mi.Film, sampler: mi.Sampler, rays: CameraRays) -> list[mi.Float]:
        """What rays bring, in the columns of `Layout.row`."""
        layout, values = self.layout(film), self.values(scene, film, sampler, rays)
        return layout.row(values, Footprint(film).weights(rays.drawn.pixel) if layout.taps else [])

    def settle(self, sensor: mi.Sensor, seed: int, spp: int) -> None:
        """Make what all bands of an image share."""

    def explore(self, scene: mi.Scene, sensor: mi.Sensor, seed: int, spp: int) -> None:
        """Find out by rendering what all bands of an image share."""

    def check(self, scene: mi.Scene, sensor: mi.Sensor) -> None:
        """Raise ValueError if the film has no colours, no pixels or too many."""
        film = sensor.film()
        if mi.has_flag(film.flags(), mi.FilmFlags.Special):
            name = self.plugin_name
            raise ValueError(f"{name!r} renders to films of colours such as 'hdrfilm', not {film.class_name()}")
        check_film(film)

    def channels(self, film: mi.Film) -> int:
        """The number of channels that are rendered: colours, alpha where the film has it, the nested integrator's."""
        return base_channels(film) + len(self._tracer.extras(alpha=has_alpha(film)))

    def layout(self, film: mi.Film) -> Layout:
        """The columns of the sums over rays."""
        return Footprint(film).layout(self.channels(film))

    def values(self, scene: mi.Scene, film: mi.Film, sampler: mi.Sampler, rays: CameraRays) -> Contributions:
        """What rays bring to the channels of the film (colours, alpha, others), and what weights add to colours."""
        radiance, valid, extras = self.follow(scene, sampler, rays, mi.Bool(True), alpha=has_alpha(film))
        colours = colour(radiance * rays.weight, rays.ray.wavelengths)
        return Contributions(self._film_channels(film, colours, valid, extras))

    @staticmethod
    def _film_channels(film: mi.Film, colours: mi.Color3f, valid: mi.Bool, extras: list[mi.Float]) -> list[mi.Float]:
        alpha = [dr.select(valid, mi.Float(1), mi.Float(0))] if has_alpha(film) else []
        return [*colours, *alpha, *extras]

    def develop(self, film: mi.Film, image: Floats, share: Floats) -> mi.TensorXf:
        """Put an image (height, width, channels) and its λ (height, width) into the film, and develop it."""
        extras = self._tracer.extras(alpha=has_alpha(film))
        return develop(film, image, extras, self.own_channels(share), has_colours=self._tracer.has_colours)

    def developed_names(self, film: mi.Film) -> list[str]:
        """The names of the channels of the image that is in the film."""
        names = channel_names(film)
        return names if self._tracer.has_colours else names[-len(self.aov_names()) :]

    def own_channels(self, share: Floats) -> dict[str, Floats]:
        """Channels (height, width) that are not the nested integrator's, by their names, from λ (height, width)."""
        return {}

    # ------------------------------------------------------------------ derivatives

    def render_forward(self, scene: mi.Scene, params: Any, *args: Any, **named: Any) -> mi.TensorXf:
        """Forward derivative of the image."""
        check_differentiable(self.nested)
        if isinstance(self.nested, ADIntegrator):
            return type(self.nested).render_forward(_Lent(self), scene, params, *args, **named)
        with dr.scoped_set_flag(dr.JitFlag.SymbolicLoops, False):  # unroll the loops, as Dr.Jit asks
            return super().render_forward(scene, params, *args, **named)

    def render_backward(self, scene: mi.Scene, params: Any, grad_in: mi.TensorXf, *args: Any, **named: Any) -> None:
        """Backward derivative of the image."""
        check_differentiable(self.nested)
        if isinstance(self.nested, ADIntegrator):
            type(self.nested).render_backward(_Lent(self), scene, params, grad_in, *args, **named)
            return
        with dr.scoped_set_flag(dr.JitFlag.SymbolicLoops, False):
            super().render_backward(scene, params, grad_in, *args, **named)

    def lent_rays(
        self, scene: mi.Scene, sensor: mi.Sensor, sampler: mi.Sampler
    ) -> tuple[mi.RayDifferential3f, mi.Spectrum, mi.Point2f]:
        """Those of `sample_rays`, for a nested integrator that follows them by itself."""
        rays = self.sample_rays(scene, sensor, sampler)
        self._rays = None
        return rays

    def to_string(self) -> str:
        return f"{type(self).__name__}[jitter = {self.jitter}, nested = {self.nested}]"


class _Lent:
    """An integrator of radiative backpropagation with the camera rays of another."""

    def __init__(self, camera: Plain) -> None:
        self._nested = camera.nested
        self.prepare = camera.prepare
        self.sample_rays = camera.lent_rays

    def __getattr__(self, name: str) -> Any:
        return getattr(self._nested, name)


def whole(seed: int | mi.UInt32) -> int:
    """A seed as Mitsuba passes it, an integer or an array of one."""
    return int(np.array(seed).ravel()[0])


def band_seed(seed: int, number: int) -> int:
    """The seed of a band: of the first the image's own, of the others independent ones."""
    return seed if number == 0 else int(np.random.SeedSequence((seed, number), spawn_key=(1,)).generate_state(1)[0])
