"""How many samples each pixel of an image gets, by the noise in a pilot of all pixels. This module needs no Mitsuba.

The samples of a pixel must not decide how many it gets: a mean that is stopped where it looks good is biased. So the
pixels are divided as on a checkerboard, and each half decides for the other.

Let V_p be the mean of the variances of a sample in the pixels of the other half among the 5 × 5 around p. With n
samples of a net, the error of p has a variance of about V_p / n^r. The rate r is 1 for noise of many causes, 3/2 at the
edges of a function of two coordinates, and more where all is smooth. Another n samples reduce the variance by
V_p (1 − 2^(−r)) / n^r, each of them by an n-th of that. Samples are doubled first where this quotient is largest. Where
no pixel of the other half is near, or none with finite samples, V_p is the mean over that half.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter

from .._support.arrays import Integers
from .._support.checks import one_of
from .blend import Floats, checkerboard

#: Measures by which errors are compared
KINDS = ("balanced", "absolute", "relative")
#: Power of the brightness that variances are divided by
POWERS = {"absolute": 0.0, "balanced": 0.75, "relative": 2.0}
#: Variances of errors fall with this power of the number of samples
RATE = 1.25
#: Default of the largest number of samples of a pixel over the average
SPREAD = 4
#: The noise of a pixel is estimated from so many pixels on each side
REACH = 2
#: Those pixels of the other half, right of and below a pixel
NEIGHBOURS = tuple((x, y) for y in range(-REACH, REACH + 1) for x in range(-REACH, REACH + 1) if (x + y) % 2)
#: Least brightness that errors are divided by, as a part of the mean
DARK = 0.1


@dataclass(frozen=True)
class Sharing:
    """How samples are shared out.

    Parameters
    ----------
    adaptive : str
        "absolute": they go where they reduce the mean squared error most. "relative": where they reduce most that of
        the error over the brightness around the pixel, so that dark parts have their share. "balanced": in between;
        it weighs errors about as the eye sees them.
    at_least : int
        Samples of the pilot, which each pixel has at least: a power of two.
    at_most : int
        Samples of a pixel at most, `at_least` times a power of two; 0: four times those on average.
    target : float
        Standard error of a pixel below which it gets no more samples, in the unit of the image; with "relative" that
        over the brightness around the pixel.

    Raises
    ------
    ValueError
        Numbers that are no powers of two, an unknown name, a target below 0.
    """

    adaptive: str = "balanced"
    at_least: int = 16
    at_most: int = 0
    target: float = 0.0

    def __post_init__(self) -> None:
        one_of("adaptive", self.adaptive, KINDS)
        least = self.at_least
        if least < 2 or least & (least - 1):
            raise ValueError(f"at_least must be a power of two, 2 or more, got {least}; take 16")
        ratio = self.at_most // least
        if self.at_most and (ratio * least != self.at_most or ratio < 1 or ratio & (ratio - 1)):
            raise ValueError(
                f"at_most must be at_least={least} times a power of two, or 0, got {self.at_most}; take {16 * least}"
            )
        if not 0 <= self.target < math.inf:
            raise ValueError(f"target must be a number of at least 0, got {self.target}")

    def check(self, spp: int) -> None:
        """Raise ValueError if the pilot takes all of so many samples per pixel."""
        if spp <= self.at_least:
            raise ValueError(
                f"adaptive sampling needs more samples per pixel than the {self.at_least} of its pilot, got {spp}; "
                f"take {SPREAD * self.at_least}, or a smaller at_least"
            )

    def most(self, spp: int) -> int:
        """Samples of a pixel at most, of so many on average."""
        return self.at_most or self.at_least << (SPREAD * spp // self.at_least).bit_length() - 1

    def counts(self, mean: Floats, variance: Floats, spp: int) -> Integers:
        """Samples of each pixel.

        Parameters
        ----------
        mean, variance : ndarray, (height, width, channels)
            Of the samples of a pilot in each pixel; variances are those of a sample, see `of_a_sample`.
        spp : int
            Samples per pixel, on average, at most.

        Returns
        -------
        ndarray of int64, (height, width)
            `at_least` times a power of two each. Those of either half of the checkerboard depend on the other half's
            pilot only, and have the budget on average.

        Examples
        --------
        >>> noise = np.zeros((8, 8, 1))
        >>> noise[:, 4:] = 1
        >>> Sharing("absolute", at_most=64).counts(np.ones((8, 8, 1)), noise, 32)[0].tolist()
        [16, 16, 16, 32, 32, 32, 64, 64]
        """
        height, width = mean.shape[:2]
        half = checkerboard(height, width, 0)
        number = np.full(half.shape, self.at_least, np.int64)
        brightness, noise = np.abs(mean.mean(-1)), variance.mean(-1)
        for own in (0, 1):
            others, chosen = half != own, half == own
            if not np.isfinite(noise[others]).any():
                number[chosen] = self._equal(spp)
                continue
            light = _lit(_around(brightness, others), brightness[others])
            number[chosen] = self._shared_out(_around(noise, others)[chosen], light[chosen], spp)
        return number

    def counts_apart(self, mean: Floats, variance: Floats, spp: int) -> Integers:
        """Samples of pixels (height, width) far from each other, by mean and variance of what is around each."""
        brightness, noise = np.abs(mean.mean(-1)), variance.mean(-1)
        if not np.isfinite(noise).any():
            return np.full(noise.shape, self._equal(spp), np.int64)
        noise = np.where(np.isfinite(noise), noise, _mean_of_known(noise))
        return self._shared_out(noise.ravel(), _lit(brightness, brightness).ravel(), spp).reshape(noise.shape)

    def _equal(self, spp: int) -> int:
        """Samples of pixels of whose noise nothing is known."""
        return min(self.most(spp), self.at_least << (int(spp) // self.at_least).bit_length() - 1)

    def _shared_out(self, noise: Floats, light: Floats, spp: int) -> Integers:
        """Samples (pixels,) of pixels with these variances of a sample, within the budget on average.

        Errors are compared with one another by a power of the brightness `light`, and with the target as they are or,
        if they are relative, divided by it.
        """
        weighed = noise / light ** POWERS[self.adaptive]
        measured = weighed if self.adaptive == "relative" else noise
        doublings = (self.most(spp) // self.at_least).bit_length() - 1
        levels = self.at_least * 2 ** np.arange(doublings)[:, None]  # samples of a pixel before each doubling
        # Pixels by their noise: gains then fall along each level, and runs in order are sorted fast
        ranked = np.argsort(-weighed, kind="stable")
        gain = weighed[ranked] / levels ** (RATE + 1)
        wanted = measured[ranked] > self.target**2 * levels
        order = np.argsort(-np.where(wanted, gain, -1.0), axis=None, kind="stable")
        cost = np.broadcast_to(levels, gain.shape).ravel()[order]
        doubled = np.zeros(gain.size, bool)
        doubled[order] = np.cumsum(cost) <= (spp - self.at_least) * len(noise)
        number = np.empty(len(noise), np.int64)
        number[ranked] = self.at_least * 2 ** (doubled.reshape(gain.shape) & wanted).sum(0)
        return number


def of_a_sample(blocks: Floats, squares: Floats, number: int) -> tuple[Floats, Floats]:
    """Means (pixels, channels) of samples, and variances of a sample.

    Parameters
    ----------
    blocks : ndarray, (pixels, blocks, channels)
        Means over blocks of consecutive samples: parts of a net that are nets themselves.
    squares : ndarray, (pixels, channels)
        Means of squared samples.
    number : int
        Samples of a pixel.

    Notes
    -----
    There are two estimates, and this is their mean: the sample variance s², and b times that of the means of blocks of
    b samples. The second is less where the samples are much better than random ones, but uncertain. If a sample is not
    finite, nor is the variance.

    Examples
    --------
    >>> mean, variance = of_a_sample(np.array([[[1.0], [3.0]]]), np.array([[8.0]]), 4)
    >>> mean.item(), round(variance.item(), 3)  # s² = (8 − 2²) 4/3, and 2 · 2
    (2.0, 4.667)
    """
    with np.errstate(invalid="ignore", over="ignore"):
        mean = blocks.mean(1)
        of_samples = np.maximum(squares - mean**2, 0) * number / (number - 1)
        of_blocks = blocks.var(1, ddof=1) * number / blocks.shape[1]
        return mean, (of_samples + of_blocks) / 2


def parse_sharing(adaptive: str | None, at_least: int, at_most: int, target: float) -> Sharing | None:
    """The settings of the command line's options; None without ``--adaptive``, which the other options need."""
    if adaptive is not None:
        return Sharing(adaptive, at_least, at_most, target)
    if (at_least, at_most, target) != (Sharing.at_least, Sharing.at_most, Sharing.target):
        raise ValueError("at-least, at-most and pixel-error need --adaptive; give 'balanced'")
    return None


def _around(values: Floats, others: Floats) -> Floats:
    """Means (height, width) of the finite values of the other half around each pixel, or of all where none is near."""
    known = others & np.isfinite(values)
    size = 2 * REACH + 1
    weight = uniform_filter(known.astype(np.float64), size, mode="constant")
    total = uniform_filter(np.where(known, values, 0.0).astype(np.float64), size, mode="constant")
    some = 0.5 / size**2
    near = np.maximum(total, 0.0) / np.maximum(weight, some)
    return np.where(weight > some, near, _mean_of_known(values[others]))


def _lit(around: Floats, brightness: Floats) -> Floats:
    """The brightness around pixels. Below a tenth of the mean `brightness`, that tenth counts."""
    dark = DARK * _mean_of_known(brightness)
    return np.maximum(np.where(np.isfinite(around), around, 0.0), dark or 1.0)


def _mean_of_known(values: Floats) -> float:
    """Mean of the finite values; 0 if there are none."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else 0.0
