"""What a nested integrator makes of given camera rays: their radiance, and extra channels as Mitsuba orders them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
from mitsuba.python.ad.integrators.common import ADIntegrator

from .domains import CameraSample

#: Values that `sample` gives of the image of each integrator inside ``aov``: red, green, blue and alpha
_OF_AN_IMAGE = 4


@dataclass
class CameraRays:
    """The camera rays of a wavefront: the rays of a pixel are consecutive; pixels go row by row."""

    sensor: mi.Sensor
    ray: Any  # mi.RayDifferential3f
    weight: Any  # mi.Spectrum
    index: Any  # mi.UInt32, pixel · spp + (sample of the pixel)
    corner: Any  # mi.Point2i, of the pixel on the film
    drawn: CameraSample

    @property
    def position(self) -> mi.Point2f:
        """Where they start on the film."""
        return mi.Point2f(self.corner) + self.drawn.pixel


@dataclass(frozen=True)
class Extra:
    """A value that a ray brings to an extra channel.

    Attributes
    ----------
    name : str
        Of the channel.
    index : int
        Of the value among those that `sample` gives.
    image : str
        The name of the image whose colour or alpha it is, where `aov` holds several integrators; else empty.
    """

    name: str
    index: int
    image: str = ""


class Tracer:
    """Follows camera rays by an integrator of Mitsuba's.

    Parameters
    ----------
    integrator : mitsuba.SamplingIntegrator
        Any that follows given rays.

    Attributes
    ----------
    has_colours : bool
        Does it give an image of its own? ``aov`` with no integrator inside gives extra channels only.

    Notes
    -----
    The channels are those of the image that Mitsuba renders by the integrator alone, in the same order. ``aov`` gives
    the images of the integrators inside it, each with that one's extra channels, then its own; ``moment`` gives the
    image, then its own channels. The first image's colours are what the weights multiply.
    """

    has_colours = True

    def __init__(self, integrator: mi.Integrator) -> None:
        self.integrator = integrator

    def extras(self, *, alpha: bool) -> list[Extra]:
        """The extra channels of a film with or without alpha."""
        return [Extra(name, k) for k, name in enumerate(self.integrator.aov_names())]

    def follow(
        self, scene: mi.Scene, sampler: mi.Sampler, rays: CameraRays, active: mi.Bool
    ) -> tuple[mi.Spectrum, mi.Bool, list[mi.Float]]:
        """Radiance along rays, whether they hit something, and all values that `Extra.index` counts."""
        radiance, valid, values = self.integrator.sample(scene, sampler, rays.ray, None, active)
        return radiance, valid, list(values)


class AdjointTracer(Tracer):
    """Follows rays by an integrator that computes derivatives by radiative backpropagation (``prb`` and its kin)."""

    def follow(
        self, scene: mi.Scene, sampler: mi.Sampler, rays: CameraRays, active: mi.Bool
    ) -> tuple[mi.Spectrum, mi.Bool, list[mi.Float]]:
        """Radiance along rays, whether they hit something, and the extra channels."""
        radiance, valid, values, _ = self.integrator.sample(
            mode=dr.ADMode.Primal,
            scene=scene,
            sampler=sampler,
            ray=rays.ray,
            depth=mi.UInt32(0),
            δL=None,
            δaovs=None,
            state_in=None,
            active=active,
        )
        return radiance, valid, list(values)


class ChannelTracer(Tracer):
    """Follows rays by ``aov``: the images of the integrators inside it, then the channels that it adds.

    `sample` gives the colours and alpha of each integrator inside, then the channels of each of them, then those that
    `aov` adds. Mitsuba's image has the images of the integrators, rendered alone, and then all of these channels but
    colours and alpha: those of ``moment`` inside ``aov``, say, come twice.
    """

    def __init__(self, integrator: mi.Integrator) -> None:
        super().__init__(integrator)
        self._inside = [tracer_of(child) for child in children(integrator)]
        self.has_colours = bool(self._inside) and self._inside[0].has_colours

    def extras(self, *, alpha: bool) -> list[Extra]:
        """The extra channels of a film with or without alpha."""
        names = list(self.integrator.aov_names())
        images: list[Extra] = []
        first = start = _OF_AN_IMAGE * len(self._inside)  # where the channels of the integrators begin
        for number, child in enumerate(self._inside):
            colours = range(_OF_AN_IMAGE * number, _OF_AN_IMAGE * (number + 1) - (not alpha))
            if number > 0 and child.has_colours:
                images += [Extra(names[k], k, names[k].rpartition(".")[0]) for k in colours]
            images += [Extra(e.name, start + e.index, e.image) for e in child.extras(alpha=alpha)]
            start += len(child.integrator.aov_names())
        return _with_unique_names([*images, *(Extra(names[k], k) for k in range(first, len(names)))])


class StokesTracer(Tracer):
    """Follows rays by ``stokes``: the Stokes parameters of what the integrator inside it finds.

    Mitsuba's ``stokes`` follows rays that it has drawn itself only. So the integrator inside follows them here, and
    the light's frame of reference is turned until its axes are those of the image.
    """

    def __init__(self, integrator: mi.Integrator) -> None:
        super().__init__(integrator)
        (child,) = children(integrator)
        self._inside = tracer_of(child)

    def follow(
        self, scene: mi.Scene, sampler: mi.Sampler, rays: CameraRays, active: mi.Bool
    ) -> tuple[mi.Spectrum, mi.Bool, list[mi.Float]]:
        """Radiance along rays, whether they hit something, and the Stokes parameters, red, green and blue of each."""
        radiance, valid, values = self._inside.follow(scene, sampler, rays, active)
        light = -rays.ray.d
        up = rays.sensor.world_transform() @ mi.Vector3f(0, 1, 0)
        across = dr.normalize(dr.cross(up, light))
        turned = mi.mueller.rotate_stokes_basis_m(light, mi.mueller.stokes_basis(light), across) @ radiance
        seen = turned @ rays.weight
        stokes = [value for k in range(4) for value in colour_of(seen[k, 0], rays.ray.wavelengths)]
        return radiance, valid, [*stokes, *values]


def tracer_of(integrator: mi.Integrator) -> Tracer:
    """What follows rays by an integrator."""
    if isinstance(integrator, ADIntegrator):
        return AdjointTracer(integrator)
    kind = {"AOVIntegrator": ChannelTracer, "StokesIntegrator": StokesTracer}.get(name_of(integrator), Tracer)
    return kind(integrator)


def name_of(integrator: mi.Integrator) -> str:
    """Name of an integrator's class: those written in Python all have one `class_name`, their C++ base's."""
    python = type(integrator)
    return str(integrator.class_name()) if python.__module__ == mi.Integrator.__module__ else python.__name__


def children(integrator: mi.Integrator) -> list[mi.Integrator]:
    """The integrators inside an integrator."""
    found: list[mi.Integrator] = []

    class Collect(mi.TraversalCallback):
        def put(self, name: str, value: Any, flags: Any) -> None:
            if isinstance(value, mi.Integrator):
                found.append(value)

    integrator.traverse(Collect())
    return found


def check_differentiable(integrator: mi.Integrator) -> None:
    """Raise NotImplementedError for an integrator through which no derivatives flow: ``aov``, or one that holds it."""
    if name_of(integrator) == "AOVIntegrator":
        raise NotImplementedError("derivatives of 'aov' are not supported; nest the integrator inside it by itself")
    for child in children(integrator):
        check_differentiable(child)


def colour(radiance: mi.Spectrum, wavelengths: Any) -> mi.Color3f:
    """Linear sRGB of radiance along rays."""
    return colour_of(mi.unpolarized_spectrum(radiance) if mi.is_polarized else radiance, wavelengths)


def colour_of(spectrum: Any, wavelengths: Any) -> mi.Color3f:
    """Linear sRGB of an unpolarized spectrum."""
    if mi.is_spectral:
        return mi.spectrum_to_srgb(spectrum, wavelengths)
    return mi.Color3f(spectrum.x) if mi.is_monochromatic else mi.Color3f(spectrum)


def _with_unique_names(extras: list[Extra]) -> list[Extra]:
    """The same channels; a name that is taken already is followed by a number."""
    counts: dict[str, int] = {}
    unique = []
    for extra in extras:
        counts[extra.name] = count = counts.get(extra.name, 0) + 1
        unique.append(Extra(extra.name if count == 1 else f"{extra.name}.{count}", extra.index, extra.image))
    return unique
