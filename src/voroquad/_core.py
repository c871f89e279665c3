"""The compiled core, in the version that suits this processor.

The environment variable VOROQUAD_PROCESSOR asks for another: "baseline", "v3" or "v4", the levels
of x86-64. All give the same bits. An installation from source has the baseline and the best level of
the machine that built it; a wheel has all.
"""

from __future__ import annotations

import importlib
import os
from importlib.util import find_spec
from types import ModuleType
from typing import Any


def installed_levels() -> list[str]:
    """The levels that this processor has and this installation was built with, the best first."""
    levels: list[str] = importlib.import_module("voroquad._core_baseline").processor_levels()
    return [level for level in levels if find_spec(f"voroquad._core_{level}")]


def _choose() -> ModuleType:
    levels = installed_levels()
    level = os.environ.get("VOROQUAD_PROCESSOR", levels[0])
    if level not in levels:
        raise ImportError(f"VOROQUAD_PROCESSOR is {level!r}; here are {', '.join(levels)}")
    return importlib.import_module(f"voroquad._core_{level}")


_chosen = _choose()


def __getattr__(name: str) -> Any:
    return getattr(_chosen, name)
