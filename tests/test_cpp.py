"""The C++ core from outside: installed headers, examples, compilers, sanitizers.

The fast tests build each program with `g++` at one level of optimisation, the rules with `clang++` too, and the cells
with the sanitizers of one of them. The slow ones build with every version that is installed, at all levels, and with
the sanitizers of each.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

import voroquad as vq

ROOT = Path(__file__).parents[1]
CMAKE = shutil.which("cmake", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}") or "cmake"

COMPILERS = ["g++", "clang++"]
MOSTLY_ONE = ["g++", pytest.param("clang++", marks=pytest.mark.slow)]
OTHER_COMPILERS = [f"{name}-{version}" for name in COMPILERS for version in range(10, 30)]
EVERY_COMPILER = COMPILERS + [name for name in OTHER_COMPILERS if shutil.which(name)]

WARNINGS = "-Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow -Werror"
SANITIZERS = "-g -fsanitize=address,undefined -fno-sanitize-recover=all"

Build = Callable[[str, str, str], Path]


def run(*command: str | Path, **environment: str) -> str:
    result = subprocess.run(
        [str(c) for c in command], capture_output=True, text=True, check=False, env={**os.environ, **environment}
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


def require(compiler: str) -> None:
    if not shutil.which(compiler):
        package = compiler.replace("clang++", "clang")
        pytest.skip(f"needs {compiler}: apt-get install {package} (make test does it where it may)")


@cache
def has_sanitizers(compiler: str, kinds: str, folder: Path) -> bool:
    """Whether a compiler comes with the libraries of the sanitizers, which Debian packs apart for Clang."""
    source = folder / "empty.cpp"
    source.write_text("int main() {}\n")
    command = [compiler, f"-fsanitize={kinds}", str(source), "-o", str(folder / "empty")]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Build a program of tests/cpp or examples/cpp, without a warning; each one once."""

    @cache
    def built(compiler: str, source: str, flags: str) -> Path:
        require(compiler)
        folder = tmp_path_factory.mktemp("build")
        if "-fsanitize=" in flags and not has_sanitizers(compiler, flags.split("-fsanitize=")[1].split()[0], folder):
            pytest.skip(f"needs the sanitizers of {compiler}: apt-get install libclang-rt-dev")
        program = folder / Path(source).stem
        common = f"-std=c++20 {WARNINGS} -I{ROOT / 'include'} -pthread"
        run(compiler, *common.split(), *flags.split(), ROOT / source, "-o", program)
        return program

    return built


def corpus() -> list[Path]:
    """The inputs that libFuzzer kept."""
    files = sorted((ROOT / "tests/cpp/corpus").iterdir())
    assert len(files) > 20
    return files


# ---------------------------------------------------------------------- compilers and levels of optimisation


def as_the_processor_has_it() -> str:
    """Flags for fused multiply-add, where there is one: p × p is then a rounding error, not 0."""
    info = Path("/proc/cpuinfo")
    fuses = info.exists() and " fma " in info.read_text(encoding="utf-8")
    return "-mavx2 -mfma -ffp-contract=fast" if fuses else ""


def test_sanitizers_find_nothing_in_the_corpus(build: Build) -> None:
    compiler = "clang++" if shutil.which("clang++") else "g++"
    run(build(compiler, "tests/cpp/fuzz_cells.cpp", f"-O0 {SANITIZERS}"), *corpus())


@pytest.mark.parametrize("compiler", MOSTLY_ONE)
def test_cells_of_the_corpus_and_of_random_inputs(compiler: str, build: Build) -> None:
    program = build(compiler, "tests/cpp/fuzz_cells.cpp", f"-O2 {as_the_processor_has_it()}")
    run(program, *corpus())
    run(program)


@pytest.mark.parametrize("compiler", COMPILERS)
def test_rules(compiler: str, build: Build) -> None:
    run(build(compiler, "tests/cpp/rules.cpp", "-O1"))


BROKEN_CONTRACTS = """
coordinate 1 of point 2 is nan; it must be in [0, 1]
coordinate 0 of point 1 is -1e-300; it must be in [0, 1]
coordinate 1 of point 1 is 1.5; it must be in [0, 1)
coordinate 1 of point 1 is 1; it must be in [0, 1)
coordinate 1 of point 1 is inf; it must be in [0, 1]
"""


def test_broken_contracts_throw_in_debug_builds(build: Build) -> None:
    """One line for each call that breaks its contract, and none without an exception."""
    lines = run(build("g++", "tests/cpp/contracts.cpp", "-O0")).splitlines()
    assert lines[:5] == [f"voroquad: {line}" for line in BROKEN_CONTRACTS.split("\n")[1:-1]]
    assert len(lines) > 20
    assert all(line.startswith("voroquad: ") for line in lines)


def test_checks_of_contracts_are_no_code_in_release_builds(build: Build) -> None:
    debug, release = (build("g++", "tests/cpp/contracts.cpp", flags) for flags in ("-O0", "-O1 -DNDEBUG"))
    assert run(release) == ""
    assert b"it must be in" in debug.read_bytes()
    assert b"voroquad: " not in release.read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("flags", ["-O0", "-O1", "-O2", "-O3", "-O3 -march=native -DNDEBUG", f"-O1 {SANITIZERS}"])
@pytest.mark.parametrize("compiler", EVERY_COMPILER)
def test_every_program_with_every_compiler(compiler: str, flags: str, build: Build) -> None:
    fuzz = build(compiler, "tests/cpp/fuzz_cells.cpp", flags)
    run(fuzz, *corpus())
    run(fuzz)  # random inputs
    for program in (
        "tests/cpp/rules.cpp",
        "tests/cpp/threads.cpp",
        "tests/cpp/contracts.cpp",
        "examples/cpp/largest_cells.cpp",
    ):
        run(build(compiler, program, flags))


@pytest.mark.slow
@pytest.mark.parametrize("compiler", COMPILERS)
def test_thread_sanitizer_finds_nothing(compiler: str, build: Build) -> None:
    flags = "-O1 -g -fsanitize=thread -fno-sanitize-recover=all"
    run(build(compiler, "tests/cpp/threads.cpp", flags), TSAN_OPTIONS="halt_on_error=1")


# ---------------------------------------------------------------------- installed headers


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The headers, installed."""
    folder = tmp_path_factory.mktemp("cpp")
    run(CMAKE, "-S", ROOT, "-B", folder / "build")
    run(CMAKE, "--install", folder / "build", "--prefix", folder / "prefix")
    return folder / "prefix"


@pytest.mark.parametrize("compiler", MOSTLY_ONE)
def test_examples_build_against_installed_headers(compiler: str, prefix: Path, tmp_path: Path) -> None:
    require(compiler)
    quick = "-DCMAKE_BUILD_TYPE=Debug"  # to build, that is
    options = [f"-DCMAKE_PREFIX_PATH={prefix}", f"-DCMAKE_CXX_COMPILER={compiler}", f"-DCMAKE_CXX_FLAGS={WARNINGS}"]
    run(CMAKE, "-S", ROOT / "examples/cpp", "-B", tmp_path, *options, quick)
    run(CMAKE, "--build", tmp_path)
    plain, weighted = (float(word) for word in run(tmp_path / "integrate").replace(",", "").split() if word[0] in "+-")
    assert abs(weighted) < abs(plain) / 5
    assert "total area 1.000000000000" in run(tmp_path / "largest_cells")
    assert "catchment 10.000000000000" in run(tmp_path / "gauge_neighbours")
    equal, exchanged, _ = map(float, re.findall(r"[-+\d.]+e[-+]\d+", run(tmp_path / "shutter_times")))
    assert exchanged < equal / 5


PARENT_PROJECT = f"""
cmake_minimum_required(VERSION 3.18)
project(parent LANGUAGES CXX)
add_compile_options(-Wall -Wextra -Wshadow -Wsign-conversion -Werror)
include(FetchContent)
FetchContent_Declare(voroquad SOURCE_DIR {ROOT})
FetchContent_MakeAvailable(voroquad)
add_executable(largest_cells {ROOT}/examples/cpp/largest_cells.cpp)
target_link_libraries(largest_cells PRIVATE voroquad::voroquad)
install(TARGETS largest_cells)
"""


@pytest.mark.parametrize("compiler", MOSTLY_ONE)
def test_part_of_another_project(compiler: str, tmp_path: Path) -> None:
    """Its warnings are about its own code, and what it installs is its own, but for VOROQUAD_INSTALL=ON."""
    require(compiler)
    (tmp_path / "CMakeLists.txt").write_text(PARENT_PROJECT)
    options = [f"-DCMAKE_CXX_COMPILER={compiler}", "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON"]
    run(CMAKE, "-S", tmp_path, "-B", tmp_path / "build", *options)
    assert f"-isystem {ROOT / 'include'}" in (tmp_path / "build/compile_commands.json").read_text()
    run(CMAKE, "--build", tmp_path / "build")
    assert "total area 1.000000000000" in run(tmp_path / "build/largest_cells")

    def installed() -> list[str]:
        run(CMAKE, "--install", tmp_path / "build", "--prefix", tmp_path / "prefix")
        return [str(p.relative_to(tmp_path / "prefix")) for p in (tmp_path / "prefix").rglob("*") if p.is_file()]

    assert installed() == ["bin/largest_cells"]
    run(CMAKE, "-S", tmp_path, "-B", tmp_path / "build", "-DVOROQUAD_INSTALL=ON")
    assert "include/voroquad/cells.hpp" in installed()


@pytest.mark.skipif(not shutil.which("pkg-config"), reason="needs pkg-config")
def test_examples_build_with_pkg_config(prefix: Path, tmp_path: Path) -> None:
    def flags(*questions: str) -> list[str]:
        return run("pkg-config", *questions, "voroquad", PKG_CONFIG_PATH=f"{prefix}/share/pkgconfig").split()

    assert run("pkg-config", "--modversion", prefix / "share/pkgconfig/voroquad.pc").strip() == vq.__version__
    program = tmp_path / "largest_cells"
    source = ROOT / "examples/cpp/largest_cells.cpp"
    run(os.environ.get("CXX", "c++"), "-std=c++20", source, *flags("--cflags", "--libs"), "-o", program)
    assert "total area 1.000000000000" in run(program)


@pytest.mark.slow
@pytest.mark.parametrize("compiler", COMPILERS)
def test_every_header_stands_alone(compiler: str, prefix: Path, tmp_path: Path) -> None:
    require(compiler)
    headers = sorted((prefix / "include/voroquad").rglob("*.hpp"))
    assert len(headers) > 10
    source = tmp_path / "headers.cpp"
    for header in headers:
        name = header.relative_to(prefix / "include")
        source.write_text(f"#include <{name}>\n#include <{name}>\n")
        run(compiler, "-std=c++20", "-fsyntax-only", *WARNINGS.split(), f"-I{prefix / 'include'}", source)
