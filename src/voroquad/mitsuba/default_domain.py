"""The domain that is sampled if none is named."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import mitsuba as mi

from .loading import motion_of, traced

#: The name that asks for an automatic choice
AUTO = "auto"


def settle_domain(
    name: str, scene: mi.Scene, sensor: mi.Sensor, *, jitter: bool, channels: Sequence[str] = ()
) -> tuple[str, str]:
    """The domain of that name, or for "auto" the one that is chosen; what to say of the choice, if there was one."""
    if name != AUTO:
        return name, ""
    chosen, reason = choose_domain(scene, sensor, jitter=jitter, channels=channels)
    return chosen, f"voroquad: domain {chosen}, {reason}; --domain names another"


def tell(line: str, *, show: bool) -> None:
    """Print a line, if there is one and it is to be shown, on standard error."""
    if line and show:
        print(line, file=sys.stderr)


def known_domain(scene: mi.Scene, sensor: mi.Sensor, *, jitter: bool, channels: Sequence[str] = ()) -> str:
    """The domain that is chosen, or ``pixel`` where there is none to sample."""
    try:
        return choose_domain(scene, sensor, jitter=jitter, channels=channels)[0]
    except ValueError:
        return "pixel"


def choose_domain(scene: mi.Scene, sensor: mi.Sensor, *, jitter: bool, channels: Sequence[str] = ()) -> tuple[str, str]:
    """The domain that the scene has, and why it was chosen.

    Parameters
    ----------
    scene : mitsuba.Scene
        With its integrator.
    sensor : mitsuba.Sensor
        The one that takes the image.
    jitter : bool
        Is the pixel's area sampled?
    channels : sequence of str
        Extra channels, of `FIRST_HITS`: emitter samples at the first hit cannot be told apart beside them.

    Returns
    -------
    name, reason : str
        That of the scene's own ``reweighted`` if there is one. Else ``lens`` if the sensor has an aperture, ``time`` if
        its shutter is open for some time and something moves, ``light`` if an emitter has an area or is the
        environment and the scene's integrator takes one emitter sample at the first hit, else ``pixel``.

    Raises
    ------
    ValueError
        Only the pixels' area is left, and `jitter` is false.
    """
    from .lights import FirstHit  # exists once a variant is set, and differs between variants

    own = getattr(scene.integrator(), "domain", None)
    if own is not None:
        return own.name, "as the scene's integrator has it"
    if sensor.needs_aperture_sample():
        return "lens", "since the sensor has an aperture"
    if sensor.shutter_open_time() > 0 and (hasattr(sensor, "track") or motion_of(scene)):
        return "time", "since the camera or an object moves"
    if any(not mi.has_flag(emitter.flags(), mi.EmitterFlags.Delta) for emitter in scene.emitters()):
        try:
            FirstHit(traced(scene, channels))
        except ValueError:
            pass
        else:
            return "light", "since nothing moves, the sensor has no aperture and an emitter has an area"
    if not jitter:
        raise ValueError(
            "the scene has no aperture, no motion and no light with an area to sample; "
            "sample the pixels' area (--jitter), or name a domain"
        )
    return "pixel", "since there is no aperture, no motion and no light with an area to sample"
