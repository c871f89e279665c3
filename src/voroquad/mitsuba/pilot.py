"""Which of a few settings has the least variance per second in a scene: a pilot renders each of them, small.

The pilot's pixels are some of the image's, evenly spread, each with as many samples as in the image. Adaptive sampling
would give each of them a number of samples by the noise around it: the pilot measures that in its neighbours in the
image, and reckons what variance the sampler ``owensobol`` has with that number from what it has with fewest and with
those of the image. The pilot's samples are not in the
image, and it does not look at the clock: a setting's cost is a constant. So the choice is the same on every
machine, and leaves the image unbiased.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import mitsuba as mi
import numpy as np

from .._support.arrays import Integers
from .allocation import Sharing
from .blend import Floats
from .loading import motion_of
from .methods import ADAPTIVE, OF_MITSUBA, OWEN_SOBOL, OWN, WEIGHTS, RenderMethod, Stage
from .rounds import pilot_seed

#: The pilot's samples over those of the image or of its first round, at most
PART = 1 / 16
#: Pixels of the pilot: with fewer it tells too little, with more it tells no more
FEWEST_PIXELS, MOST_PIXELS = 64, 4096
#: Images of each candidate, whose spread is its variance
IMAGES = 2
#: Standard errors by which a candidate must beat the one before it; and the scene's own sampler, which is safe
MARGIN, OWN_MARGIN = 2.0, 1.0


@dataclass(frozen=True)
class Finding:
    """What the pilot found out about a candidate.

    Attributes
    ----------
    method : RenderMethod
        The candidate.
    variance : ndarray, (pixels,)
        Of the colours of each pixel (mean of the channels), times the candidate's cost: the variance that it would have
        in the time of a candidate of cost 1.
    """

    method: RenderMethod
    variance: Floats

    def over(self, other: Finding) -> tuple[float, float]:
        """The mean variance over another candidate's, with its standard error over the pixels."""
        below = float(other.variance.mean())
        if below == 0:
            return (1.0, 0.0) if self.variance.mean() == 0 else (math.inf, 0.0)
        ratio = float(self.variance.mean()) / below
        spread = (self.variance - ratio * other.variance).std() / math.sqrt(len(self.variance))
        return ratio, float(spread) / below

    def beats(self, other: Finding, margin: float) -> bool:
        """Is its mean variance less by so many standard errors?

        Of the ratio and of its inverse: a few pixels of large variance make the one or the other uncertain.
        """
        ratio, error = self.over(other)
        inverse, error_of_inverse = other.over(self)
        return ratio < 1 - margin * error and inverse > 1 + margin * error_of_inverse


def candidates(stage: Stage, spp: Sequence[int]) -> list[RenderMethod]:
    """The settings that a scene may be rendered with at any of these samples per pixel, the preferred ones first.

    The sampler ``owensobol``; Mitsuba's ``multijitter``; adaptive samples; weighted sets of the domain that the scene
    has, and of the wavelengths in a spectral variant; and the scene's own sampler. Those that the scene cannot take
    are left out, as are samplers that make another number of samples. Objects that move in slices need sets of times:
    there are no candidates then.
    """
    if motion_of(stage.scene):
        return []
    multijitter = next(method for method in OF_MITSUBA if method.name == "mitsuba-multijitter")
    domains = [stage.domain] if stage.domain != "pixel" else []
    if mi.is_spectral and "wavelength" not in domains:
        domains.append("wavelength")
    weights = [_weights(domain) for domain in domains]
    known = (OWEN_SOBOL, multijitter, ADAPTIVE, *weights, OWN)
    return [m for m in known if all(_fits(stage, m, n) for n in spp if m.makes(n)) and any(map(m.makes, spp))]


def _weights(domain: str) -> RenderMethod:
    """Weighted sets of a domain."""
    properties = WEIGHTS.properties | {"domain": domain}
    return replace(WEIGHTS, name=f"weights-{domain}", label=f"weights ({domain})", properties=properties)


def _fits(stage: Stage, method: RenderMethod, spp: int) -> bool:
    """Can the scene be rendered by a method at so many samples per pixel?"""
    try:
        integrator = stage.integrator(method)
        integrator.check(stage.scene, stage.sensor)
        integrator.check_samples(stage.sensor, spp)
        if integrator.blend:
            integrator.check_blend(stage.sensor, 1)
    except ValueError:
        return False
    return True


def pilot_step(sensor: mi.Sensor, methods: Sequence[RenderMethod], spp: int) -> int | None:
    """A pilot of these candidates has every k-th pixel of each row and column.

    None if the image is too small for a pilot.
    """
    width, height = (int(n) for n in sensor.film().crop_size())
    pixels = min(MOST_PIXELS, width * height * PART / images_of(methods, spp))
    step = math.ceil(math.sqrt(width * height / pixels))
    return None if (width // step) * (height // step) < FEWEST_PIXELS else step


def images_of(methods: Sequence[RenderMethod], spp: int) -> float:
    """The samples of each of the pilot's pixels, over those of a pixel of the image."""
    return sum(method.around / spp if method.around else IMAGES for method in methods)


def findings(stage: Stage, methods: Sequence[RenderMethod], spp: int, seeds: Sequence[int], step: int) -> list[Finding]:
    """Render the pilot by each method, as many images as there are seeds; what it finds out.

    Pixels that are not finite in one of the images are left out of all. The first method is ``owensobol`` if there are
    adaptive samples among them.
    """
    variances: list[Floats] = []
    with _every_pixel(stage.sensor, step):

        def plugin(method: RenderMethod) -> mi.Integrator:
            integrator = stage.integrator(method)
            integrator.part = 1 / step
            return integrator

        def variance(method: RenderMethod, samples: int, salt: int = 0) -> Floats:
            integrator = plugin(method)
            own = [pilot_seed(seed, salt) if salt else seed for seed in seeds]
            images = [integrator.image(stage.scene, stage.sensor, seed, samples)[0][..., :3] for seed in own]
            return np.asarray(np.var(np.array(images, np.float64), axis=0, ddof=1).mean(-1).ravel())

        for method in methods:
            if method.around:
                number = plugin(method).counts_apart(stage.scene, stage.sensor, seeds[0], spp).ravel()
                least = Sharing.at_least
                found = shared_variance(variance(OWEN_SOBOL, least, 1), least, variances[0], spp, number)
            else:
                found = variance(method, spp)
            variances.append(method.cost * found)
    finite = np.isfinite(variances).all(0)
    known = np.array(variances)[:, finite] if finite.any() else np.zeros((len(methods), 1))
    return [Finding(method, variance) for method, variance in zip(methods, known, strict=True)]


def shared_variance(few: Floats, least: int, even: Floats, spp: int, number: Integers) -> Floats:
    """The variance of pixels with `number` samples each.

    Parameters
    ----------
    few : ndarray, (pixels,)
        Their variances with `least` samples in all pixels.
    least : int
        Samples of a pixel at least.
    even : ndarray, (pixels,)
        Their variances with `spp` samples in all pixels.
    spp : int
        Samples of a pixel on average.
    number : ndarray of int, (pixels,)
        Samples of each pixel, `least` or more.

    Notes
    -----
    From `least` to `spp` samples the mean variance falls with a power of their number. The variance with n samples is
    reckoned by that power from the measured ones: from `few` where n is `least`, from `even` where n is `spp` or more,
    and in between from both.

    Examples
    --------
    >>> number = np.array([16, 16, 32, 128])
    >>> shared_variance(np.full(4, 4.0), 16, np.full(4, 1.0), 64, number)
    array([4. , 4. , 2. , 0.5])
    """
    finite = np.isfinite(few) & np.isfinite(even)
    before, after = (float(values[finite].sum()) for values in (few, even))
    power = math.log(before / after) / math.log(spp / least) if before > 0 and after > 0 else 1.0
    share = np.clip(np.log(number / least) / math.log(spp / least), 0, 1)
    by_few, by_even = few * (least / number) ** power, even * (spp / number) ** power
    return np.asarray((1 - share) * by_few + share * by_even)


def best(found: Sequence[Finding]) -> Finding:
    """The one to take: each must beat the best of those before it, by two standard errors, and OWN by one."""
    chosen = found[0]
    for finding in found:
        if finding.beats(chosen, OWN_MARGIN if finding.method is OWN else MARGIN):
            chosen = finding
    return chosen


def told(found: Sequence[Finding], chosen: Finding) -> str:
    """What to tell of the choice."""
    others = ", ".join(f"{f.method.label} {f.over(chosen)[0]:.2f}" for f in found if f is not chosen)
    line = f"{chosen.method.label}, chosen by a pilot of {len(chosen.variance)} pixels"
    return f"{line} (variance at equal time, relative to this choice: {others})" if others else line


@contextmanager
def _every_pixel(sensor: mi.Sensor, step: int) -> Iterator[None]:
    """The sensor with every k-th pixel of its film."""
    parameters = mi.traverse(sensor)
    names = ("film.size", "film.crop_size", "film.crop_offset")
    before = [mi.ScalarVector2u(parameters[name]) for name in names]

    def put(values: Sequence[object]) -> None:
        for name, value in zip(names, values, strict=True):
            parameters[name] = value
        parameters.update()

    put([n // step for n in before])
    try:
        yield
    finally:
        put(before)
