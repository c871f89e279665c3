"""Ways to sample a domain of a scene, and how each looks in a plot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mitsuba as mi

from ..results.manifest import Line
from ..results.style import BLUE, GREEN, INK, MUTED, PURPLE, SKY, VERMILION
from .allocation import KINDS, NEIGHBOURS, Sharing
from .domains import find_domain
from .loading import make_integrator, motion_of, traced


@dataclass(frozen=True)
class Stage:
    """Settings that all methods share: scene, sensor, domain, and whether they sample the pixel's area or its
    centre."""

    scene: mi.Scene
    sensor: mi.Sensor
    domain: str
    jitter: bool
    channels: tuple[str, ...] = ()  # extra ones, of FIRST_HITS

    def properties(self, method: RenderMethod) -> dict[str, Any]:
        """The properties of a method's plug-in."""
        own: dict[str, Any] = {"jitter": self.jitter}
        if method.kind == "reweighted":
            own |= {"domain": method.domain(self.domain)} | ({"aovs": "lambda"} if method.blends else {})
        return own | method.properties

    def integrator(self, method: RenderMethod) -> mi.Integrator:
        """The plug-in of a method around the scene's own integrator."""
        moving = motion_of(self.scene) if method.kind == "reweighted" else {}
        return make_integrator(method.kind, traced(self.scene, self.channels), **self.properties(method), **moving)


@dataclass(frozen=True)
class RenderMethod:
    """A way to sample the domain; all else is the same for all methods."""

    name: str
    label: str
    kind: str  # plug-in around the nested integrator
    properties: dict[str, Any]
    line: Line
    joint: bool = False  # with the pixel's area in one set
    cost: float = 1.0  # of a sample, over one of the nested integrator alone
    around: int = 0  # samples at and around each pixel that a pilot takes in place of images

    @property
    def blends(self) -> bool:
        """Does it blend, that is, use the weights only as far as they help?"""
        return self.properties.get("blend") == "auto"

    def domain(self, domain: str) -> str:
        """What its sets sample."""
        return f"pixel+{domain}" if self.joint else domain

    def check(self, stage: Stage, spp: int) -> None:
        """ValueError if the scene lacks the domain, or the sampler cannot make sets of this size."""
        integrator = stage.integrator(self)
        if self.kind == "reweighted":
            integrator.check(stage.scene, stage.sensor)
            integrator.check_samples(stage.sensor, spp)
            integrator.check_blend(stage.sensor, 1)

    def makes(self, spp: int) -> bool:
        """Whether a sampler makes this number of samples, or rounds it; that of the scene is not asked."""
        if "adaptive" in self.properties:
            return spp > Sharing.at_least
        if self.kind == "reweighted" or self is OWN:
            return True
        kind = self.properties["scene_sampler"]["type"]
        # The orthogonal sampler warns where it rounds
        level = mi.logger().log_level()
        mi.set_log_level(mi.LogLevel.Error)
        try:
            return int(mi.load_dict({"type": kind, "sample_count": spp}).sample_count()) == spp
        finally:
            mi.set_log_level(level)


def _sets(design: str, color: str, label: str | None = None, **rule: Any) -> list[RenderMethod]:
    """The sets of a design: with equal weights, with those of a rule, and with as much of those as helps.

    Without a rule it is the plug-in's default, which is unbiased.
    """
    label = label or design
    looks = {"": Line(color, "dashed"), " + w": Line(color, marker="circle"), " + blend": Line(color, marker="diamond")}
    suffixes = {"": "", " + w": "-w", " + blend": "-blend"}
    return [
        RenderMethod(
            design + suffixes[kind],
            label + kind,
            "reweighted",
            {"sampler": design, "weighted": kind != "", "blend": "auto" if kind == " + blend" else "off"} | rule,
            line,
        )
        for kind, line in looks.items()
    ]


def _of_mitsuba(sampler: str, color: str, dash: str) -> RenderMethod:
    return RenderMethod(
        f"mitsuba-{sampler}", f"Mitsuba {sampler}", "plain", {"scene_sampler": {"type": sampler}}, Line(color, dash)
    )


UNIFORM, UNIFORM_W, _ = _sets("uniform", BLUE)
STRATIFIED = _sets("stratified", VERMILION)
#: No unbiased rule weighs single sets of Sobol' points: their cells, biased at the border of the domain
SOBOL = _sets("sobol", GREEN, "Sobol'", debias="none")
ZERO_TWO = _sets("zero-two", SKY)[0]
HALTON = _sets("halton", PURPLE, "Halton")[0]
JOINT = RenderMethod(
    "sobol-joint", "Sobol' with the pixel", "reweighted", {"sampler": "sobol", "weighted": False, "blend": "off"},
    Line(GREEN, "dotted"), joint=True,
)  # fmt: skip
OF_MITSUBA = (
    _of_mitsuba("independent", MUTED, "dashed"),
    _of_mitsuba("stratified", MUTED, "dotted"),
    _of_mitsuba("multijitter", INK, "dashed"),
    _of_mitsuba("orthogonal", MUTED, "solid"),
    _of_mitsuba("ldsampler", INK, "dotted"),
)
#: The sampler that `plain` tells the size of the image
OWEN_SOBOL = RenderMethod(
    "owensobol", "owensobol", "plain", {"scene_sampler": {"type": "owensobol"}}, Line(PURPLE, "solid")
)
#: What a render chooses from besides, see `candidates`
OWN = RenderMethod("own", "the scene's own sampler", "plain", {}, Line(INK, "solid"))
WEIGHTS = RenderMethod(
    "weights", "stratified + blend, owensobol", "reweighted",
    {"sampler": "stratified", "weighted": True, "blend": "auto"} | OWEN_SOBOL.properties,
    Line(VERMILION, "dotted", "diamond"),
)  # fmt: skip
#: Its cost is the geometric mean over the scenes of benchmarks/sampler_time.py: noise is estimated, and samples are
#: shared out and traced in two wavefronts
ADAPTIVE = RenderMethod(
    "adaptive", "adaptive", "plain", {"adaptive": KINDS[0]}, Line(SKY, "solid"), cost=1.19,
    around=(len(NEIGHBOURS) + 2) * Sharing.at_least,
)  # fmt: skip


def methods_for(stage: Stage, spp: Sequence[int]) -> list[RenderMethod]:
    """The methods that a scene and a domain have; those of Mitsuba's samplers only where they make one of the spp."""
    domain = find_domain(stage.domain)
    methods = [UNIFORM, UNIFORM_W, *STRATIFIED, ZERO_TWO, *SOBOL, HALTON]
    if domain.dimension > 2:
        methods.remove(ZERO_TWO)
    if domain.dimension > 3:
        methods = [method for method in methods if not method.properties["weighted"]]
    moves = bool(motion_of(stage.scene))
    if stage.jitter and "pixel" not in stage.domain.split("+") and not moves:
        methods.append(JOINT)
    # Mitsuba's samplers draw times for its sensors; what moves in slices has the times of its sets
    own = [] if moves else [method for method in (OWEN_SOBOL, *OF_MITSUBA) if any(method.makes(n) for n in spp)]
    return methods + own
