"""Which of a few settings has the least variance per second in a scene: a pilot renders each of them, small.

The pilot's pixels are some of the image's, evenly spread, each with as many samples as in the image. For adaptive
sampling the pilot measures the noise around each of them too, in its neighbours in the image. Its samples are not in
the image, and it does not look at the clock: a setting's cost is a constant. So the choice is the same on every
machine, and leaves the image unbiased.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import mitsuba as mi
import numpy as np

from .blend import Floats
from .loading import motion_of
from .methods import ADAPTIVE, OF_MITSUBA, OWEN_SOBOL, OWN, WEIGHTS, RenderMethod, Stage

#: The pilot's samples over those of the image or of its first round, at most
PART = 1 / 8
#: Pixels of the pilot: with fewer it tells too little, with more it tells no more
FEWEST_PIXELS, MOST_PIXELS = 64, 4096
#: Images of each candidate, whose spread is its variance
IMAGES = 2
#: Standard errors by which a candidate must beat the one before it
MARGIN = 2.0


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
    pixels = min(MOST_PIXELS, width * height * PART / (IMAGES * images_of(methods, spp)))
    step = math.ceil(math.sqrt(width * height / pixels))
    return None if (width // step) * (height // step) < FEWEST_PIXELS else step


def images_of(methods: Sequence[RenderMethod], spp: int) -> float:
    """The samples that one image of each candidate takes in the pilot, over those of one image."""
    return sum(1 + method.around / spp for method in methods)


def findings(stage: Stage, methods: Sequence[RenderMethod], spp: int, seeds: Sequence[int], step: int) -> list[Finding]:
    """Render the pilot by each method, as many images as there are seeds; what it finds out.

    Pixels that are not finite in one of the images are left out of all.
    """
    variances = []
    with _every_pixel(stage.sensor, step):
        for method in methods:
            integrator = stage.integrator(method)
            integrator.part = 1 / step
            images = [integrator.image(stage.scene, stage.sensor, seed, spp)[0][..., :3] for seed in seeds]
            variances.append(method.cost * np.var(np.array(images, np.float64), axis=0, ddof=1).mean(-1).ravel())
    finite = np.isfinite(variances).all(0)
    known = np.array(variances)[:, finite] if finite.any() else np.zeros((len(methods), 1))
    return [Finding(method, variance) for method, variance in zip(methods, known, strict=True)]


def best(found: Sequence[Finding]) -> Finding:
    """The one to take: each must beat the best of those before it by two standard errors; none that OWN beats."""
    chosen = found[0]
    for finding in found:
        ratio, error = finding.over(chosen)
        margin = 0.0 if finding.method is OWN else MARGIN * error
        if ratio < 1 - margin:
            chosen = finding
    return chosen


def told(found: Sequence[Finding], chosen: Finding) -> str:
    """What to tell of the choice."""
    others = ", ".join(f"{f.method.label} {f.over(chosen)[0]:.2f}" for f in found if f is not chosen)
    line = f"{chosen.method.label}, by a pilot of {len(chosen.variance)} pixels"
    return f"{line} (variance per second over its own: {others})" if others else line


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
