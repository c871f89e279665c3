"""Sums over the rays of each pixel that are the same bits on any number of threads.

Mitsuba adds the rays of a pixel to the film in whatever order its threads reach them. Here a pixel's rays are added in
runs that one thread works off in order, and the runs in double precision one after the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import drjit as dr
import mitsuba as mi
import numpy as np

from .blend import Floats, checkerboard, of_own_half, strips

#: Rays of a run at most: it must divide the rays that a thread takes at a time (2^14), and keep rounding low
_LONGEST_RUN = 2**10
#: Of up to 2^15 rays for each thread, each takes an equal part, which begins at a SIMD packet: runs are as short as the
#: shortest of these then. Up to so many threads the sums do not depend on their number
_EQUAL_PARTS, _SHORT_RUN, _THREADS = 2**15, 4, 32
#: Values that Dr.Jit adds side by side in one go, at most
_PACKET = 8
#: Rays of a band: some seconds of one thread
BAND_RAYS = 2**23
#: Least sum of weights, over that of equal ones, that a pixel of a wide filter is divided by
_LEAST_SUM = 0.25


def quotient(index: mi.UInt32, n: int) -> mi.UInt32:
    """index // n, with one kernel for all n of a kind: a shift for powers of two, as processors divide slowly."""
    shift = n.bit_length() - 1
    return index >> dr.opaque(mi.UInt32, shift) if 1 << shift == n else index // dr.opaque(mi.UInt32, n)


def _size_class(runs: int) -> int:
    """The least of eight numbers in each octave that is not below `runs`."""
    step = 1 << max(0, runs.bit_length() - 4)
    return -(-runs // step) * step


def pixel_means(values: Sequence[mi.Float], index: mi.UInt32, spp: int) -> Floats:
    """Means (pixels, len(values)) over the `spp` consecutive rays of each pixel; `index` numbers the rays.

    A run is what a pixel has in a block of `longest` rays. Ray i is in run i // spp + i // longest: different pixels or
    blocks, different runs. Where `longest` is a multiple of spp, pixels are runs.

    Dr.Jit adds in an array for each thread, whose size is a literal of the kernel. It is one of few, as another number
    of runs must not cost a compilation.
    """
    rays, number = dr.width(index), quotient(index, spp)
    runs = rays // spp
    longest = _SHORT_RUN if rays <= _EQUAL_PARTS * max(_THREADS, dr.thread_count()) else _LONGEST_RUN
    divided = longest % spp != 0
    if divided:
        number += index // longest
        runs += -(-rays // longest)
    packet = min(_PACKET, 1 << (len(values) - 1).bit_length())  # a power of two
    packets = -(-len(values) // packet)
    sums = dr.zeros(mi.Float, _size_class(runs) * packets * packet)
    for k in range(packets):
        side_by_side = [*values[k * packet : (k + 1) * packet], *[mi.Float(0)] * packet][:packet]
        dr.scatter_add(sums, mi.ArrayXf(side_by_side), number * packets + k)
    of_runs = np.asarray(sums).reshape(-1, packets * packet)[:runs]
    if not divided:
        return (of_runs / np.float32(spp))[:, : len(values)]  # rows of a few columns are slow to divide
    of_runs = of_runs[:, : len(values)]
    pixel = np.arange(rays // spp)
    of_pixels = np.add.reduceat(of_runs, pixel + pixel * spp // longest, axis=0, dtype=np.float64)
    return (of_pixels / spp).astype(np.float32)


@dataclass
class Contributions:
    """Contributions of the rays of a wavefront.

    Attributes
    ----------
    channels : list of mitsuba.Float, (rays,)
        To the channels of the film; colours first.
    change : list of mitsuba.Float, (rays,)
        What the weights add to the colours, (N w − 1) times what they multiply; empty without weights, as those below.
    noise : list of mitsuba.Float, (rays,)
        Contrasts of neighbouring samples times what the weights multiply, see `voroquad.mitsuba.contrasts`.
    excess : mitsuba.Float, optional
        N w − 1.
    weighted : list of mitsuba.Float, (rays,)
        The colours that the weights multiply, where those are not all of the ray's; else empty.
    """

    channels: list[mi.Float]
    change: list[mi.Float] = field(default_factory=list)
    noise: list[mi.Float] = field(default_factory=list)
    excess: mi.Float | None = None
    weighted: list[mi.Float] = field(default_factory=list)


@dataclass(frozen=True)
class Layout:
    """The columns in which sums over rays are kept, for the rays of a pixel and for a strip of the image.

    Parameters
    ----------
    channels : int
        Channels of the image: colours, then others.
    weights : bool
        Do the samples have weights?
    partly : bool
        Do the weights multiply a part of the colours only?
    taps : int
        Pixels that the film's filter lets a sample contribute to; 0 for a box filter, which reaches no other pixel.

    Notes
    -----
    With a box filter the columns of both are ``channels | change (3) | noise (3)``, the last two with weights only.
    A wider filter needs the sums of a pixel's own samples for the blend, and the filtered ones for the image:

    * of a pixel: ``own | tap | tap | …``, one tap for each neighbour, with
      ``own = colours (3) | change (3) | noise (3)``
      ``tap = plain | changes``, ``plain = filter weight (1) | channels | weighted colours (3, if partly)``,
      ``changes = change (3) | excess (1)``;
    * of a strip: ``own | plain | changes of half 0 | changes of half 1``, where a half is one colour of a checkerboard
      of the pixels that the samples belong to.
    """

    channels: int
    weights: bool = False
    partly: bool = False
    taps: int = 0

    @property
    def own(self) -> int:
        """Columns of a pixel's own samples, before the filtered ones; none with a box filter."""
        return 0 if self.taps == 0 else 3 + 6 * self.weights

    @property
    def plain(self) -> int:
        """Columns of a tap that the weights do not touch."""
        return 1 + self.channels + 3 * self.partly

    @property
    def changes(self) -> int:
        """Columns of a tap that the weights make."""
        return 4 * self.weights

    @property
    def of_strip(self) -> int:
        """Number of columns of a strip."""
        return self.channels + 6 * self.weights if self.taps == 0 else self.own + self.plain + 2 * self.changes

    def row(self, values: Contributions, filter_weights: Sequence[mi.Float]) -> list[mi.Float]:
        """The columns of rays, whose filter has these weights at the taps."""
        colours = values.channels[:3]
        if self.taps == 0:
            return [*values.channels, *values.change, *values.noise]
        excess = [] if values.excess is None else [values.excess]
        tap = [mi.Float(1), *values.channels, *values.weighted, *values.change, *excess]
        return [*colours, *values.change, *values.noise, *(f * v for f in filter_weights for v in tap)]

    def taps_of(self, means: Floats) -> tuple[Floats, Floats, Floats]:
        """Columns (…, columns) of pixels, split: their own (…, own), plain (…, taps, plain), and (…, taps, changes)."""
        own, given = means[..., : self.own], means[..., self.own :]
        given = given.reshape(*given.shape[:-1], self.taps, self.plain + self.changes)
        return own, given[..., : self.plain], given[..., self.plain :]

    def split(self, strip: Floats) -> tuple[Floats, Floats, list[Floats]]:
        """Columns of a strip, split: own (channels, change and noise with a box filter), plain, changes by half."""
        if self.taps == 0:
            return strip, strip[..., : self.channels], []
        ends = np.cumsum([self.own, self.plain, self.changes])
        own, plain, *changes = np.split(strip, ends, axis=-1)
        return own, plain, changes if self.weights else []


@dataclass
class Pass:
    """Result of one pass over the pixels, float32 or float64.

    Attributes
    ----------
    plain : ndarray, (height, width, channels)
        The image with equal weights: colours, then the other channels.
    differences : ndarray, (2, height, width, 3) or (1, height, width, 3)
        What the weights add to its colours, from the samples of each half of a checkerboard of pixels; or in all,
        where each pixel shows its own samples alone.
    pixel_plain, pixel_difference, pixel_noise : ndarray, (height, width, 3)
        Means over the samples of each pixel, without the film's filter: colours, what weights add to them, and the
        contrasts that tell the noise which the weights do not see.
    excess : ndarray, (2, height, width) or None
        What the weights add to the sum of filter weights, over that sum, from the samples of each half; None where the
        weights of each pixel sum to what equal ones do.
    weighted : ndarray, (height, width, 3) or None
        The part of `plain` that the weights multiply; None: its colours.
    """

    plain: Floats
    differences: Floats
    pixel_plain: Floats
    pixel_difference: Floats
    pixel_noise: Floats
    excess: Floats | None = None
    weighted: Floats | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Height and width."""
        height, width = self.plain.shape[:2]
        return height, width

    def blended(self, share: Floats) -> Floats:
        """The image (height, width, channels) with a share λ (2, height, width) of what each half's weights add.

        Under a wide filter, the weighted part P + Σ λ D of a pixel is divided by the sum of its weights: with v what
        the weights add to the sum of filter weights, it is (P + Σ λ D) / (1 + Σ λ v).
        """
        if len(self.differences) == 1:
            share = of_own_half(share)[None]
        image = self.plain.copy(order="K")
        for rows in strips(len(image), tiles=4):
            for channel in range(3):  # plane by plane, as they lie in memory
                for of_half, difference in zip(share, self.differences, strict=True):
                    image[rows, :, channel] += of_half[rows] * difference[rows, :, channel]
        if self.excess is not None:
            added = (share * self.excess).sum(0)[..., None]
            plain = self.plain[..., :3]
            weighted = plain if self.weighted is None else self.weighted
            change = image[..., :3] - plain - added * weighted
            image[..., :3] = plain + change / np.maximum(1 + added, _LEAST_SUM)
        return image


class Footprint:
    """Contributions of the samples of a pixel to the pixels around it, by the film's reconstruction filter.

    Parameters
    ----------
    film : mitsuba.Film
        Its filter, of any radius; its crop window, and the border around it where the film samples that.

    Notes
    -----
    A sample at p of value v adds f(q − p) v to pixel q and f(q − p) to its weight, f the filter and q the pixel's
    centre; the pixel shows the sum over the weight. All samples that a pixel gives to the same neighbour are summed
    first, then the neighbours' gifts, in a fixed order: as Mitsuba's film, but for the order.

    An image is rendered in bands of rows. The strip of a band is what its pixels give, to pixels above and below it
    too; strips add up to the image.
    """

    def __init__(self, film: mi.Film) -> None:
        self._filter = film.rfilter()
        self.reach = 0 if self._filter.is_box_filter() else int(self._filter.border_size())
        self.border = int(self._filter.border_size()) if film.sample_border() else 0
        self.width, self.height = (int(n) for n in film.crop_size())
        offsets = range(-self.reach, self.reach + 1)
        self.offsets = [(x, y) for y in offsets for x in offsets]

    @property
    def window(self) -> tuple[int, int]:
        """Width and height of the pixels to sample: the crop window, and its border where the film samples that."""
        return self.width + 2 * self.border, self.height + 2 * self.border

    def bands(self, spp: int) -> list[range]:
        """The rows of the window, in bands of equally many rows but for the last."""
        columns, rows = self.window
        height = max(1, BAND_RAYS // (columns * spp))
        return [range(row, min(row + height, rows)) for row in range(0, rows, height)]

    def strip_shape(self, spp: int, layout: Layout) -> tuple[int, int, int]:
        """The shape of the first band's strip; the last band's may have fewer rows."""
        return len(self.bands(spp)[0]) + 2 * self.reach, self.window[0], layout.of_strip

    def weights(self, pixel: mi.Point2f) -> list[mi.Float]:
        """f of samples at `pixel`, in [0, 1)², for the neighbour at each of the `offsets`."""
        along = [[self._filter.eval(o + 0.5 - u) for o in range(-self.reach, self.reach + 1)] for u in pixel]
        return [fy * fx for fy in along[1] for fx in along[0]]

    def gather(self, given: Floats) -> Floats:
        """Sums (rows + 2 reach, columns, k) of what pixels (rows, columns, len(offsets), k) give."""
        rows, columns = given.shape[:2]
        reach = self.reach
        padded = np.zeros((rows + 2 * reach, columns + 2 * reach, given.shape[-1]))
        for number, (x, y) in enumerate(self.offsets):
            padded[reach + y : reach + y + rows, reach + x : reach + x + columns] += given[:, :, number]
        return padded[:, reach : reach + columns]

    def crop(self, window: Floats) -> Floats:
        """The crop window (height, width, …) of an array of the window to sample."""
        b = self.border
        return window[b : b + self.height, b : b + self.width]

    def layout(self, channels: int, *, weights: bool = False, partly: bool = False) -> Layout:
        """The columns of sums under this filter, see `Layout`."""
        return Layout(channels, weights, partly, len(self.offsets) if self.reach else 0)

    def strip(self, means: Floats, layout: Layout, band: range) -> Floats:
        """The strip (rows + 2 reach, columns, …) of a band from the means (pixels, …) over the rays of each pixel."""
        means = means.reshape(len(band), self.window[0], -1)
        if self.reach == 0:
            return means
        own, plain, change = layout.taps_of(means)
        half = checkerboard(len(band), self.window[0], band.start)[..., None, None]
        # Not a product with 0 or 1, which would carry values that are not finite into the other half
        sums = [plain, *(np.where(half == h, change, 0) for h in (0, 1))] if layout.weights else [plain]
        margin = ((self.reach, self.reach), (0, 0), (0, 0))
        return np.concatenate([np.pad(own, margin), *(self.gather(s) for s in sums)], -1)

    def whole(self, strips: Iterable[Floats], bands: Sequence[range], layout: Layout) -> Pass:
        """The image from the strips of all bands; rows that are too many are not looked at."""
        columns, rows = self.window
        planes: Floats = np.zeros(0)
        total = planes
        for strip, band in zip(strips, bands, strict=True):
            height = len(band) + 2 * self.reach
            if total.size == 0:
                planes = np.zeros((strip.shape[-1], rows + 2 * self.reach, columns), strip.dtype)
                total = np.moveaxis(planes, 0, -1)
            if self.reach == 0:
                total[band.start : band.stop] = strip[:height]
            else:
                total[band.start : band.start + height] += strip[:height]
        return _pass(self.crop(total[self.reach : self.reach + rows]), layout)


def _pass(image: Floats, layout: Layout) -> Pass:
    """What the columns of a strip say of all of an image."""
    own, plain, halves = layout.split(image)
    if layout.taps:
        weight = np.where(plain[..., :1] == 0, 1, plain[..., :1])
        plain, halves = plain[..., 1:] / weight, [half / weight for half in halves]
        colours, own = own[..., :3], own[..., 3:]
    else:
        colours, own = own[..., :3], own[..., layout.channels :]
    if not layout.weights:
        none = np.zeros_like(colours)
        return Pass(plain, none[None], colours, none, none)
    change, noise = own[..., :3], own[..., 3:]
    if not layout.taps:
        return Pass(plain, change[None], colours, change, noise)
    return Pass(
        plain[..., : layout.channels],
        np.stack([half[..., :3] for half in halves]),
        colours,
        change,
        noise,
        np.stack([half[..., 3] for half in halves]),
        plain[..., layout.channels :] if layout.partly else None,
    )
