"""The integrator plug-in ``reweighted``: camera samples from weighted sets; made anew for each Mitsuba variant."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .._support.checks import one_of, positive_int
from ..designs.design import DESIGNS
from ..designs.sampling import SetKind
from ..geometry.cells import cells
from ..rules.registry import DEBIAS, MAX_ORDER, find_rule, weights
from ..sample_tables import Recipe, SampleTable
from .accumulation import quotient
from .bands import table_of
from .blend import TILE, Floats
from .developing import has_alpha
from .domains import CameraSample, Domain, Joint, find_domain
from .lights import FirstHit
from .plain import Plain
from .properties import read_property
from .tracing import CameraRays, colour

#: Name of the design of sets that are no table's: those that the scene's sampler draws
SCENE = "scene"
#: Samples of a table, about
TABLE_SIZE = 2**18
#: Coordinates that are weighed at a time while rendering, about
_AT_ONCE = 2**18


class Reweighted(Plain):
    """Renders through a nested integrator with camera samples from weighted sample sets (``reweighted``).

    .. pluginparameters::

     * - (nested plug-in)
       - :paramtype:`integrator`
       - The integrator that traces the camera rays: any sampling integrator of Mitsuba, or one that
         computes derivatives by radiative backpropagation (``prb``, ...).
     * - (nested plug-in)
       - :paramtype:`sampler`
       - Sampler for all else that the sets do not sample. (Default: that of the scene's sensor)
     * - domain
       - |string|
       - What the sets sample: ``lens``, the aperture of a thin lens; ``time``, between opening and closing of the
         shutter; ``wavelength``, in a spectral variant; ``light``, the emitter sample at the first hit; ``pixel``, its
         area; or several of them at once, such as ``pixel+time``. (Default: ``lens``)
     * - sampler
       - |string|
       - Design of the sets: ``uniform``, ``stratified``, ``multi-jittered``, ``regular``, ``sobol``,
         ``halton``, ``zero-two`` or ``orthogonal``; or ``scene``, the samples that the sampler of all else (above)
         draws anyway, which are weighed while rendering, each pixel's by themselves. (Default: ``stratified``)
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
    brings, and nothing else. Weights that sum to 1 (of all rules but ``bias-function``) leave a constant image
    constant, exactly, under a box filter; a wider one gives each pixel parts of sets, whose weights do not sum to 1.
    Extra channels (``aov`` inside) and alpha are not weighted. With ``jitter`` false the image is that of point
    samples at the pixel centres. The same seeds give the same bits on any number of threads (on processors).

    Derivatives are those of the image without blend; through ``prb`` and its kin with the domain ``light``, they have
    the image's mean but emitter samples of their own, and equal weights.
    """

    plugin_name = "reweighted"

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        self.domain = find_domain(read_property(props, "domain", "lens"))
        if "pixel" in self.domain.name and not self.jitter:
            raise ValueError(f"jitter must be true for domain {self.domain.name!r}: it samples the pixel's area")
        self._first_hit = FirstHit(self.nested) if "light" in self.domain.name else None
        self.weighted = read_property(props, "weighted", True)
        self.blend = one_of("blend", read_property(props, "blend", "auto"), ("auto", "off")) == "auto" and self.weighted
        self.reuse = one_of("reuse", read_property(props, "reuse", "hash"), ("hash", "tile"))
        self.aovs = _names("aovs", read_property(props, "aovs", ""), ("lambda",))
        self._file = _table_file(props, self.domain)
        if self._file is None:
            self.samples = _count(props, "samples")
            self._recipe = _recipe(props, self.domain, self.weighted)
        else:
            self.samples, self._recipe = self._file.n, _recipe_of(self._file)
        self.tabled = self._recipe.design != SCENE
        sets = self._recipe.sets
        if self.blend and sets == 1:
            raise ValueError("sets must be 2 or more for blend='auto', got 1; or set blend to 'off'")
        self._n = 0  # samples of a set of the table at hand

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

    def prepare(self, *args: Any, **named: Any) -> tuple[mi.Sampler, int]:
        """Settle the samples per pixel, and make the table if it is not there."""
        sampler, spp = super().prepare(*args, **named)
        n = self.samples or spp
        if spp % n:
            raise ValueError(f"sets of samples={n} do not divide {spp} samples per pixel; take a multiple of {n}")
        if self.tabled and n != self._n:
            self._upload(self._file or table_of(self.recipe(n)))
        return sampler, spp

    def recipe(self, n: int, seed: int | None = None) -> Recipe:
        """How to make the table for sets of n samples: with the seed of the properties, or another."""
        sets = self._recipe.sets or max(64, min(1024, TABLE_SIZE // n))
        return replace(self._recipe, n=n, sets=sets, seed=self._recipe.seed if seed is None else seed)

    def take(self, table: SampleTable) -> None:
        """Take another table from the next render on."""
        if self._file is not None:
            raise ValueError("table= names a file, and rounds need a new table each; name its sampler instead")
        self._upload(table)

    def _upload(self, table: SampleTable) -> None:
        """Hand points and N·w to the device in its own precision, side by side.

        Rows of a power of two numbers are read in one go.
        """
        d, below_one = table.d, np.nextafter(np.float32(1), np.float32(0))
        self._width = 1 << d.bit_length() if self.weighted else 1 << (d - 1).bit_length()
        rows = np.zeros((table.sets, table.n, self._width), np.float32)
        rows[..., :d] = np.minimum(table.points.astype(np.float32), below_one)
        if self.weighted:
            rows[..., d] = table.n * table.weights
        self._rows_of_table = mi.Float(rows.ravel())
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
        if not self.tabled:
            return self._weigh(drawn, sampler)
        row = self.row(index, sampler.sample_count(), corner)
        values = dr.gather(mi.ArrayXf, self._rows_of_table, row, shape=(self._width, dr.width(row)))
        d = self.domain.dimension
        self.domain.place(drawn, [values[axis] for axis in range(d)])
        if self.weighted:
            drawn.factor = values[d]
        return drawn

    def _weigh(self, drawn: CameraSample, sampler: mi.Sampler) -> CameraSample:
        """Weigh the sets that the sampler itself has drawn."""
        if self._first_hit is not None:
            drawn.light = mi.Point2f(sampler.next_2d())  # what a path tracer draws next
        if self.weighted:
            u = self.domain.coordinates(drawn)
            dr.eval(u)
            n = self.samples or sampler.sample_count()
            drawn.factor = mi.Float(self._factors(np.stack(u, -1).reshape(-1, n, len(u))).ravel())
        return drawn

    def _factors(self, points: Floats) -> Floats:
        """N·w (sets, n) of sets (sets, n, d), some at a time: in double precision all would fill the memory."""
        factors = np.empty(points.shape[:2], np.float32)
        parts = max(1, points.size // _AT_ONCE)
        for own, sets in zip(np.array_split(factors, parts), np.array_split(points, parts), strict=True):
            measures = cells(sets, periodic=True).measures if self._recipe.periodic else weights(sets)
            np.multiply(measures, points.shape[1], out=own, casting="same_kind")
        return factors

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

    def lent_rays(
        self, scene: mi.Scene, sensor: mi.Sensor, sampler: mi.Sampler
    ) -> tuple[mi.RayDifferential3f, mi.Spectrum, mi.Point2f]:
        """With equal weights where the nested integrator draws light samples of its own: the weights know others."""
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
        light = self._first_hit.trace(scene, sampler, rays.ray, rays.drawn.light, active)
        if self._weighs_all:
            return light.sampled + light.rest, mi.Spectrum(0), light.valid, []
        return light.sampled, light.rest, light.valid, []

    def values(
        self, scene: mi.Scene, film: mi.Film, sampler: mi.Sampler, rays: CameraRays
    ) -> tuple[list[mi.Float], list[mi.Float]]:
        """What rays bring to the channels of the film (colours, alpha, others), and what the weights add to colours."""
        weighed, rest, valid, aovs = self.split(scene, sampler, rays, mi.Bool(True), alpha=has_alpha(film))
        weighed_colour, rest_colour = (colour(part * rays.weight, rays.ray.wavelengths) for part in (weighed, rest))
        channels = self._film_channels(film, weighed_colour + rest_colour, valid, aovs)
        if rays.drawn.factor is None:
            return channels, []
        return channels, [*(weighed_colour * (rays.drawn.factor - 1))]

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


# ---------------------------------------------------------------------- properties


def _count(props: mi.Properties, name: str) -> int:
    """A property that counts something; 0 leaves the choice to us."""
    return positive_int(name, count) if (count := read_property(props, name, 0)) else 0


def _names(name: str, text: str, known: Iterable[str]) -> list[str]:
    """The names of a property that lists some, separated by commas."""
    return [one_of(name, part.strip(), known) for part in text.split(",") if part.strip()]


def _recipe(props: mi.Properties, domain: Domain, weighted: bool) -> Recipe:
    """How to make the table. The size n of its sets, and their number where it is 0, are settled when rendering."""
    design = one_of("sampler", read_property(props, "sampler", "stratified"), (*DESIGNS, SCENE))
    order, seed = read_property(props, "order", 0), read_property(props, "table_seed", 0)
    debias = one_of("debias", read_property(props, "debias", "none"), DEBIAS)
    if not 0 <= order <= MAX_ORDER:
        raise ValueError(f"order must be a whole number from 0 to {MAX_ORDER}, got {order}")
    if seed < 0:
        raise ValueError(f"table_seed must be at least 0, got {seed}")
    cellular = (order, debias) == (0, "none")
    if weighted and design == SCENE and not cellular:
        raise ValueError(
            f"sampler='scene' has order 0 and debias 'none' only, got order={order}, debias={debias!r}; "
            "name a design such as 'stratified' for other rules"
        )
    if design != SCENE:
        DESIGNS[design].check_dimension(domain.dimension)
    if weighted:  # whether the rule exists does not depend on n: say so before anything is rendered
        find_rule(SetKind(design, 1, domain.dimension), order, debias)
    return Recipe(
        design, 0, domain.dimension, _count(props, "sets"), order, debias, seed,
        periodic=domain.periodic and cellular, weighted=weighted,
    )  # fmt: skip


def _recipe_of(table: SampleTable) -> Recipe:
    """What is known of how a table in a file was made."""
    return Recipe(table.design, table.n, table.d, table.sets, table.order, table.debias)


def _table_file(props: mi.Properties, domain: Domain) -> SampleTable | None:
    """The table of the property ``table``, or None without it."""
    if "table" not in props:
        return None
    settled = [key for key in ("sampler", "order", "debias", "samples", "sets", "table_seed") if key in props]
    if settled:
        raise ValueError(f"table={props['table']!r} settles {', '.join(settled)}; leave them out")
    if not props["table"]:
        raise ValueError("table names no file; give one that 'voroquad table' made, or leave it out")
    try:
        table = SampleTable.load(props["table"])
    except FileNotFoundError:
        raise ValueError(f"there is no table={props['table']!r}; make it with 'voroquad table'") from None
    if table.d != domain.dimension:
        raise ValueError(
            f"table={props['table']!r} has d = {table.d}, but domain {domain.name!r} has d = {domain.dimension}"
        )
    return table
