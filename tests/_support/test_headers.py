"""The headers that an installed package brings are found by a compiler and by CMake."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import voroquad as vq

SOURCE = """\
#include <voroquad/cells.hpp>
int main() {}
"""

PROJECT = """\
cmake_minimum_required(VERSION 3.18)
project(user LANGUAGES CXX)
find_package(voroquad {version} CONFIG REQUIRED)
add_executable(user user.cpp)
target_link_libraries(user PRIVATE voroquad::voroquad)
"""


def run(*command: str | Path) -> None:
    result = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr


def test_compiler_finds_the_headers(tmp_path: Path) -> None:
    (tmp_path / "user.cpp").write_text(SOURCE)
    run(os.environ.get("CXX", "c++"), "-std=c++20", "-fsyntax-only", f"-I{vq.get_include()}", tmp_path / "user.cpp")


def test_cmake_finds_the_package(tmp_path: Path) -> None:
    scripts = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    cmake = shutil.which("cmake", path=scripts) or "cmake"
    (tmp_path / "user.cpp").write_text(SOURCE)
    (tmp_path / "CMakeLists.txt").write_text(PROJECT.format(version=vq.__version__))
    run(cmake, "-S", tmp_path, "-B", tmp_path / "build", f"-Dvoroquad_DIR={vq.get_cmake_dir()}")
    run(cmake, "--build", tmp_path / "build")
    assert (tmp_path / "build" / "user").exists()
