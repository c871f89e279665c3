"""Weighted sample sets in Mitsuba 3: importing this package registers its plug-ins.

``reweighted`` renders through a nested integrator with camera samples from weighted sets, ``plain`` is the
same without the sets, ``moving`` is a camera that moves while the shutter is open, ``owensobol`` a sampler for every
integrator. They exist in the current variant and in every later one:

>>> import mitsuba as mi, voroquad.mitsuba
>>> mi.set_variant("llvm_ad_rgb")
>>> integrator = mi.load_dict({"type": "reweighted", "domain": "lens", "nested": {"type": "direct"}})
"""

from __future__ import annotations

import importlib
import sys

from .._support.extras import install_hint

try:
    import drjit as dr
    import mitsuba as mi
except ImportError as error:
    raise ImportError(f"rendering needs Mitsuba 3 ({error}); {install_hint('render')}") from None

OLDEST_LLVM = 17
#: Modules of plug-ins, whose base classes are those of a variant
_PLUGINS = tuple(
    f"{__name__}.{name}"
    for name in (
        "tracing",
        "properties",
        "owen_sobol",
        "plain",
        "adaptive",
        "lights",
        "integrator",
        "slices",
        "sensors",
    )
)


def check_llvm() -> None:
    """Raise ImportError if Mitsuba's llvm variants cannot run: no libLLVM, or one that makes Dr.Jit abort."""
    version = dr.detail.llvm_version()[0]
    if dr.has_backend(dr.JitBackend.LLVM) and version >= OLDEST_LLVM:
        return
    found = f"Dr.Jit found version {version}" if version > 0 else "Dr.Jit found none that it can use"
    raise ImportError(
        f"Mitsuba's llvm variants need libLLVM {OLDEST_LLVM} or newer and {found}; install it with "
        "'apt-get install libllvm19' (macOS: 'brew install llvm') or set DRJIT_LIBLLVM_PATH to the library"
    )


def _refuse(properties: mi.Properties) -> None:
    """In place of a plug-in where nothing is compiled."""
    name = properties.plugin_name()
    raise RuntimeError(f"{name} needs a variant that compiles; call mitsuba.set_variant('llvm_ad_rgb') before loading")


def _register(previous: str | None, variant: str | None) -> None:
    """Make the plug-ins of a variant: its base classes are its own, hence the reload (as Mitsuba's own do)."""
    if variant is None:
        return
    if variant.startswith("scalar"):
        for integrator in ("plain", "reweighted"):
            mi.register_integrator(integrator, _refuse)
        mi.register_sensor("moving", _refuse)
        mi.register_sampler("owensobol", _refuse)
        return
    if variant.startswith("llvm"):
        check_llvm()
    for name in _PLUGINS:
        if name in sys.modules:
            importlib.reload(sys.modules[name])
        else:
            importlib.import_module(name)


if not dr.has_backend(dr.JitBackend.CUDA):
    check_llvm()
mi.detail.add_variant_callback(_register)
_register(None, mi.variant())
