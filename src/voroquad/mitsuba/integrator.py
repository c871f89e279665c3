"""The integrator plug-in ``reweighted``: camera samples from weighted sets; made anew for each Mitsuba variant."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .._support.checks import one_of
from ..designs.sampling import sample
from ..geometry.cells import cells
from ..rules.registry import weights
from ..sample_tables import Recipe, SampleTable
from .accumulation import Contributions, Footprint, Layout, quotient
from .bands import table_of
from .blend import TILE, Floats
from .contrasts import noise_contrasts
from .developing import has_alpha
from .domains import CameraSample, Joint, at_first_hit, find_domain
from .lights import FirstHit
from .plain import Plain, whole
from .properties import read_property
from .recipes import FEWEST_SETS, SCENE, count, names, read_settings, table_file
from .rounds import Rounds, round_seed
from .tracing import CameraRays, colour

#: Pixels of an image from which on they choose the share λ of its blend; fewer do in as many rounds or more
FEWEST_PIXELS, FEWEST_ROUNDS = 16, 8
#: Coordinates that are weighed at a time while rendering, about
_AT_ONCE = 2**18
#: The pixels of a checkerboard's halves share no set, so that one half may choose λ for the other
HALVES = 2


class Reweighted(Plain):
    """Renders through a nested integrator with camera samples from weighted sample sets (``reweighted``).

    .. pluginparameters::

     * - (nested plug-in)
       - :paramtype:`integrator`
       - The integrator that traces the camera rays: any sampling integrator of Mitsuba, or one that
         computes derivatives by radiative backpropagation (``prb``, ...).
     * - (nested plug-in)
       - :paramtype:`sampler`
       - Sampler for everything that the sets do not sample. (Default: that of the scene's sensor)
     * - domain
       - |string|
       - What the sets sample: ``lens``, the aperture of a thin lens; ``time``, between opening and closing of the
         shutter; ``wavelength``, in a spectral variant; ``light``, the emitter sample at the first hit; ``direction``,
         the BSDF sample there; ``pixel``, its area; or several of them at once, such as ``pixel+time``. (Default:
         ``lens``)
     * - sampler
       - |string|
       - Design of the sets: ``uniform``, ``stratified``, ``multi-jittered``, ``regular``, ``sobol``,
         ``halton``, ``zero-two`` or ``orthogonal``; or ``scene``, the samples that the sampler of all else (above)
         draws anyway; each pixel's are weighed by themselves while rendering. (Default: ``stratified``)
     * - order
       - |int|
       - Order of the weights, see `voroquad.weights`. (Default: 0, for strata in three dimensions and more 1, see
         `voroquad.mitsuba.recipes.default_order`)
     * - debias
       - |string|
       - How the bias of the weights is removed, see `voroquad.weights`. ``auto`` is an exactly unbiased rule; sets of
         dependent points (``regular``, ``sobol``, ``halton``, ``zero-two``, ``orthogonal``, ``scene``) have none, and
         need ``none``, the biased one, to be named. (Default: ``auto``)
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
       - Sets of the table, 4 or more for blend. (Default: 0, a quarter of those that the image uses, from 4 to 1024)
     * - reuse
       - |string|
       - Which pixels share sets: ``hash``, a hash of pixel and render seed picks one; ``tile``, all tiles of
         16 × 16 pixels have the same sets at the same places. (Default: ``hash``)
     * - table_seed
       - |int|
       - Seed of the table. Renders with one table have an error in common, whatever their seeds; one of seed 0 is kept
         on disk for the next time. (Default: the seed of the render)
     * - table
       - |string|
       - File of a table made by ``voroquad table``. It determines sampler, order, debias, samples, sets
         and table_seed, which must then be absent.
     * - aovs
       - |string|
       - ``lambda`` adds the channel of that name: the blend's λ. (Default: none)

    Notes
    -----
    Sample i of a set of N multiplies its ray's weight by N·w_i. The image is then Σ w f over the set, with f averaged
    over everything else that the path samples: w depends on the set's coordinates only, so unbiased weights give an
    unbiased image. With the domain ``light`` alone, the weights multiply what the emitter sample brings, with
    ``direction`` alone what the BSDF sample brings, and nothing else. Weights that sum to 1 (of all rules but
    ``bias-function``) leave a constant image constant, exactly. A filter wider than a pixel gives each pixel parts of
    sets: it is divided by the sum of weights times filter values, not by that of the filter values alone. Extra
    channels (``aov`` inside) and alpha are not weighted. With ``jitter`` false the image is that of point samples at
    the pixel centres. The same seeds give the same bits on any number of threads (on processors).

    Blend chooses λ by other pixels. A film of fewer than 16 pixels has too few; there λ is chosen by the earlier sets
    of the same pixels, which must be 8 or more.

    Derivatives are those of the image without blend, divided by the sum of filter values alone; through ``prb`` and its
    kin with the domain ``light`` or ``direction``, they have the image's mean but such samples of their own, and equal
    weights.
    """

    plugin_name = "reweighted"
    consecutive = True  # sample i of a set has the i-th point of a sequence

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        self.domain = find_domain(read_property(props, "domain", "lens"))
        if "pixel" in self.domain.name and not self.jitter:
            raise ValueError(f"jitter must be true for domain {self.domain.name!r}: it samples the pixel's area")
        self._first_hit: FirstHit | None = None
        for part in at_first_hit(self.domain.name):
            self._first_hit = FirstHit(self.nested, part)
        self.weighted = read_property(props, "weighted", True)
        self.blend = one_of("blend", read_property(props, "blend", "auto"), ("auto", "off")) == "auto" and self.weighted
        # One half of the pixels chooses λ for the other: they must be independent
        self.pixel_order = "none" if self.blend else None
        self.reuse = one_of("reuse", read_property(props, "reuse", "hash"), ("hash", "tile"))
        self.aovs = names("aovs", read_property(props, "aovs", ""), ("lambda",))
        self._file = table_file(props, self.domain)
        self._settings = None if self._file else read_settings(props, self.domain, weighted=self.weighted)
        self.samples = self._file.n if self._file else count(props, "samples")
        self.tabled = self._settings is None or self._settings.design != SCENE
        sets = self._file.sets if self._file else self._settings.sets if self._settings else 0
        if self.blend and 0 < sets < FEWEST_SETS:
            raise ValueError(f"sets must be {FEWEST_SETS} or more for blend='auto', got {sets}; or set blend to 'off'")
        self._n = 0  # samples of a set of the current table
        self._made: Recipe | None = None  # how the current table was made, if it was made here

    def aov_names(self) -> list[str]:
        """Names of the extra channels: those of the nested integrator, then one's own."""
        return [*super().aov_names(), *self.aovs]

    def own_channels(self, share: Floats) -> dict[str, Floats]:
        """The channel ``lambda``, if it is asked for."""
        return dict.fromkeys(self.aovs, share)

    def check(self, scene: mi.Scene, sensor: mi.Sensor) -> None:
        """Raise ValueError if the scene does not have the domain, or its film no colours."""
        self.domain.check(scene, sensor)
        super().check(scene, sensor)

    def prepare(
        self,
        sensor: mi.Sensor,
        seed: mi.UInt32 = 0,
        spp: int = 0,
        aovs: list[str] | None = None,
        *,
        number: int | None = None,
    ) -> tuple[mi.Sampler, int]:
        """Seed the sampler as `Plain` does; for a wavefront that is no band of an image, make the table too."""
        if number is None:
            self.settle(sensor, whole(seed), spp)
        return super().prepare(sensor, seed, spp, aovs, number=number)

    def settle(self, sensor: mi.Sensor, seed: int, spp: int) -> None:
        """Make the table that an image of this seed takes its sets from, unless it is the current one."""
        n = self.set_size(sensor, spp)
        if not self.tabled or (n == self._n and not self._made):
            return  # the current table is a file's, or was set by `take`
        if self._file is not None:
            self._upload(self._file)
        elif (recipe := self.recipe(sensor, seed, spp)) != self._made:
            self._upload(table_of(recipe))
            self._made = recipe

    def set_size(self, sensor: mi.Sensor, spp: int) -> int:
        """Samples of a set; ValueError if they do not divide the samples per pixel."""
        spp = self.granted(sensor, spp)
        n = self.samples or spp
        if spp % n:
            raise ValueError(f"sets of samples={n} do not divide {spp} samples per pixel; take a multiple of {n}")
        return n

    def check_samples(self, sensor: mi.Sensor, spp: int) -> None:
        """Raise ValueError if the sampler makes another number of samples per pixel, or the design no such sets."""
        super().check_samples(sensor, spp)
        if self.tabled and self._settings is not None:
            sample(self._settings.design, self.set_size(sensor, spp), self.domain.dimension, rng=0)

    def recipe(self, sensor: mi.Sensor, seed: int, spp: int) -> Recipe:
        """How to make the table of an image of this seed."""
        if self._settings is None:
            raise ValueError("table= names a file, and rounds need a new table each; name its sampler instead")
        n = self.set_size(sensor, spp)
        uses = math.prod(Footprint(sensor.film()).window) * (self.granted(sensor, spp) // n)
        return self._settings.recipe(n, uses, seed)

    def take(self, table: SampleTable) -> None:
        """Take another table from the next render on."""
        self._upload(table)
        self._made = None

    def image(self, scene: mi.Scene, sensor: mi.Sensor, seed: int, spp: int) -> tuple[Floats, Floats]:
        """The image before it is developed, and its λ; of few pixels in rounds of a set each, see `Rounds`."""
        if not self.blend or math.prod(Footprint(sensor.film()).window) >= FEWEST_PIXELS:
            return super().image(scene, sensor, seed, spp)
        n = self.set_size(sensor, spp)
        number = self.granted(sensor, spp) // n
        self.check_blend(sensor, number)
        passes = (self.render_pass(scene, sensor, round_seed(seed, k), n) for k in range(number))
        first = next(passes)
        rounds = Rounds(first.plain.shape)
        for done in (first, *passes):
            rounds.add(done)
        return rounds.image, rounds.mean_lambda

    def check_blend(self, sensor: mi.Sensor, rounds: int) -> None:
        """Raise ValueError if an image in so many rounds has too few pixels and rounds to choose λ by."""
        width, height = Footprint(sensor.film()).window
        if self.blend and width * height < FEWEST_PIXELS and rounds < FEWEST_ROUNDS:
            raise ValueError(
                f"blend='auto' cannot estimate λ from {width} × {height} pixels with {rounds} sets each, it needs "
                f"{FEWEST_ROUNDS}; set samples to 1/{FEWEST_ROUNDS} of the samples per pixel or less (voroquad render: "
                f"--round), blend to 'off' (the weights as they are), or weighted to false"
            )

    def _upload(self, table: SampleTable) -> Floats:
        """Hand points, N·w and N·c to the device in its own precision, side by side.

        Rows (sets, n, …) of a power of two numbers are read in one go. Sets of one coordinate are in rising order:
        sample i of n then has a value near i / n, and makes a net with what a sequence gives it (Hammersley). The
        noise contrasts c of the sets of one half of a checkerboard of pixels do not depend on those of the other.
        """
        table = _rising(table)
        d, below_one = table.d, np.nextafter(np.float32(1), np.float32(0))
        columns = d + 2 * self.weighted
        self._width = 1 << (columns - 1).bit_length()
        rows = np.zeros((table.sets, table.n, self._width), np.float32)
        rows[..., :d] = np.minimum(table.points.astype(np.float32), below_one)
        if self.weighted:
            rows[..., d] = table.n * table.weights
            for half in range(HALVES):
                sets = slice(half, None, HALVES)
                rows[sets, :, d + 1] = table.n * noise_contrasts(table.points[sets], table.weights[sets])
        self._rows_of_table = mi.Float(rows.ravel())
        self._n, self._sets = table.n, table.sets
        return rows

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
        halves = min(HALVES, self._sets)
        half = mi.UInt32((corner.x + corner.y) & (halves - 1))
        of_half = (self._sets + halves - 1 - half) // halves  # every other set, from the half's first
        chosen = halves * dr.mul_hi(hashed, of_half) + half  # ⌊hash · of_half / 2³²⌋
        return (chosen - group) * self._n + index

    def camera_sample(
        self, sensor: mi.Sensor, sampler: mi.Sampler, index: mi.UInt32, corner: mi.Point2i
    ) -> CameraSample:
        """Draw the camera sample, replace its coordinates of the domain, and weigh it."""
        drawn = super().camera_sample(sensor, sampler, index, corner)
        if not self.tabled:
            return self._weigh(drawn, sampler, corner)
        row = self.row(index, sampler.sample_count(), corner)
        values = dr.gather(mi.ArrayXf, self._rows_of_table, row, shape=(self._width, dr.width(row)))
        d = self.domain.dimension
        self.domain.place(drawn, [values[axis] for axis in range(d)])
        if self.weighted:
            drawn.factor, drawn.noise = values[d], values[d + 1]
        return drawn

    def _weigh(self, drawn: CameraSample, sampler: mi.Sampler, corner: mi.Point2i) -> CameraSample:
        """Weigh the sets that the sampler itself has drawn."""
        if self._first_hit is not None:
            drawn.light = mi.Point2f(sampler.next_2d())  # what a path tracer draws next
            if "direction" in self.domain.name:
                drawn.lobe, drawn.direction = sampler.next_1d(), mi.Point2f(sampler.next_2d())
        if self.weighted:
            u = self.domain.coordinates(drawn)
            dr.eval(u)
            n = self.samples or sampler.sample_count()
            points = np.stack(u, -1).reshape(-1, n, len(u))
            factors = self._factors(points)
            half = np.broadcast_to(np.array(corner.x + corner.y) & 1, points.shape[0] * n)[::n]
            noise = np.zeros_like(factors)
            for own in (half == 0, half == 1):
                noise[own] = n * noise_contrasts(points[own].astype(np.float64), factors[own] / n)
            drawn.factor, drawn.noise = mi.Float(factors.ravel()), mi.Float(noise.ravel())
        return drawn

    def _factors(self, points: Floats) -> Floats:
        """N·w (sets, n) of sets (sets, n, d), some at a time: in double precision all would fill the memory."""
        factors = np.empty(points.shape[:2], np.float32)
        parts = max(1, points.size // _AT_ONCE)
        for own, sets in zip(np.array_split(factors, parts), np.array_split(points, parts), strict=True):
            measures = cells(sets, periodic=True).measures if self._periodic else weights(sets)
            np.multiply(measures, points.shape[1], out=own, casting="same_kind")
        return factors

    @property
    def _periodic(self) -> bool:
        """Are the weights those of cells on a circle?"""
        return self._settings is not None and self._settings.periodic

    @property
    def _weighs_all(self) -> bool:
        """Do the weights multiply all that a ray brings, not only one sample at its first hit?"""
        return self._first_hit is None or isinstance(self.domain, Joint)

    def sample_rays(
        self, scene: mi.Scene, sensor: mi.Sensor, sampler: mi.Sampler
    ) -> tuple[mi.RayDifferential3f, mi.Spectrum, mi.Point2f]:
        """Camera rays of the wavefront, their weights (times N·w), and where on the film they count."""
        ray, weight, position = super().sample_rays(scene, sensor, sampler)
        assert self._rays is not None
        factor = self._rays.drawn.factor
        return ray, weight if factor is None or not self._weighs_all else weight * factor, position

    def lent_rays(
        self, scene: mi.Scene, sensor: mi.Sensor, sampler: mi.Sampler
    ) -> tuple[mi.RayDifferential3f, mi.Spectrum, mi.Point2f]:
        """With equal weights where the nested integrator draws samples at the first hit of its own: the weights know
        others."""
        if self._first_hit is None:
            return super().lent_rays(scene, sensor, sampler)
        rays = super().sample_rays(scene, sensor, sampler)
        self._rays = None
        return rays

    def follow(
        self, scene: mi.Scene, sampler: mi.Sampler, rays: CameraRays, active: mi.Bool, *, alpha: bool = False
    ) -> tuple[mi.Spectrum, mi.Bool, list[mi.Float]]:
        """Radiance along camera rays (but for their own weight), whether they hit something, the extra channels."""
        weighed, rest, valid, aovs = self.split(scene, sampler, rays, active, alpha=alpha)
        factor = rays.drawn.factor
        return weighed * (1 if factor is None or self._weighs_all else factor) + rest, valid, aovs

    def split(
        self, scene: mi.Scene, sampler: mi.Sampler, rays: CameraRays, active: mi.Bool, *, alpha: bool = False
    ) -> tuple[mi.Spectrum, mi.Spectrum, mi.Bool, list[mi.Float]]:
        """Radiance that the weights multiply, radiance that they do not, whether rays hit, and the extra channels."""
        if self._first_hit is None:
            radiance, valid, aovs = super().follow(scene, sampler, rays, active, alpha=alpha)
            return radiance, mi.Spectrum(0), valid, aovs
        light = self._first_hit.trace(scene, sampler, rays.ray, rays.drawn, active)
        if self._weighs_all:
            return light.emitted + light.light + light.direction, mi.Spectrum(0), light.valid, []
        if self.domain.name == "direction":
            return light.direction, light.emitted + light.light, light.valid, []
        return light.light, light.emitted + light.direction, light.valid, []

    def layout(self, film: mi.Film) -> Layout:
        """The columns of the sums over rays."""
        return Footprint(film).layout(self.channels(film), weights=self.weighted, partly=not self._weighs_all)

    def values(self, scene: mi.Scene, film: mi.Film, sampler: mi.Sampler, rays: CameraRays) -> Contributions:
        """What rays bring to the channels of the film (colours, alpha, others), and what the weights add to colours."""
        weighed, rest, valid, aovs = self.split(scene, sampler, rays, mi.Bool(True), alpha=has_alpha(film))
        weighed_colour, rest_colour = (colour(part * rays.weight, rays.ray.wavelengths) for part in (weighed, rest))
        channels = self._film_channels(film, weighed_colour + rest_colour, valid, aovs)
        if rays.drawn.factor is None:
            return Contributions(channels)
        excess = rays.drawn.factor - 1
        return Contributions(
            channels,
            [*(weighed_colour * excess)],
            [*(weighed_colour * rays.drawn.noise)],
            excess,
            [] if self._weighs_all else [*weighed_colour],
        )

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
            f"{self._settings or self._file}, nested = {self.nested}]"
        )


def _rising(table: SampleTable) -> SampleTable:
    """The table, each set of one coordinate in rising order."""
    if table.d > 1:
        return table
    order = np.argsort(table.points[..., 0], axis=1, kind="stable")
    points = np.take_along_axis(table.points, order[..., None], axis=1)
    return replace(table, points=points, weights=np.take_along_axis(table.weights, order, axis=1))
