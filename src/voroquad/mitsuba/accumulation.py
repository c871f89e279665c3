"""Sums over the rays of each pixel that are the same bits on any number of threads.

Mitsuba adds the rays of a pixel to the film in whatever order its threads reach them. Here a pixel's rays are added in
runs that one thread works off in order, and the runs in double precision one after the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from .blend import Floats, checkerboard, of_own_half, strips

#: Rays of a run at most: it must divide the rays that a thread takes at a time (2^14), and keep rounding low
_LONGEST_RUN = 2**10
#: Values that Dr.Jit adds side by side in one go, at most
_PACKET = 8
#: Rays of a band: some seconds of one thread
BAND_RAYS = 2**23


def quotient(index: mi.UInt32, n: int) -> mi.UInt32:
    """index // n, with one kernel for all n of a kind: a shift for powers of two, as processors divide slowly."""
    shift = n.bit_length() - 1
    return index >> dr.opaque(mi.UInt32, shift) if 1 << shift == n else index // dr.opaque(mi.UInt32, n)


def pixel_means(values: Sequence[mi.Float], index: mi.UInt32, spp: int) -> Floats:
    """Means (pixels, len(values)) over the `spp` consecutive rays of each pixel; `index` numbers the rays.

    A run is what a pixel has in a block of 2^10 rays. Ray i is in run i // spp + i // 2^10: different pixels or blocks,
    different runs. Where 2^10 is a multiple of spp, pixels are runs.
    """
    rays, number = dr.width(index), quotient(index, spp)
    runs = rays // spp
    divided = _LONGEST_RUN % spp != 0
    if divided:
        number += index // _LONGEST_RUN
        runs += -(-rays // _LONGEST_RUN)
    packet = min(_PACKET, 1 << (len(values) - 1).bit_length())  # a power of two
    packets = -(-len(values) // packet)
    sums = dr.zeros(mi.Float, runs * packets * packet)
    for k in range(packets):
        side_by_side = [*values[k * packet : (k + 1) * packet], *[mi.Float(0)] * packet][:packet]
        dr.scatter_add(sums, mi.ArrayXf(side_by_side), number * packets + k)
    of_runs = np.asarray(sums).reshape(runs, packets * packet)[:, : len(values)]
    if not divided:
        return of_runs / np.float32(spp)
    pixel = np.arange(rays // spp)
    of_pixels = np.add.reduceat(of_runs, pixel + pixel * spp // _LONGEST_RUN, axis=0, dtype=np.float64)
    return (of_pixels / spp).astype(np.float32)


@dataclass
class Pass:
    """What one pass over the pixels gives, float32 or float64.

    Attributes
    ----------
    plain : ndarray, (height, width, channels)
        The image with equal weights: colours, then the other channels.
    differences : ndarray, (2, height, width, 3) or (1, height, width, 3)
        What the weights add to its colours, from the samples of each half of a checkerboard of pixels; or in all,
        where each pixel shows its own samples alone.
    pixel_plain, pixel_difference : ndarray, (height, width, 3)
        Means over the samples of each pixel, without the film's filter: colours, and what weights add to them.
    """

    plain: Floats
    differences: Floats
    pixel_plain: Floats
    pixel_difference: Floats

    @property
    def size(self) -> tuple[int, int]:
        """Height and width."""
        height, width = self.plain.shape[:2]
        return height, width

    def blended(self, share: Floats) -> Floats:
        """The image (height, width, channels) with a share λ (2, height, width) of what each half's weights add."""
        if len(self.differences) == 1:
            share = of_own_half(share)[None]
        image = self.plain.copy(order="K")
        for rows in strips(len(image), tiles=4):
            for of_half, difference in zip(share, self.differences, strict=True):
                for channel in range(3):  # plane by plane, as they lie in memory
                    image[rows, :, channel] += of_half[rows] * difference[rows, :, channel]
        return image


class Footprint:
    """What the samples of a pixel give to the pixels around it, by the film's reconstruction filter.

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

    def strip_shape(self, spp: int, channels: int, changes: int) -> tuple[int, int, int]:
        """The shape of the first band's strip; the last band's may have fewer rows."""
        own = channels + changes if self.reach == 0 else 4 + channels + 3 * changes
        return len(self.bands(spp)[0]) + 2 * self.reach, self.window[0], own

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

    def spread(self, channels: Sequence[mi.Float], change: Sequence[mi.Float], pixel: mi.Point2f) -> list[mi.Float]:
        """What rays give: to their own pixel, and through a filter that reaches others to it and to those.

        Parameters
        ----------
        channels : sequence of mitsuba.Float, (rays,)
            What they bring; colours first.
        change : sequence of mitsuba.Float, (rays,)
            What the weights add to the colours; empty for nothing.
        pixel : mitsuba.Point2f
            Where in their pixels the rays are.
        """
        if self.reach == 0:
            return [*channels, *change]
        own = [*channels[:3], *change]
        return [*own, *(f * v for f in self.weights(pixel) for v in (mi.Float(1), *channels, *change))]

    def strip(self, means: Floats, channels: int, band: range) -> Floats:
        """The strip (rows + 2 reach, columns, …) of a band from the means (pixels, …) of what `spread` made."""
        means = means.reshape(len(band), self.window[0], -1)
        if self.reach == 0:
            return means
        taps = len(self.offsets)
        changes = (means.shape[-1] - 3 - taps * (1 + channels)) // (1 + taps)  # 3, or 0 without weights
        own, given = np.split(means, [3 + changes], axis=-1)
        given = given.reshape(*given.shape[:2], taps, -1)
        half = checkerboard(len(band), self.window[0], band.start)[..., None, None]
        plain, change = given[..., : 1 + channels], given[..., 1 + channels :]
        sums = [plain, *(change * (half == h) for h in (0, 1))] if changes else [plain]
        margin = ((self.reach, self.reach), (0, 0), (0, 0))
        return np.concatenate([np.pad(own, margin), *(self.gather(s) for s in sums)], -1)

    def whole(self, strips: Iterable[Floats], bands: Sequence[range], channels: int) -> Pass:
        """The image from the strips of all bands, with so many channels; rows that are too many are not looked at."""
        columns, rows = self.window
        total: Floats = np.zeros(0)
        for strip, band in zip(strips, bands, strict=True):
            height = len(band) + 2 * self.reach
            if total.size == 0:
                planes: Floats = np.zeros((strip.shape[-1], rows + 2 * self.reach, columns), strip.dtype)
                total = np.moveaxis(planes, 0, -1)
            if self.reach == 0:
                total[band.start : band.stop] = strip[:height]
            else:
                total[band.start : band.start + height] += strip[:height]
        total = total[self.reach : self.reach + rows]
        return self._pass_of_box(total, channels) if self.reach == 0 else self._pass_of_filter(total, channels)

    def _pass_of_box(self, total: Floats, channels: int) -> Pass:
        plain, change = np.split(self.crop(total), [channels], axis=-1)
        if change.shape[-1] == 0:
            change = np.zeros_like(plain[..., :3])
        return Pass(plain, change[None], plain[..., :3], change)

    def _pass_of_filter(self, total: Floats, channels: int) -> Pass:
        image = self.crop(total)
        changes = (total.shape[-1] - 4 - channels) // 3
        own, weight, plain, *differences = np.split(
            image, np.cumsum([3 + changes, 1, channels, changes])[: 4 if changes else 2], axis=-1
        )
        weight = np.where(weight == 0, 1, weight)
        pixel_plain = own[..., :3]
        if changes == 0:
            none = np.zeros_like(pixel_plain)
            return Pass(plain / weight, np.stack([none, none]), pixel_plain, none)
        return Pass(plain / weight, np.stack([d / weight for d in differences]), pixel_plain, own[..., 3:])
