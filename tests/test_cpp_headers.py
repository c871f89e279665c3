"""The public headers: each stands alone, and the names in the public namespace are those that are listed here."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

INCLUDE = Path(__file__).parents[1] / "include"
HEADERS = sorted((INCLUDE / "voroquad").glob("*.hpp"))
DEPRECATED = [header for header in HEADERS if header.read_text().startswith("// Deprecated")]
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wsign-conversion", "-Wshadow", "-Werror"]

# A name that is added here is one that users may write: it stays.
PUBLIC_NAMES = """
BiasLattice Bounds BoundsOf Box CellWorkspace ConvexDomain ConvexDomainOf Domain LeaveOneOut Neighbours NoPause
PilotRule Point PointView Polygons Polyhedra Resolution StrataBlocks StratifiedDesign UniformDesign Wall bias_function
boundary_control_of_sets cell_centroids cell_measures cell_measures_in cell_measures_in_ball cell_measures_in_cylinder
cell_measures_of_sets cell_neighbours cell_polygons cell_polyhedra cell_radii default_thread_count
exchange_weights_stratified exchange_weights_uniform for_each_cell for_each_cell_in leave_one_out nearest_points
parallel_for
"""

# Names that only deprecated headers give.
DEPRECATED_NAMES = "ConvexPolygon ConvexPolyhedron NearestFits NearestSamples RankedPoints cell_lengths control_weights"


def compile_only(compiler: str, source: Path, *options: str) -> str:
    if not shutil.which(compiler):
        pytest.skip(f"needs {compiler}")
    command = [compiler, "-std=c++20", "-fsyntax-only", f"-I{INCLUDE}", *options, str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def declared_names(text: str) -> set[str]:
    """Names directly in `voroquad`, of those that clang lists; parameters of templates are no names of it."""
    names = re.findall(r"^voroquad::(?:target_\w+::)?(\w+)$", text, re.MULTILINE)
    return {name for name in names if not re.fullmatch(r"target_\w+|detail|[A-Z]", name)}


def list_names(source: Path) -> set[str]:
    options = ["-Xclang", "-ast-list", "-Xclang", "-ast-dump-filter=voroquad::"]
    return declared_names(compile_only("clang++", source, *options))


@pytest.mark.parametrize("header", HEADERS, ids=lambda path: path.stem)
def test_each_public_header_stands_alone(header: Path, tmp_path: Path) -> None:
    source = tmp_path / "alone.cpp"
    source.write_text(f"#include <voroquad/{header.name}>\n#include <voroquad/{header.name}>\n")
    compile_only("g++", source, *WARNINGS)


@pytest.mark.parametrize("option", ["-fno-exceptions", "-DVOROQUAD_NO_THREADS"])
@pytest.mark.parametrize("compiler", ["g++", pytest.param("clang++", marks=pytest.mark.slow)])
def test_headers_without_exceptions_or_threads_need_no_threads(compiler: str, option: str, tmp_path: Path) -> None:
    source = tmp_path / "serial.cpp"
    source.write_text("".join(f"#include <voroquad/{header.name}>\n" for header in HEADERS))
    opened = compile_only(compiler, source, option, "-M")
    assert "parallel.hpp" in opened
    assert "crew.hpp" not in opened
    assert "crew.hpp" in compile_only(compiler, source, "-M")
    compile_only(compiler, source, *WARNINGS, option)


def test_public_names_are_those_of_the_list(tmp_path: Path) -> None:
    source = tmp_path / "all.cpp"
    headers = [header for header in HEADERS if header not in DEPRECATED]
    source.write_text("".join(f"#include <voroquad/{header.name}>\n" for header in headers))
    assert list_names(source) == set(PUBLIC_NAMES.split())


@pytest.mark.parametrize("compiler", ["g++", pytest.param("clang++", marks=pytest.mark.slow)])
def test_deprecated_headers_give_the_names_of_version_0_1(compiler: str, tmp_path: Path) -> None:
    source = tmp_path / "deprecated.cpp"
    includes = "".join(f"#include <voroquad/{header.name}>\n" for header in DEPRECATED)
    source.write_text(includes + "".join(f"using voroquad::{name};\n" for name in DEPRECATED_NAMES.split()))
    compile_only(compiler, source, *WARNINGS)


def test_a_new_public_name_is_noticed(tmp_path: Path) -> None:
    source = tmp_path / "new.cpp"
    source.write_text("#include <voroquad/points.hpp>\nnamespace VOROQUAD { inline int lanes = 8; }\n")
    assert list_names(source) - set(PUBLIC_NAMES.split()) == {"lanes"}


def test_headers_of_the_implementation_declare_no_public_name(tmp_path: Path) -> None:
    source = tmp_path / "detail.cpp"
    details = sorted((INCLUDE / "voroquad/detail").rglob("*.hpp"))
    assert len(details) > 10
    source.write_text("".join(f"#include <{header.relative_to(INCLUDE)}>\n" for header in details))
    assert list_names(source) <= set(PUBLIC_NAMES.split())
