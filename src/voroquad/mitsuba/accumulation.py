"""Sums over the rays of each pixel that are the same bits on any number of threads.

Mitsuba adds the rays of a pixel to the film in whatever order its threads reach them. Here a pixel's rays are added in
runs that one thread works off in order, and the runs in double precision one after the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from .blend import checkerboard

Floats = NDArray[np.float64]

#: Rays of a run at most: it must divide the rays that a thread takes at a time (2^14), and keep rounding low
_LONGEST_RUN = 2**10


def pixel_means(values: Sequence[mi.Float], index: mi.UInt32, spp: int) -> Floats:
    """Means (pixels, len(values)) over the `spp` consecutive rays of each pixel; `index` numbers the rays."""
    run = min(spp & -spp, _LONGEST_RUN)  # the largest power of two that divides spp
    place = index // dr.opaque(mi.UInt32, run)
    sums = [dr.zeros(mi.Float, dr.width(index) // run) for _ in values]
    for total, value in zip(sums, values, strict=True):
        dr.scatter_reduce(dr.ReduceOp.Add, total, value, place)
    dr.eval(sums)
    of_runs = np.stack([np.array(total, dtype=np.float64) for total in sums], -1)
    return of_runs.reshape(-1, spp // run, len(values)).sum(1) / spp


@dataclass
class Pass:
    """What one pass over the pixels gives, float64.

    Attributes
    ----------
    plain : ndarray, (height, width, channels)
        The image with equal weights: colours, then the other channels.
    differences : ndarray, (2, height, width, 3)
        What the weights add to its colours, from the samples of each half of a checkerboard of pixels.
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
        """Colours (height, width, 3) with a share λ (2, height, width) of what each half's weights add."""
        return self.plain[..., :3] + (share[..., None] * self.differences).sum(0)


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

    def weights(self, pixel: mi.Point2f) -> list[mi.Float]:
        """f of samples at `pixel`, in [0, 1)², for the neighbour at each of the `offsets`."""
        if self.reach == 0:
            return [mi.Float(1)]
        along = [[self._filter.eval(o + 0.5 - u) for o in range(-self.reach, self.reach + 1)] for u in pixel]
        return [fy * fx for fy in along[1] for fx in along[0]]

    def gather(self, given: Floats) -> Floats:
        """Sums (height, width, k) of what the pixels (rows, columns, len(offsets), k) of the window give to each."""
        rows, columns = given.shape[:2]
        reach = self.reach
        padded = np.zeros((rows + 2 * reach, columns + 2 * reach, given.shape[-1]))
        for number, (x, y) in enumerate(self.offsets):
            padded[reach + y : reach + y + rows, reach + x : reach + x + columns] += given[:, :, number]
        top = reach + self.border
        return padded[top : top + self.height, top : top + self.width]

    def crop(self, window: Floats) -> Floats:
        """The crop window (height, width, …) of an array of the window to sample."""
        b = self.border
        return window[b : b + self.height, b : b + self.width]

    def spread(self, channels: Sequence[mi.Float], change: Sequence[mi.Float], pixel: mi.Point2f) -> list[mi.Float]:
        """What rays give: to their own pixel, and through the filter to it and to those around it.

        Parameters
        ----------
        channels : sequence of mitsuba.Float, (rays,)
            What they bring; colours first.
        change : sequence of mitsuba.Float, (rays,)
            What the weights add to the colours; empty for nothing.
        pixel : mitsuba.Point2f
            Where in their pixels the rays are.
        """
        own = [*channels[:3], *change]
        return [*own, *(f * v for f in self.weights(pixel) for v in (mi.Float(1), *channels, *change))]

    def collect(self, means: Floats, channels: int) -> Pass:
        """The image from the means (pixels, …) of what `spread` made of so many channels."""
        columns, rows = self.window
        taps = len(self.offsets)
        changes = (means.shape[-1] - 3 - taps * (1 + channels)) // (1 + taps)  # 3, or 0 without weights
        means = means.reshape(rows, columns, -1)
        own, given = np.split(means, [3 + changes], axis=-1)
        given = given.reshape(rows, columns, taps, -1)

        total = self.gather(given[..., : 1 + channels])
        weight = np.where(total[..., :1] == 0, 1, total[..., :1])
        pixel_plain = self.crop(own[..., :3])
        if changes == 0:
            none = np.zeros_like(pixel_plain)
            return Pass(total[..., 1:] / weight, np.stack([none, none]), pixel_plain, none)
        half = checkerboard(rows, columns)[..., None, None]
        differences = [self.gather(given[..., 1 + channels :] * (half == h)) / weight for h in (0, 1)]
        return Pass(total[..., 1:] / weight, np.stack(differences), pixel_plain, self.crop(own[..., 3:]))
