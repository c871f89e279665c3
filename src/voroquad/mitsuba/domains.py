"""Domains: the coordinates of primary sample space that the sets sample, a class for each, and joint ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from .._support.checks import one_of


@dataclass
class CameraSample:
    """A point of primary sample space for each ray of a wavefront, each coordinate uniform in [0, 1)."""

    pixel: Any  # mi.Point2f, within the pixel
    lens: Any  # mi.Point2f
    time: Any  # mi.Float, between shutter opening and closing
    wavelength: Any  # mi.Float
    light: Any = None  # mi.Point2f, of the emitter sample at the first hit; None: the nested integrator's own
    lobe: Any = None  # mi.Float, which part of the BSDF the BSDF sample at the first hit takes; None likewise
    direction: Any = None  # mi.Point2f, of that BSDF sample's direction; None likewise
    factor: Any = None  # mi.Float, N·w of the set's sample; None where no set is weighed
    noise: Any = None  # mi.Float, N·c of its noise contrast (voroquad.mitsuba.contrasts); None likewise


class Domain:
    """Coordinates of the camera sample that come from the sets.

    Attributes
    ----------
    name : str
        What the property ``domain`` calls it.
    dimension : int
        Number of coordinates.
    periodic : bool
        Do they lie on a circle? Then their cells have no border, and no bias.
    """

    name: str
    dimension: int
    periodic = False

    def check(self, scene: mi.Scene, sensor: mi.Sensor) -> None:
        """Raise ValueError if there is nothing to sample."""

    def place(self, drawn: CameraSample, u: list[mi.Float]) -> None:
        """Put the table's coordinates u into the camera sample."""
        raise NotImplementedError

    def coordinates(self, drawn: CameraSample) -> list[mi.Float]:
        """Its own coordinates u of the camera sample."""
        raise NotImplementedError


class Pixel(Domain):
    """The point of the pixel's area, d = 2."""

    name, dimension = "pixel", 2

    def place(self, drawn: CameraSample, u: list[mi.Float]) -> None:
        drawn.pixel = mi.Point2f(u)

    def coordinates(self, drawn: CameraSample) -> list[mi.Float]:
        return [*drawn.pixel]


class Lens(Domain):
    """The point of the aperture, d = 2."""

    name, dimension = "lens", 2

    def check(self, scene: mi.Scene, sensor: mi.Sensor) -> None:
        if not sensor.needs_aperture_sample():
            raise ValueError(
                f"domain 'lens' needs a sensor with a lens, and the scene's '{sensor.class_name()}' has none; "
                "use a 'thinlens' sensor with aperture_radius > 0"
            )

    def place(self, drawn: CameraSample, u: list[mi.Float]) -> None:
        drawn.lens = mi.Point2f(u)

    def coordinates(self, drawn: CameraSample) -> list[mi.Float]:
        return [*drawn.lens]


class Time(Domain):
    """The time between opening and closing of the shutter, d = 1."""

    name, dimension = "time", 1

    def check(self, scene: mi.Scene, sensor: mi.Sensor) -> None:
        if not sensor.shutter_open_time() > 0:
            raise ValueError(
                f"domain 'time' needs an open shutter, and that of the scene's '{sensor.class_name()}' opens for no "
                "time; set its shutter_open and shutter_close > shutter_open"
            )

    def place(self, drawn: CameraSample, u: list[mi.Float]) -> None:
        (drawn.time,) = u

    def coordinates(self, drawn: CameraSample) -> list[mi.Float]:
        return [drawn.time]


class Wavelength(Domain):
    """The wavelengths of a path, d = 1.

    A path carries n wavelengths, from the coordinates u, u + 1/n, … (mod 1): what it brings is a function of u of
    period 1/n. The sets sample one period, v = n u, as a circle.
    """

    name, dimension, periodic = "wavelength", 1, True

    def check(self, scene: mi.Scene, sensor: mi.Sensor) -> None:
        if not mi.is_spectral:
            raise ValueError(
                f"domain 'wavelength' needs a spectral variant, and {mi.variant()} has no wavelengths; "
                "call mitsuba.set_variant('llvm_ad_spectral') before loading the scene"
            )

    def place(self, drawn: CameraSample, u: list[mi.Float]) -> None:
        drawn.wavelength = within_period(u[0])

    def coordinates(self, drawn: CameraSample) -> list[mi.Float]:
        periods = drawn.wavelength * dr.size_v(mi.Spectrum)
        return [periods - dr.floor(periods)]


def within_period(v: mi.Float) -> mi.Float:
    """The coordinate u of wavelengths, within one of its periods, of v in [0, 1)."""
    return v / dr.size_v(mi.Spectrum)  # of 4: exact, hence below 1/4 as v is below 1


class Light(Domain):
    """The emitter sample at the first hit: which emitter, and the point on it, d = 2."""

    name, dimension = "light", 2

    def check(self, scene: mi.Scene, sensor: mi.Sensor) -> None:
        if not scene.emitters():
            raise ValueError("domain 'light' needs an emitter, and the scene has none; add one, such as an area light")

    def place(self, drawn: CameraSample, u: list[mi.Float]) -> None:
        drawn.light = mi.Point2f(u)

    def coordinates(self, drawn: CameraSample) -> list[mi.Float]:
        return [*drawn.light]


class Direction(Domain):
    """The BSDF sample at the first hit: the direction in which the path goes on, d = 2."""

    name, dimension = "direction", 2

    def place(self, drawn: CameraSample, u: list[mi.Float]) -> None:
        drawn.direction = mi.Point2f(u)

    def coordinates(self, drawn: CameraSample) -> list[mi.Float]:
        return [*drawn.direction]


class Joint(Domain):
    """Several domains sampled by one set, d the sum of theirs."""

    def __init__(self, parts: list[Domain]) -> None:
        self.parts = parts
        self.name = "+".join(part.name for part in parts)
        self.dimension = sum(part.dimension for part in parts)

    def check(self, scene: mi.Scene, sensor: mi.Sensor) -> None:
        for part in self.parts:
            part.check(scene, sensor)

    def place(self, drawn: CameraSample, u: list[mi.Float]) -> None:
        for part in self.parts:
            part.place(drawn, u[: part.dimension])
            u = u[part.dimension :]

    def coordinates(self, drawn: CameraSample) -> list[mi.Float]:
        return [u for part in self.parts for u in part.coordinates(drawn)]


DOMAINS: dict[str, type[Domain]] = {domain.name: domain for domain in (Lens, Time, Wavelength, Light, Direction, Pixel)}


#: Those that are samples at the first hit, which the plug-in follows camera rays to itself
AT_FIRST_HIT = (Light.name, Direction.name)


def at_first_hit(name: str) -> list[str]:
    """The parts of a domain's name that are samples at the first hit."""
    return [part for part in name.split("+") if part in AT_FIRST_HIT]


def find_domain(name: str) -> Domain:
    """The domain of a name such as "lens" or "pixel+time"; ValueError if there is none."""
    names = [one_of("domain", part, DOMAINS) for part in name.split("+")]
    if len(set(names)) < len(names):
        raise ValueError(f"domain={name!r} names a part twice; drop one")
    parts = [DOMAINS[part]() for part in names]
    return parts[0] if len(parts) == 1 else Joint(parts)
