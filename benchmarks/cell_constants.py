"""Time of cell measures with each constant of tuning.hpp at half and at twice its value.

    python benchmarks/cell_constants.py                     (10 minutes; g++)
    python benchmarks/cell_constants.py --points 2000 --rounds 1 --output small.csv

Copies of the headers, each with one constant changed, are compiled with -O3 -march=native and run in turn on the same
uniform points of the unit box, on one thread. Writes benchmarks/results/cell_constants.csv: the median of the rounds,
relative to the headers as they are.
"""

from __future__ import annotations

import argparse
import csv
import re
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from cells_peers import machine
from header_speed import HERE, SHARE, Program, compiled, medians

INCLUDE = HERE.parent / "include"
TUNING = Path("voroquad/detail/cells/tuning.hpp")
COMPILER, FLAGS = "g++", "-O3 -march=native"
FACTORS = (0.5, 2.0)
CONSTANT = re.compile(r"static constexpr (?P<type>\S+) (?P<name>\w+) = (?P<value>[^;]+);")


def variants(text: str) -> Iterator[tuple[str, float, str]]:
    """Of each constant its name, the factor, and the header with the changed value."""
    for found in CONSTANT.finditer(text):
        for factor in FACTORS:
            value = f"static_cast<{found['type']}>({factor} * ({found['value']}))"
            changed = text[: found.start("value")] + value + text[found.end("value") :]
            yield found["name"], factor, changed


def programs(folder: Path) -> dict[tuple[str, str], Program]:
    """By constant and factor; the headers as they are come first."""
    found = {("none", "1"): compiled(COMPILER, FLAGS, folder)}
    for name, factor, text in variants((INCLUDE / TUNING).read_text(encoding="utf-8")):
        print("compiling", name, "x", factor, flush=True)
        include = folder / f"{name}-{factor}"
        shutil.copytree(INCLUDE, include)
        (include / TUNING).write_text(text, encoding="utf-8")
        found[name, f"{factor:g}"] = compiled(COMPILER, FLAGS, folder, include)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=300_000, help="of the plane; a tenth of it in space")
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--output", type=Path, default=HERE / "results" / "cell_constants.csv")
    options = parser.parse_args()
    ratios: dict[tuple[str, str], list[str]] = {}
    with tempfile.TemporaryDirectory() as folder:
        runs = programs(Path(folder))
        for d, share in SHARE.items():
            points = np.random.default_rng(1).random((round(share * options.points), d))
            times = medians(points, runs, options.rounds)
            for name, seconds in times.items():
                ratios.setdefault(name, []).append(f"{seconds / times['none', '1']:.2f}")
    with options.output.open("w", newline="", encoding="utf-8") as file:
        file.write(f"# {machine()}, {COMPILER} {FLAGS}\n")
        writer = csv.writer(file)
        writer.writerow(["constant", "factor", *(f"time, d = {d}" for d in SHARE)])
        writer.writerows([*name, *of] for name, of in ratios.items())


if __name__ == "__main__":
    main()
