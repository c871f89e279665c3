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


BITS = Path(__file__).parent / "cpp" / "bits.cpp"

COMPILERS = ["g++", pytest.param("clang++", marks=pytest.mark.slow)]


def run(*command: object) -> str:
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def require(compiler: str) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"needs {compiler}")


def link_together(compiler: str, plain: str, wide: str, folder: Path) -> None:
    """Compile the same code with two kinds of flags; the parts share no function, and work in one program."""
    objects, functions = [], []
    for name, flag in (("plain", plain), ("wide", wide)):
        source, target = folder / f"{name}.cpp", folder / f"{name}.o"
        source.write_text(PART.replace("NAME", name))
        run(compiler, "-std=c++20", "-O0", flag, f"-I{INCLUDE}", "-c", source, "-o", target)
        symbols = [line.split(maxsplit=2)[-1] for line in run("nm", "-C", "--defined-only", target).splitlines()]
        functions.append({symbol for symbol in symbols if symbol.startswith("voroquad::")})
        objects.append(target)
    assert functions[0]
    assert not functions[0] & functions[1]
    (folder / "main.cpp").write_text(MAIN)
    run(compiler, "-std=c++20", folder / "main.cpp", *objects, "-pthread", "-o", folder / "program")
    run(folder / "program")


@pytest.mark.skipif(platform.machine() != "x86_64", reason="levels of x86-64")
@pytest.mark.skipif("v3" not in _core.processor_levels(), reason="the processor lacks x86-64-v3")
@pytest.mark.parametrize("compiler", COMPILERS)
def test_files_for_different_processors_share_no_function(compiler: str, tmp_path: Path) -> None:
    require(compiler)
    link_together(compiler, "-march=x86-64", "-march=x86-64-v3", tmp_path)


@pytest.mark.parametrize("compiler", COMPILERS)
def test_files_with_and_without_checks_share_no_function(compiler: str, tmp_path: Path) -> None:
    require(compiler)
    link_together(compiler, "-UNDEBUG", "-DNDEBUG", tmp_path)


@pytest.mark.parametrize("compiler", COMPILERS)
def test_files_with_and_without_vector_extensions_share_no_function(compiler: str, tmp_path: Path) -> None:
    require(compiler)
    link_together(compiler, "-DVOROQUAD_PORTABLE", "-UVOROQUAD_PORTABLE", tmp_path)


def bits(compiler: str, level: str, flag: str, folder: Path) -> list[str]:
    """What tests/cpp/bits.cpp prints, built with these flags."""
    require(compiler)
    common = ["-std=c++20", level, "-ffp-contract=off", f"-I{INCLUDE}", "-pthread", BITS]
    run(compiler, *common, flag, "-o", folder / "bits")
    lines = run(folder / "bits").splitlines()
    assert len(lines) > 2000
    return lines


@pytest.mark.parametrize(
    ("compiler", "level", "flag"),
    [
        ("g++", "-O1", "-DVOROQUAD_PORTABLE"),
        pytest.param("g++", "-O1", "-UVOROQUAD_PORTABLE", marks=pytest.mark.slow),
        pytest.param("clang++", "-O1", "-DVOROQUAD_PORTABLE", marks=pytest.mark.slow),
    ],
)
def test_without_vector_extensions_all_bits_are_the_same(compiler: str, level: str, flag: str, tmp_path: Path) -> None:
    """Nor does it matter how far the compiler optimises: wheels are built with -O3."""
    assert bits(compiler, level, flag, tmp_path) == bits("g++", "-O3", "-UVOROQUAD_PORTABLE", tmp_path)
