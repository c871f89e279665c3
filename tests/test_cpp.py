"""The C++ core from outside: installed headers, examples, sanitizers."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import voroquad as vq

ROOT = Path(__file__).parents[1]
CMAKE = shutil.which("cmake", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}") or "cmake"
CXX = os.environ.get("CXX", "c++")


def run(*command: str | Path, **environment: str) -> str:
    result = subprocess.run(
        [str(c) for c in command], capture_output=True, text=True, check=False, env={**os.environ, **environment}
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The headers, installed."""
    folder = tmp_path_factory.mktemp("cpp")
    run(CMAKE, "-S", ROOT, "-B", folder / "build")
    run(CMAKE, "--install", folder / "build", "--prefix", folder / "prefix")
    return folder / "prefix"


def test_examples_build_against_installed_headers(prefix: Path, tmp_path: Path) -> None:
    quick = "-DCMAKE_BUILD_TYPE=Debug"  # to build, that is
    run(CMAKE, "-S", ROOT / "examples/cpp", "-B", tmp_path, f"-DCMAKE_PREFIX_PATH={prefix}", quick)
    run(CMAKE, "--build", tmp_path)
    plain, weighted = (float(word) for word in run(tmp_path / "integrate").replace(",", "").split() if word[0] in "+-")
    assert abs(weighted) < abs(plain) / 5
    assert "total area 1.000000000000" in run(tmp_path / "largest_cells")


@pytest.mark.skipif(not shutil.which("pkg-config"), reason="needs pkg-config")
def test_examples_build_with_pkg_config(prefix: Path, tmp_path: Path) -> None:
    def flags(*questions: str) -> list[str]:
        return run("pkg-config", *questions, "voroquad", PKG_CONFIG_PATH=f"{prefix}/share/pkgconfig").split()

    assert run("pkg-config", "--modversion", prefix / "share/pkgconfig/voroquad.pc").strip() == vq.__version__
    program = tmp_path / "largest_cells"
    source = ROOT / "examples/cpp/largest_cells.cpp"
    run(CXX, "-std=c++20", source, *flags("--cflags", "--libs"), "-o", program)
    assert "total area 1.000000000000" in run(program)


@pytest.mark.slow
def test_every_header_stands_alone(prefix: Path, tmp_path: Path) -> None:
    headers = sorted((prefix / "include/voroquad").glob("*.hpp"))
    assert len(headers) > 10
    source = tmp_path / "headers.cpp"
    for header in headers:
        source.write_text(f"#include <voroquad/{header.name}>\n#include <voroquad/{header.name}>\n")
        run(CXX, "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", f"-I{prefix / 'include'}", source)


def build(program: Path, sanitizers: str, source: str, optimised: str = "-O1") -> Path:
    flags = (
        f"-std=c++20 {optimised} -g -Wall -Wextra -Werror -fsanitize={sanitizers} -fno-sanitize-recover=all -pthread"
    )
    run(CXX, *flags.split(), f"-I{ROOT / 'include'}", ROOT / "tests/cpp" / source, "-o", program)
    return program


def corpus() -> list[Path]:
    """The inputs that libFuzzer kept."""
    files = sorted((ROOT / "tests/cpp/corpus").iterdir())
    assert len(files) > 20
    return files


def test_address_and_undefined_behaviour_sanitizers_find_nothing(tmp_path: Path) -> None:
    run(build(tmp_path / "fuzz", "address,undefined", "fuzz_cells.cpp", optimised="-O0"), *corpus())


@pytest.mark.slow
def test_sanitizers_find_nothing_in_random_inputs(tmp_path: Path) -> None:
    """As a compiler optimises them, too."""
    program = build(tmp_path / "fuzz", "address,undefined", "fuzz_cells.cpp")
    run(program, *corpus())
    run(program)


def fuses() -> bool:
    """Whether the processor multiplies and adds in one step."""
    info = Path("/proc/cpuinfo")
    return info.exists() and " fma " in info.read_text(encoding="utf-8")


@pytest.mark.skipif(not fuses(), reason="needs a processor with fused multiply-add")
def test_cells_hold_with_fused_multiply_add(tmp_path: Path) -> None:
    """As compilers do by default for such processors: p × p is a rounding error then, not 0."""
    program = tmp_path / "fused"
    flags = "-std=c++20 -O2 -mavx2 -mfma -ffp-contract=fast -pthread"
    run(CXX, *flags.split(), f"-I{ROOT / 'include'}", ROOT / "tests/cpp/fuzz_cells.cpp", "-o", program)
    run(program, *corpus())
    run(program)


@pytest.mark.slow
def test_thread_sanitizer_finds_nothing(tmp_path: Path) -> None:
    run(build(tmp_path / "threads", "thread", "threads.cpp"), TSAN_OPTIONS="halt_on_error=1")
