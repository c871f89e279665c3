"""`make` builds the core again if levels of the processor are missing, and only then."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
OF_AN_OUTER_MAKE = {"LEVELS", "MAKEFLAGS", "MAKELEVEL", "MAKEOVERRIDES", "MFLAGS"}
needs_make = pytest.mark.skipif(not shutil.which("make") or not shutil.which("c++"), reason="needs make and a compiler")


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """What stands for the sources of the core."""
    path = tmp_path / "module.cpp"
    path.touch()
    return path


@pytest.fixture
def built(tmp_path: Path, source: Path) -> Callable[..., list[str]]:
    """Runs `make built` for levels, as `make demo` names them, with a pip that notes its arguments only.

    The function returns which levels are compiled.
    """
    programs, notes = tmp_path / "venv" / "bin", tmp_path / "notes"
    programs.mkdir(parents=True)
    (programs / "python").touch()
    (programs / "pip").write_text(f'#!/bin/sh\necho "$@" >> "{notes}"\n')
    (programs / "pip").chmod(0o755)
    outside = {name: value for name, value in os.environ.items() if name not in OF_AN_OUTER_MAKE}

    def run(**levels: str) -> list[str]:
        notes.write_text("")
        command = ["make", "-s", "built", f"VENV={programs.parent}", f"CORE={source}"]
        subprocess.run(command, cwd=ROOT, env=outside | levels, check=True)
        return re.findall(r"VOROQUAD_LEVELS=(\S+)", notes.read_text())

    return run


@needs_make
def test_all_levels_are_built_after_those_of_this_machine(built: Callable[..., list[str]]) -> None:
    assert built(LEVELS="this-machine") == ["this-machine"]
    assert built(LEVELS="this-machine") == []
    assert built() == ["all"]
    assert built() == []


@needs_make
def test_this_machine_needs_nothing_where_all_levels_are(built: Callable[..., list[str]], source: Path) -> None:
    assert built() == ["all"]
    assert built(LEVELS="this-machine") == []
    source.write_text("// changed")
    assert built(LEVELS="this-machine") == ["this-machine"]
    assert built() == ["all"]
