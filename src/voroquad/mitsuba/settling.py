"""What a render is done by: the settings that its user names, or those that a pilot finds."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import mitsuba as mi

from .allocation import Sharing
from .bands import Shot
from .default_domain import AUTO, known_domain, settle_domain
from .loading import make_integrator, motion_of, own_integrator
from .methods import ADAPTIVE, OWEN_SOBOL, RenderMethod, Stage
from .pilot import IMAGES, best, candidates, findings, pilot_step, told
from .rounds import pilot_seed

#: The design of sets where something that only they have is named, and no design
DESIGN = "stratified"


@dataclass(frozen=True)
class Wanted:
    """How samples are to be drawn and weighed, see `voroquad.mitsuba.render.render`."""

    domain: str = AUTO
    sampler: str = AUTO
    order: int | None = None
    debias: str = "auto"
    weighted: bool = True
    blend: str = "auto"
    jitter: bool = True
    sharing: Sharing | None = None

    @property
    def open(self) -> bool:
        """Is all of it left to a pilot?"""
        return self == Wanted(jitter=self.jitter)

    @property
    def without_sets(self) -> bool:
        """Is something named that has no sets of samples?"""
        return self.sharing is not None or self.sampler == OWEN_SOBOL.name

    def check_without_sets(self, scene: mi.Scene) -> None:
        """Raise ValueError for what needs sets of samples: settings of theirs, and moving objects."""
        known: dict[str, tuple[Any, ...]] = {"domain": (AUTO,), "order": (None,), "debias": ("auto",)}
        known["sampler"] = (AUTO, OWEN_SOBOL.name)
        if named := [name for name, left in known.items() if getattr(self, name) not in left]:
            raise ValueError(
                f"sampler={OWEN_SOBOL.name!r} has no sets to apply {', '.join(named)} to; leave that out, "
                "or name a design of sets, such as 'stratified'"
            )
        if motion_of(scene):
            raise ValueError(
                f"objects move at the times of sets, and sampler={OWEN_SOBOL.name!r} has none; "
                "name a design, such as 'stratified'"
            )


@dataclass(frozen=True)
class Settled:
    """What is rendered.

    Attributes
    ----------
    shot : Shot
        With plug-in and properties.
    key : dict
        The settings that the state of a render belongs to.
    line : str
        What to tell of a choice; empty if all was named.
    """

    shot: Shot
    key: dict[str, Any]
    line: str = ""


def settle(wanted: Wanted, shot: Shot, spp: int, seed: int) -> Settled:
    """What a render of a shot is done by.

    Parameters
    ----------
    wanted : Wanted
        What is named.
    shot : Shot
        Of the scene, whatever its plug-in.
    spp : int
        Samples per pixel of a round.
    seed : int
        Of the render.

    Raises
    ------
    ValueError
        Settings that do not go together, or with the scene.
    """
    scene, _ = shot.stage()
    if wanted.without_sets:
        wanted.check_without_sets(scene)
        return _without_sets(wanted, shot, seed)
    if wanted.open and not motion_of(scene):
        return _chosen(wanted, shot, spp, seed)
    return _with_sets(wanted, shot)


def _without_sets(wanted: Wanted, shot: Shot, seed: int, line: str = "") -> Settled:
    """By ``owensobol``, which may share samples out."""
    sharing = None if wanted.sharing is None else asdict(wanted.sharing)
    properties = OWEN_SOBOL.properties | {"jitter": wanted.jitter}
    if sharing is not None:
        properties |= sharing | {"pilot_seed": seed, "aovs": "samples"}
    key = asdict(wanted) | {"domain": None, "sampler": OWEN_SOBOL.name, "sharing": sharing}
    return Settled(replace(shot, kind=OWEN_SOBOL.kind, properties=properties), key, line)


def _with_sets(wanted: Wanted, shot: Shot) -> Settled:
    """By weighted sets of the domain that is named or that the scene has."""
    key = asdict(wanted)
    del key["sharing"]
    key["domain"], line = settle_domain(wanted.domain, *shot.stage(), jitter=wanted.jitter, channels=shot.channels)
    key["sampler"] = DESIGN if wanted.sampler == AUTO else wanted.sampler
    properties = {name: value for name, value in key.items() if value is not None}
    if wanted.open:
        properties |= OWEN_SOBOL.properties  # for all else
    return Settled(replace(shot, kind="reweighted", properties=properties), key, line)


def _chosen(wanted: Wanted, shot: Shot, spp: int, seed: int) -> Settled:
    """By what a pilot finds best."""
    domain = known_domain(*shot.stage(), jitter=wanted.jitter, channels=shot.channels)
    stage = Stage(*shot.stage(), domain, wanted.jitter, shot.channels)
    make_integrator("plain", own_integrator(stage.scene)).check(stage.scene, stage.sensor)
    method, reason = choose(stage, spp, seed)
    line = f"voroquad: {reason}; --sampler names another"
    if method in (OWEN_SOBOL, ADAPTIVE):
        sharing = Sharing() if method is ADAPTIVE else None
        return _without_sets(replace(wanted, sharing=sharing), shot, seed, line)
    properties = stage.properties(method)
    properties.pop("aovs", None)
    key = {"domain": properties.get("domain"), "sampler": method.name, "jitter": wanted.jitter}
    return Settled(replace(shot, kind=method.kind, properties=properties), key, line)


def choose(stage: Stage, spp: int, seed: int) -> tuple[RenderMethod, str]:
    """The candidate that a pilot finds best at so many samples per pixel, and what to tell of it."""
    methods = candidates(stage, [spp])
    step = pilot_step(stage.sensor, methods, spp)
    if step is None:
        return methods[0], f"{methods[0].label}, as the image is too small for a pilot"
    found = findings(stage, methods, spp, [pilot_seed(seed, k) for k in range(IMAGES)], step)
    finding = best(found)
    return finding.method, told(found, finding)
