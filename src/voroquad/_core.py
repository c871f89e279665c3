"""The compiled core, in the version that suits this processor.

The environment variable VOROQUAD_PROCESSOR asks for another: "baseline", "v3" or "v4", the levels
of x86-64. All give the same bits.
"""

from __future__ import annotations

import importlib
import os
from types import ModuleType
from typing import Any


def _choose() -> ModuleType:
    baseline = importlib.import_module("voroquad._core_baseline")
    levels = baseline.processor_levels()
    level = os.environ.get("VOROQUAD_PROCESSOR", levels[0])
    if level not in levels:
        raise ImportError(f"VOROQUAD_PROCESSOR is {level!r}; this processor has {', '.join(levels)}")
    return importlib.import_module(f"voroquad._core_{level}")


_chosen = _choose()


def __getattr__(name: str) -> Any:
    return getattr(_chosen, name)
