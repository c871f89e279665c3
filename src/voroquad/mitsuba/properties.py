"""The properties of the plug-ins, checked."""

from __future__ import annotations

from typing import TypeVar

import mitsuba as mi
from mitsuba.python.ad.integrators.common import ADIntegrator, RBIntegrator

from .tracing import name_of

#: Mitsuba's integrators that follow given camera rays
FOLLOWING = (
    "path", "direct", "depth", "volpath", "volpathmis", "aov", "moment", "stokes", "prb", "prb_basic", "prbvolpath",
)  # fmt: skip
_KINDS = {bool: "true or false", int: "a whole number", str: "a name"}
Value = TypeVar("Value", bool, int, str)


def read_property(props: mi.Properties, name: str, default: Value) -> Value:
    """A property, of the type of its default."""
    value = props.get(name, default)
    if type(value) is not type(default):
        raise ValueError(f"{name} must be {_KINDS[type(default)]}, got {value!r}")
    return value


def nested_objects(props: mi.Properties) -> tuple[mi.Integrator, mi.Sampler | None]:
    """The nested integrator, which must be able to follow given camera rays, and the nested sampler if any."""
    nested = [value for _, value in props.objects()]
    name = props.plugin_name()
    integrators = [value for value in nested if isinstance(value, mi.Integrator)]
    samplers = [value for value in nested if isinstance(value, mi.Sampler)]
    if len(integrators) != 1 or len(samplers) > 1 or len(nested) != len(integrators) + len(samplers):
        raise ValueError(f"'{name}' needs one nested integrator (and at most one sampler), got {len(nested)} objects")
    integrator = integrators[0]
    follows_rays = isinstance(integrator, mi.SamplingIntegrator) and (
        not isinstance(integrator, ADIntegrator) or isinstance(integrator, RBIntegrator)
    )
    if not follows_rays:
        raise ValueError(
            f"'{name}' cannot wrap {name_of(integrator)}: it draws its own rays; "
            f"nest one that follows given ones: {', '.join(FOLLOWING)}"
        )
    return integrator, samplers[0] if samplers else None
