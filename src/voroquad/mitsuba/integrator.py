"""The integrator plug-ins ``plain`` and ``reweighted``; made anew for each Mitsuba variant."""

from __future__ import annotations

import math
from collections.abc import Iterator
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


@dataclass
class CameraSample:
    """A point of primary sample space for each ray of a wavefront, each coordinate uniform in [0, 1)."""

    pixel: Any  # mi.Point2f, within the pixel
    lens: Any  # mi.Point2f
    time: Any  # mi.Float, between shutter opening and closing
    wavelength: Any  # mi.Float


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
    A subclass replaces coordinates of the camera sample (`camera_sample`) or the weight of a ray
    (`ray_weight`).
    """

    def __init__(self, props: mi.Properties) -> None:
        # Not ADIntegrator's own: it would accept max_depth and rr_depth, which belong to the nested one
        super(ADIntegrator, self).__init__(props)
        self.nested, self._sampler = _nested_objects(props)
        self.jitter = _property(props, "jitter", True)
        self._seed = mi.UInt32(0)
        self._has_rays = False

    def aov_names(self) -> list[str]:
        """Names of the nested integrator's extra channels."""
        return list(self.nested.aov_names())

    def prepare(
        self, sensor: mi.Sensor, seed: mi.UInt32 = 0, spp: int = 0, aovs: list[str] | None = None
    ) -> tuple[mi.Sampler, int]:
        """Seed the sampler for one wavefront, ready the film, and keep the seed.

        The seed is opaque to the compiler, so that a new one costs no compilation.
        """
        film = sensor.film()
        sampler = (self._sampler or sensor.sampler()).clone()
        if spp != 0:
            sampler.set_sample_count(spp)
        spp = sampler.sample_count()
        sampler.set_samples_per_wavefront(spp)
        rays = math.prod(_film_window(film)) * spp
        if rays > 2**32:
            raise ValueError(f"{rays} samples in one pass are more than 2^32; render several images and average them")
        self._seed = dr.opaque(mi.UInt32, seed) if isinstance(seed, int) else mi.UInt32(seed)
        sampler.seed(self._seed, rays)
        film.prepare(aovs or [])
        return sampler, spp

    # ------------------------------------------------------------------ the steps of a camera sample

    def camera_sample(self, sensor: mi.Sensor, sampler: mi.Sampler, index: mi.UInt32) -> CameraSample:
        """Draw the camera sample of ray `index` = pixel · spp + (sample of the pixel)."""
        pixel = mi.Point2f(sampler.next_2d()) if self.jitter else mi.Point2f(0.5)
        lens = mi.Point2f(sampler.next_2d()) if sensor.needs_aperture_sample() else mi.Point2f(0.5)
        time = sampler.next_1d() if sensor.shutter_open_time() > 0 else mi.Float(0)
        wavelength = sampler.next_1d() if mi.is_spectral else mi.Float(0)
        return CameraSample(pixel, lens, time, wavelength)

    def ray_weight(self, index: mi.UInt32) -> mi.Float | None:
        """The factor N·w of ray `index`; None where it is 1."""
        return None

    def sample_rays(
        self, scene: mi.Scene, sensor: mi.Sensor, sampler: mi.Sampler
    ) -> tuple[mi.RayDifferential3f, mi.Spectrum, mi.Point2f]:
        """Camera rays of the wavefront, their weights, and where on the film they count."""
        film = sensor.film()
        spp = sampler.sample_count()
        width, height = _film_window(film)

        # The rays of a pixel are consecutive; pixels go row by row
        index = dr.arange(mi.UInt32, width * height * spp)
        pixel_index = index // dr.opaque(mi.UInt32, spp)
        row = pixel_index // dr.opaque(mi.UInt32, width)
        column = pixel_index - row * width
        border = film.rfilter().border_size() if film.sample_border() else 0
        corner = mi.Point2i(mi.Int32(column), mi.Int32(row)) + mi.ScalarPoint2i(film.crop_offset()) - border

        # Map the sample to the sensor, whose film coordinates span the crop window
        drawn = self.camera_sample(sensor, sampler, index)
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
            ray.scale_differential(dr.rsqrt(mi.Float(dr.opaque(mi.Float, spp))))

        factor = self.ray_weight(index)
        if factor is not None:
            weight *= factor
        self._has_rays = True
        # A box filter counts the whole pixel: its corner avoids rounding into the next one
        return ray, weight, mi.Point2f(corner) if film.rfilter().is_box_filter() else position

    # ------------------------------------------------------------------ what the nested integrator does

    def sample(
        self, mode: Any = None, scene: Any = None, sampler: Any = None, ray: Any = None, *rest: Any, **known: Any
    ) -> tuple[mi.Spectrum, mi.Bool, list[mi.Float], Any]:
        """Radiance along the rays of `sample_rays`, by the nested integrator."""
        if not self._has_rays:
            raise RuntimeError(
                f"'{_plugin_name(self)}' must be the outermost integrator: another one around it (such as 'aov') "
                "draws its own camera rays; put that one inside"
            )
        self._has_rays = False
        active = known.get("active", mi.Bool(True))
        if not isinstance(self.nested, ADIntegrator):
            return (*self.nested.sample(scene, sampler, ray, None, active), None)
        return self.nested.sample(
            mode=mode,
            scene=scene,
            sampler=sampler,
            ray=ray,
            depth=mi.UInt32(0),
            δL=None,
            δaovs=None,
            state_in=None,
            active=active,
        )

    def render_forward(self, scene: mi.Scene, params: Any, *args: Any, **named: Any) -> mi.TensorXf:
        """Forward derivative of the image; a radiative-backpropagation integrator does its own."""
        if not isinstance(self.nested, ADIntegrator):
            return super().render_forward(scene, params, *args, **named)
        with self._camera_lent():
            return self.nested.render_forward(scene, params, *args, **named)

    def render_backward(self, scene: mi.Scene, params: Any, grad_in: mi.TensorXf, *args: Any, **named: Any) -> None:
        """Backward derivative; through a C++ integrator it unrolls the loops, as Dr.Jit asks."""
        if isinstance(self.nested, ADIntegrator):
            with self._camera_lent():
                self.nested.render_backward(scene, params, grad_in, *args, **named)
        else:
            with dr.scoped_set_flag(dr.JitFlag.SymbolicLoops, False):
                super().render_backward(scene, params, grad_in, *args, **named)

    @contextmanager
    def _camera_lent(self) -> Iterator[None]:
        """Let the nested integrator draw its camera rays by our steps."""
        self.nested.prepare, self.nested.sample_rays = self.prepare, self.sample_rays
        try:
            yield
        finally:
            del self.nested.prepare, self.nested.sample_rays
            self._has_rays = False

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
       - What the sets sample: ``lens``, the aperture of a thin lens. (Default: ``lens``)
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
     * - samples
       - |int|
       - Samples of a set. They must divide the samples per pixel: a pixel of 64 samples takes one set of
         64 or, independently, four sets of 16. (Default: 0, all samples of a pixel form one set)
     * - jitter
       - |bool|
       - Sample the pixel's area? If false, all its rays start at its centre. (Default: |true|)
     * - sets
       - |int|
       - Sets of the table; a hash of pixel and render seed picks one. (Default: 1024)
     * - table_seed
       - |int|
       - Seed of the table. (Default: 0)
     * - table
       - |string|
       - File of a table made by ``voroquad table``. It settles sampler, order, debias, samples, sets
         and table_seed, which must then be absent.

    Notes
    -----
    Sample i of a set of N multiplies its ray's weight by N·w_i. The image is then Σ w f over the set, with f
    averaged over everything else that the path samples: w depends on the lens point only, so unbiased
    weights give an unbiased image. Weights sum to 1, hence a constant image stays constant, exactly. Extra
    channels (``aov`` inside) and alpha are not weighted. With ``jitter`` false the image is that of point
    samples at the pixel centres.
    """

    #: Dimension of the domain that the sets sample
    dimension: int

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        props.mark_queried("domain")
        self.weighted = _property(props, "weighted", True)
        self._file = _table_file(props, self.dimension)
        if self._file is None:
            self.samples = _property(props, "samples", 0)
            if self.samples < 0:
                raise ValueError(f"samples must be 0 (all of a pixel) or more, got {self.samples}")
            self._recipe: dict[str, Any] = {
                "design": one_of("sampler", _property(props, "sampler", "stratified"), DESIGNS),
                "d": self.dimension,
                "sets": positive_int("sets", _property(props, "sets", 1024)),
                "order": _property(props, "order", 0),
                "debias": _property(props, "debias", "none"),
                "rng": _property(props, "table_seed", 0),
            }
            # Whether the rule exists does not depend on n: say so before anything is rendered
            find_rule(sample(self._recipe["design"], 4, self.dimension), self._recipe["order"], self._recipe["debias"])
        else:
            self.samples, self._recipe = self._file.n, {}
        self._n = 0  # samples of a set of the table at hand

    def prepare(
        self, sensor: mi.Sensor, seed: mi.UInt32 = 0, spp: int = 0, aovs: list[str] | None = None
    ) -> tuple[mi.Sampler, int]:
        """Check the sensor, settle the samples per pixel, and make the table if it is not there."""
        self.check_sensor(sensor)
        sampler, spp = super().prepare(sensor, seed, spp, aovs)
        n = self.samples or spp
        if spp % n:
            raise ValueError(f"sets of samples={n} do not divide {spp} samples per pixel; take a multiple of {n}")
        if n != self._n:
            self._upload(self._file or SampleTable.make(n=n, **self._recipe))
        return sampler, spp

    def _upload(self, table: SampleTable) -> None:
        """Hand points and N·w to the device in its own precision."""
        below_one = np.nextafter(np.float32(1), np.float32(0))
        points = np.minimum(table.points.astype(np.float32), below_one)
        self._points = mi.Float(points.ravel())
        self._factors = mi.Float((table.n * table.weights).astype(np.float32).ravel())
        self._n, self._sets = table.n, table.sets

    def row(self, index: mi.UInt32) -> mi.UInt32:
        """The row of the table for ray `index`: a hash of the group of N rays and of the seed picks the set."""
        group = index // dr.opaque(mi.UInt32, self._n)
        hashed, _ = mi.sample_tea_32(group, self._seed)
        chosen = dr.mul_hi(hashed, mi.UInt32(self._sets))  # ⌊hash · sets / 2³²⌋
        return (chosen - group) * self._n + index

    def camera_sample(self, sensor: mi.Sensor, sampler: mi.Sampler, index: mi.UInt32) -> CameraSample:
        """Draw the camera sample and replace its coordinates of the domain."""
        drawn = super().camera_sample(sensor, sampler, index)
        row = self.row(index) * self.dimension
        self.place(drawn, [dr.gather(mi.Float, self._points, row + axis) for axis in range(self.dimension)])
        return drawn

    def ray_weight(self, index: mi.UInt32) -> mi.Float | None:
        """N·w from the table."""
        return dr.gather(mi.Float, self._factors, self.row(index)) if self.weighted else None

    # ------------------------------------------------------------------ what a domain says

    def check_sensor(self, sensor: mi.Sensor) -> None:
        """Raise ValueError if the sensor does not have the domain."""
        raise NotImplementedError

    def place(self, drawn: CameraSample, u: list[mi.Float]) -> None:
        """Put the table's coordinates u into the camera sample."""
        raise NotImplementedError

    def to_string(self) -> str:
        return f"{type(self).__name__}[weighted = {self.weighted}, {self._recipe}, nested = {self.nested}]"


class ReweightedLens(Reweighted):
    """Domain ``lens``: the point of the aperture, d = 2."""

    dimension = 2

    def check_sensor(self, sensor: mi.Sensor) -> None:
        if not sensor.needs_aperture_sample():
            raise ValueError(
                f"domain 'lens' needs a sensor with a lens, and the scene's '{sensor.class_name()}' has none; "
                "use a 'thinlens' sensor with aperture_radius > 0"
            )

    def place(self, drawn: CameraSample, u: list[mi.Float]) -> None:
        drawn.lens = mi.Point2f(u)


DOMAINS = {"lens": ReweightedLens}


def make_reweighted(props: mi.Properties) -> Reweighted:
    """The plug-in ``reweighted`` of the domain that its properties name."""
    return DOMAINS[one_of("domain", props.get("domain", "lens"), DOMAINS)](props)


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


def _film_window(film: mi.Film) -> tuple[int, int]:
    """Width and height of the pixels to sample: the crop window, and its border where the film samples that."""
    border = film.rfilter().border_size() if film.sample_border() else 0
    width, height = (int(n) + 2 * border for n in film.crop_size())
    return width, height


def _table_file(props: mi.Properties, dimension: int) -> SampleTable | None:
    """The table of the property ``table``, or None without it."""
    if "table" not in props:
        return None
    settled = [key for key in ("sampler", "order", "debias", "samples", "sets", "table_seed") if key in props]
    if settled:
        raise ValueError(f"table={props['table']!r} settles {', '.join(settled)}; leave them out")
    table = SampleTable.load(props["table"])
    if table.d != dimension:
        raise ValueError(f"table={props['table']!r} has d = {table.d}, but the domain has d = {dimension}")
    return table


mi.register_integrator("plain", Plain)
mi.register_integrator("reweighted", make_reweighted)
