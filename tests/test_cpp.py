"""The C++ core from outside: installed headers, examples, sanitizers."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

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
    run(CMAKE, "-S", ROOT / "examples/cpp", "-B", tmp_path, f"-DCMAKE_PREFIX_PATH={prefix}")
    run(CMAKE, "--build", tmp_path)
    plain, weighted = (float(word) for word in run(tmp_path / "integrate").replace(",", "").split() if word[0] in "+-")
    assert abs(weighted) < abs(plain) / 5
    assert "total area 1.000000000000" in run(tmp_path / "largest_cells")


def test_pkg_config_file(prefix: Path) -> None:
    text = (prefix / "share/pkgconfig/voroquad.pc").read_text()
    assert (prefix / "include/voroquad/cells.hpp").is_file()
    assert "Cflags: -I${includedir} -pthread" in text


def test_sanitizers_find_nothing(tmp_path: Path) -> None:
    """AddressSanitizer and UndefinedBehaviorSanitizer over random inputs of the fuzz target."""
    program = tmp_path / "fuzz"
    flags = "-std=c++20 -O1 -g -Wall -Wextra -Werror -fsanitize=address,undefined -fno-sanitize-recover=all -pthread"
    run(CXX, *flags.split(), f"-I{ROOT / 'include'}", ROOT / "tests/cpp/fuzz_cells.cpp", "-o", program)
    run(program)
