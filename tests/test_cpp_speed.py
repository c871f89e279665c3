"""benchmarks/header_speed.py and cell_constants.py, at a small size."""

from __future__ import annotations

import csv
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "benchmarks"), str(ROOT / "scripts")]
import cell_constants  # noqa: E402
from tables.programs import header_speed_table  # noqa: E402

SPEEDS = """# A processor, compilers
d,n,compiler,flags,ns per point,times the package
2,1000,the Python package,,250,1.00
2,1000,g++,-O3,1750,7.00
"""


def test_table(tmp_path: Path) -> None:
    path = tmp_path / "header_speed.csv"
    path.write_text(SPEEDS)
    *_, package, headers = header_speed_table(path).splitlines()
    assert package == "| the Python package |  | 2 | 1,000 | 250 | 1.00 |"
    assert headers == "| g++ | `-O3` | 2 | 1,000 | 1,750 | 7.00 |"


def test_every_tuned_constant_is_changed() -> None:
    text = (cell_constants.INCLUDE / cell_constants.TUNING).read_text(encoding="utf-8")
    changed = list(cell_constants.variants(text))
    assert len(changed) == 2 * text.count("static constexpr") > 10
    assert all(other != text for *_, other in changed)
    assert ("remembered_far_sites", 2.0) in {(name, factor) for name, factor, _ in changed}


def run(script: str, output: Path) -> list[list[str]]:
    if not shutil.which("g++"):
        pytest.skip("needs g++")
    options = ["--points", "2000", "--rounds", "1", "--output", str(output)]
    subprocess.run([sys.executable, ROOT / "benchmarks" / script, *options], check=True)
    return list(csv.reader(output.read_text().splitlines()[1:]))


@pytest.mark.slow
def test_header_speed(tmp_path: Path) -> None:
    header, *rows = run("header_speed.py", tmp_path / "speed.csv")
    assert header[-1] == "times the package"
    assert {row[0] for row in rows} == {"2", "3"}
    assert all(float(row[-1]) > 0 for row in rows)


@pytest.mark.slow
def test_cell_constants(tmp_path: Path) -> None:
    header, unchanged, *rows = run("cell_constants.py", tmp_path / "constants.csv")
    assert header[0] == "constant"
    assert unchanged == ["none", "1", "1.00", "1.00"]
    assert len(rows) > 10
