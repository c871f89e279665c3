"""The compiled core, in the version that suits this processor.

The environment variable VOROQUAD_PROCESSOR asks for another: "baseline", "v3" or "v4", the levels
of x86-64. All give the same bits. What is built from a checkout has the baseline and the best level of the
machine that built it, unless VOROQUAD_LEVELS is all; released wheels and what is built from an sdist have all.
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Sequence
from importlib.util import find_spec
from types import ModuleType
from typing import Any

#: The remedy where the level that is needed was not built
BUILD_ALL = "pip install -C cmake.define.VOROQUAD_LEVELS=all PATH, with the path of voroquad's checkout or sdist"


def processor_levels() -> list[str]:
    """The levels that this processor has, the best first."""
    levels: list[str] = importlib.import_module("voroquad._core_levels").processor_levels()
    return levels


def installed_levels() -> list[str]:
    """The levels that this processor has and this installation was built with, the best first."""
    return [level for level in processor_levels() if find_spec(f"voroquad._core_{level}")]


def choose_level(levels: Sequence[str], asked: str | None) -> str:
    """The level asked for, else the best of those that are installed and that this processor has."""
    if asked is not None and asked not in levels:
        raise ImportError(
            f"VOROQUAD_PROCESSOR is {asked!r}; here are {', '.join(levels)}: take one of these, or unset it. "
            f"For all that this processor has: {BUILD_ALL}"
        )
    return asked or levels[0]


def _load(level: str) -> ModuleType:
    return importlib.import_module(f"voroquad._core_{level}")


_chosen = _load(choose_level(installed_levels(), os.environ.get("VOROQUAD_PROCESSOR")))


def __getattr__(name: str) -> Any:
    return getattr(_chosen, name)
