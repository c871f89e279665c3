"""The integrator plug-in ``plain`` with the property ``adaptive``: more samples where a pilot finds more noise."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from .._support.arrays import Integers
from .._support.checks import one_of
from . import accumulation
from .accumulation import Footprint, Pass, pixel_means, quotient
from .allocation import KINDS, NEIGHBOURS, Sharing, of_a_sample
from .blend import Floats
from .owen_sobol import OwenSobol
from .plain import Plain, band_seed
from .properties import read_property
from .recipes import names

#: Colours, the first columns of `Layout.row`, whose squares the pilot sums too
_COLOURS = 3
#: Blocks of the pilot's samples, at most
_BLOCKS = 4


@dataclass(frozen=True)
class Pilot:
    """What the first samples of all pixels gave.

    Attributes
    ----------
    seed, spp : int
        Of the image, whose sequences they begin.
    counts : ndarray of int64, (height, width)
        Samples of each pixel of the window to sample.
    means : ndarray, (height · width, columns)
        Of the pilot's samples, in the columns of `Layout.row`.
    shown : ndarray, (height, width)
        The counts of the crop window.
    """

    seed: int
    spp: int
    counts: Integers
    means: Floats
    shown: Floats


class Adaptive(Plain):
    """Renders through a nested integrator, with more samples where there is more noise (``plain``, ``adaptive``).

    .. pluginparameters::

     * - adaptive
       - |string|
       - ``absolute``: samples go where they reduce the mean squared error most. ``relative``: where they reduce most
         that of the error over the brightness around the pixel, so that dark parts have their share. ``balanced``: in
         between; it weighs errors about as the eye sees them. ``off``: all pixels have the same number. (Default:
         ``off``)
     * - at_least
       - |int|
       - Samples of the pilot, which each pixel has at least: a power of two. Few of them do not tell the noise.
         (Default: 16)
     * - at_most
       - |int|
       - Samples of a pixel at most, `at_least` times a power of two. (Default: 0, four times those on average)
     * - target
       - |float|
       - Standard error of a pixel below which it gets no more samples, in the unit of the image (``relative``: over the
         brightness around). The samples per pixel of the render are then an upper bound of those on average. (Default:
         0, all are used)
     * - pilot_seed
       - |int|
       - Seed of the pilot. Images of several seeds that are to be averaged need the same one: then each pixel has the
         same number of samples in all of them. (Default: the seed of the render)
     * - aovs
       - |string|
       - ``samples`` adds the channel of that name: the samples of each pixel. (Default: none)

    All properties of `Plain`; the sampler is ``owensobol``, the nested one or else a default one.

    Notes
    -----
    The samples per pixel of a render are those on average. The numbers of samples are `at_least` times powers of two,
    see `voroquad.mitsuba.allocation`. The pixels of a checkerboard's one half decide for the other, and scramble their
    sequences by themselves: so a pixel's number does not depend on its samples, and the image is unbiased. The pilot's
    samples are the first of each pixel, and count.

    Derivatives are those of the image with the same number of samples in all pixels.
    """

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        self.sharing = Sharing(
            read_property(props, "adaptive", KINDS[0]),
            read_property(props, "at_least", 16),
            read_property(props, "at_most", 0),
            float(props.get("target", 0.0)),
        )
        self.pilot_seed = read_property(props, "pilot_seed", 0) if "pilot_seed" in props else None
        self.aovs = names("aovs", read_property(props, "aovs", ""), ("samples",))
        if self._sampler is not None and not isinstance(self._sampler, OwenSobol):
            raise ValueError("adaptive sampling needs the sampler 'owensobol', whose sequences go on; nest it, or none")
        self._pilot: Pilot | None = None

    def aov_names(self) -> list[str]:
        """Names of the extra channels: those of the nested integrator, then one's own."""
        return [*super().aov_names(), *self.aovs]

    def own_channels(self, share: Floats) -> dict[str, Floats]:
        """The channel ``samples``, if it is asked for: those of a round."""
        if not self.aovs:
            return {}
        assert self._pilot is not None, "explore comes before develop"
        return {"samples": self._pilot.shown}

    def check_samples(self, sensor: mi.Sensor, spp: int) -> None:
        """Raise ValueError if the pilot alone takes all samples."""
        self.sharing.check(spp)

    def granted(self, sensor: mi.Sensor, spp: int = 0) -> int:
        """The samples per pixel on average."""
        return spp or int((self._sampler or sensor.sampler()).sample_count())

    def _sampler_of(self, sensor: mi.Sensor, spp: int) -> mi.Sampler:
        if self._sampler is None:
            return mi.load_dict({"type": "owensobol", "sample_count": self.granted(sensor, spp)})
        return super()._sampler_of(sensor, spp)

    # ------------------------------------------------------------------ the image

    def render_pass(self, scene: mi.Scene, sensor: mi.Sensor, seed: int, spp: int) -> Pass:
        """Render pilot and image: a pilot from before may be that of a scene which has changed since."""
        self._pilot = None
        return super().render_pass(scene, sensor, seed, spp)

    def explore(self, scene: mi.Scene, sensor: mi.Sensor, seed: int, spp: int) -> None:
        """Render the pilot and share the samples out, unless the last pilot is that of this image."""
        seed = seed if self.pilot_seed is None else self.pilot_seed
        footprint = Footprint(sensor.film())
        width, height = footprint.window
        known = self._pilot
        if known is not None and (known.seed, known.spp, known.counts.shape) == (seed, spp, (height, width)):
            return
        self.sharing.check(spp)
        means, *moments = self._moments(scene, sensor, seed, np.arange(width * height), spp)
        mean, variance = (values.reshape(height, width, _COLOURS) for values in moments)
        number = self.sharing.counts(mean, variance, spp)
        self._pilot = Pilot(seed, spp, number, means, footprint.crop(number.astype(np.float32)))

    def counts_apart(self, scene: mi.Scene, sensor: mi.Sensor, seed: int, spp: int) -> Integers:
        """Samples (height, width) that an image would share out to those of its pixels that `sensor` shows (`part`)."""
        width, height = Footprint(sensor.film()).window
        around = np.arange(len(NEIGHBOURS) * width * height)
        _, *moments = self._moments(scene, sensor, band_seed(seed, 1), around, spp)
        mean, variance = (values.reshape(-1, height, width, _COLOURS).mean(0) for values in moments)
        return self.sharing.counts_apart(mean, variance, spp)

    def _moments(
        self, scene: mi.Scene, sensor: mi.Sensor, seed: int, pixels: Integers, spp: int
    ) -> tuple[Floats, Floats, Floats]:
        """Of the pilot's samples of pixels, numbered as in `_means`: means (pixels, columns) in the columns of
        `Layout.row`, and mean and variance (pixels, 3) of the colours of one."""
        number = self.sharing.at_least
        blocks = min(_BLOCKS, number)

        def of_pixels(pixels: Integers) -> tuple[Floats, Floats, Floats]:
            means = self._means(scene, sensor, seed, pixels, np.zeros_like(pixels), spp, blocks, squares=True)
            # Pixels last in memory: sums over short axes that are inside are slow
            by_block = means.reshape(len(pixels), blocks, -1).transpose(1, 2, 0)
            of_blocks = np.ascontiguousarray(by_block, np.float64).transpose(2, 0, 1)
            columns, squares = of_blocks[..., :-_COLOURS], of_blocks[..., -_COLOURS:].mean(1)
            return columns.mean(1), *of_a_sample(columns[..., :_COLOURS], squares, number)

        step = self._sets_at_once
        parts = [of_pixels(pixels[first : first + step]) for first in range(0, len(pixels), step)]
        means, mean, variance = (np.concatenate(values) for values in zip(*parts, strict=True))
        return means, mean, variance

    def band_means(self, scene: mi.Scene, sensor: mi.Sensor, seed: int, spp: int, number: int) -> Floats:
        """Means over the rays of each pixel of a band of what they bring, in the columns of `Layout.row`."""
        pilot = self._pilot
        assert pilot is not None, "explore comes before bands"
        footprint = Footprint(sensor.film())
        width, band = footprint.window[0], footprint.bands(spp)[number]
        pixels = slice(band.start * width, band.stop * width)
        sets = pilot.counts.ravel()[pixels] // self.sharing.at_least
        known = seed == pilot.seed
        # Pixels are last in memory, and stay so: loops over few columns are slow
        sums = pilot.means[pixels].copy(order="K") if known else np.zeros_like(pilot.means[pixels])
        more = np.flatnonzero(sets > known)
        # Wavefronts end between pixels: then the bits do not depend on where
        part = np.cumsum(sets[more] - known) // self._sets_at_once
        for own in np.split(more, np.flatnonzero(np.diff(part)) + 1) if len(more) else []:
            sums[own] += self._sums(scene, sensor, seed, pixels.start + own, sets[own], spp, int(known))
        return sums / sets[:, None]

    def _sums(
        self, scene: mi.Scene, sensor: mi.Sensor, seed: int, pixels: Integers, sets: Integers, spp: int, first: int
    ) -> Floats:
        """Sums over sets of `at_least` samples of each pixel, from set `first` to before its number of `sets`, of the
        means over each set, in the columns of `Layout.row`."""
        number = sets - first
        begin = np.cumsum(number) - number
        rank = np.arange(number.sum()) - np.repeat(begin, number)
        starts = (first + rank) * self.sharing.at_least
        means = self._means(scene, sensor, seed, np.repeat(pixels, number), starts, spp)
        return np.add.reduceat(means, begin, axis=0, dtype=np.float64)

    @property
    def _sets_at_once(self) -> int:
        """Sets of `at_least` samples in a wavefront, about."""
        return max(1, accumulation.BAND_RAYS // self.sharing.at_least)

    def _means(
        self,
        scene: mi.Scene,
        sensor: mi.Sensor,
        seed: int,
        pixels: Integers,
        starts: Integers,
        spp: int,
        blocks: int = 1,
        *,
        squares: bool = False,
    ) -> Floats:
        """Means over `at_least` samples of pixels, from number `starts` of each on, in one wavefront.

        The columns are those of `Layout.row`, then the squares of the colours if they are asked for. Each set of
        samples has a row for each of so many blocks of it. Pixels are numbered row by row. In an image that stands for
        a larger one (`part`), there is a window of them for each of `NEIGHBOURS`, with other scrambles.
        """
        film, footprint = sensor.film(), Footprint(sensor.film())
        film.prepare(self.aov_names())
        number = self.sharing.at_least
        picked = mi.UInt32(pixels.astype(np.uint32))
        sampler = self._sampler_of(sensor, self.sharing.most(spp))
        width, height = footprint.window
        sampler.cover(width, height, range(height), order="none")
        sampler.pick(picked, mi.UInt32(starts.astype(np.uint32)))
        sampler.cross(number)
        sampler.consecutive = blocks > 1  # blocks of the sequence are nets
        sampler.set_samples_per_wavefront(number)
        sampler.seed(dr.opaque(mi.UInt32, seed), len(pixels) * number)

        index = dr.arange(mi.UInt32, len(pixels) * number)
        pixel = dr.gather(mi.UInt32, picked, quotient(index, number))
        shift = None
        if self.part != 1:
            neighbour = pixel // (width * height)
            pixel -= neighbour * (width * height)
            shift = dr.gather(mi.Vector2f, mi.Vector2f(np.transpose(NEIGHBOURS)), neighbour)
        row = pixel // int(width)
        corner = mi.Point2i(mi.Int32(pixel - row * width), mi.Int32(row))
        corner += mi.ScalarPoint2i(film.crop_offset()) - footprint.border
        rays = self.rays_of(sensor, sampler, index, corner, shift)
        values = self.values(scene, film, sampler, rays)
        layout = self.layout(film)
        columns = layout.row(values, footprint.weights(rays.drawn.pixel) if layout.taps else [])
        moments = [c * c for c in values.channels[:_COLOURS]] if squares else []
        return pixel_means([*columns, *moments], index, number // blocks)


def make_plain(props: mi.Properties) -> Plain:
    """The plug-in ``plain``: with samples shared out if the property ``adaptive`` says so, else with equally many."""
    adaptive = one_of("adaptive", read_property(props, "adaptive", "off"), ("off", *KINDS)) != "off"
    return (Adaptive if adaptive else Plain)(props)


mi.register_integrator("plain", make_plain)
