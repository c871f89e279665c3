"""Files of one program may be compiled for different processors."""

from __future__ import annotations

import platform
import shutil
import subprocess
from pathlib import Path

import pytest

from voroquad import _core

INCLUDE = Path(__file__).parents[1] / "include"
PART = """
#include <voroquad/cells.hpp>
double NAME() {
    std::vector<double> x, w(500);
    unsigned state = 1;
    for (int i = 0; i < 1000; ++i) x.push_back((state = state * 1664525u + 1013904223u) * 0x1p-32);
    voroquad::CellWorkspace<2> work;
    voroquad::cell_measures<2>({x.data(), 500}, voroquad::Domain::box, w.data(), work);
    double sum = 0.0;
    for (double one : w) sum += one;
    return sum;
}
"""
MAIN = """
#include <cmath>
double plain();
double wide();
int main() { return std::abs(plain() - 1) > 1e-12 || std::abs(wide() - 1) > 1e-12; }
"""


def run(*command: object) -> str:
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.skipif(platform.machine() != "x86_64", reason="levels of x86-64")
@pytest.mark.skipif("v3" not in _core.processor_levels(), reason="the processor lacks x86-64-v3")
@pytest.mark.parametrize("compiler", ["g++", "clang++"])
def test_files_for_different_processors_share_no_function(compiler: str, tmp_path: Path) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"needs {compiler}")
    objects, functions = [], []
    for name, march in (("plain", "x86-64"), ("wide", "x86-64-v3")):
        source, target = tmp_path / f"{name}.cpp", tmp_path / f"{name}.o"
        source.write_text(PART.replace("NAME", name))
        run(compiler, "-std=c++20", "-O1", f"-march={march}", f"-I{INCLUDE}", "-c", source, "-o", target)
        symbols = [line.split(maxsplit=2)[-1] for line in run("nm", "-C", "--defined-only", target).splitlines()]
        functions.append({symbol for symbol in symbols if symbol.startswith("voroquad::")})
        objects.append(target)
    assert functions[0]
    assert not functions[0] & functions[1]
    (tmp_path / "main.cpp").write_text(MAIN)
    run(compiler, "-std=c++20", tmp_path / "main.cpp", *objects, "-pthread", "-o", tmp_path / "program")
    run(tmp_path / "program")
