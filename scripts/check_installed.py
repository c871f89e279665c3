"""Checks an installed package: it is complete, and is not the checkout.

PYTHON scripts/check_installed.py      # with the interpreter that voroquad is installed for
"""

from __future__ import annotations

import importlib.metadata
import json
import sys
from pathlib import Path

import numpy as np

import voroquad as vq

PACKAGE = Path(vq.__file__).parent
CHECKOUT = Path(__file__).resolve().parents[1] / "src"
#: Files that compilers, CMake and `voroquad demo` take from the package
NEEDED = (
    Path(vq.get_include(), "voroquad", "cells.hpp"),
    Path(vq.get_cmake_dir(), "voroquadConfig.cmake"),
    Path(vq.get_cmake_dir(), "voroquadTargets.cmake"),
    PACKAGE / "report" / "live.html",
    PACKAGE / "py.typed",
)
#: Files beside the metadata
DECLARED = (
    "licenses/LICENSE",
    "licenses/LICENSES/nanobind.txt",
    "licenses/LICENSES/robin-map.txt",
    "sboms/voroquad.cdx.json",
)


def faults() -> list[str]:
    """What is wrong with the installation, a line each."""
    if CHECKOUT in PACKAGE.parents:
        return [f"{PACKAGE} is the checkout"]
    found = [f"{path} is missing" for path in NEEDED if not path.is_file()]
    files = importlib.metadata.files("voroquad") or []
    declared = {str(path).split(".dist-info/")[1]: path for path in files if ".dist-info/" in str(path)}
    found += [f"{name} is missing beside the metadata" for name in DECLARED if name not in declared]
    if not found:
        parts = json.loads(declared[DECLARED[-1]].read_text())["components"]
        if [part["name"] for part in parts] != ["nanobind", "robin-map"] or not parts[0]["version"][0].isdigit():
            found.append(f"the list of parts has {parts}")
    result = vq.quad(lambda x: np.exp(x[0] * x[1]), [0, 0], [1, 1], n_points=1024, rng=1)
    if abs(result.integral - 1.3179021514544) > 1e-6:
        found.append(f"quad returns {result.integral}")
    return found


if __name__ == "__main__":
    sys.exit("\n".join(faults()) or None)
