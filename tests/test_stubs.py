"""The types of the compiled core are those that it has."""

import subprocess
import sys
from pathlib import Path

import pytest

import voroquad

STUBS = Path(voroquad.__file__).with_name("_core.pyi")
SCRIPT = Path(__file__).parents[1] / "scripts" / "make_stubs.py"


def test_the_types_of_the_core_are_up_to_date():
    nanobind = pytest.importorskip("nanobind", reason="the generator comes with nanobind")
    if f"nanobind {nanobind.__version__}\n" not in STUBS.read_text(encoding="utf-8").splitlines(keepends=True)[0]:
        pytest.skip("another version of nanobind may write them in another way")
    done = subprocess.run([sys.executable, SCRIPT, "--check"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
