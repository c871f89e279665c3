"""Time of cell measures by the C++ headers, compiled with several flags, beside the Python package.

    python benchmarks/header_speed.py                       (3 minutes; g++, and clang++ where it is installed)
    python benchmarks/header_speed.py --points 2000 --rounds 1 --output small.csv

Uniform points of the unit box, on one thread. All programs run in turn, in every round; the median of the rounds is
taken, in CPU time. The measures of each program are compared with the package's. Writes
benchmarks/results/header_speed.csv.
"""

from __future__ import annotations

import argparse
import csv
import shutil
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numpy as np
from cells_peers import machine

import voroquad as vq

HERE = Path(__file__).parent
COMPILERS = ("g++", "clang++")
FLAGS = ("-O3", "-O3 -march=x86-64-v3", "-O3 -march=native")
#: Points of the plane and of space: both take about as long
SHARE = {2: 1.0, 3: 0.1}
COLUMNS = ("d", "n", "compiler", "flags", "ns per point", "times the package")
TOLERANCE = 1e-12

#: Points (n, d) to measures (n,) and CPU seconds
Program = Callable[[np.ndarray], tuple[np.ndarray, float]]


def package(points: np.ndarray) -> tuple[np.ndarray, float]:
    """The Python package, after a run that is not timed."""
    for _ in range(2):
        start = time.process_time()
        measures = vq.cells(points, threads=1).measures
        seconds = time.process_time() - start
    return measures, seconds


def compiled(compiler: str, flags: str, folder: Path, include: Path = HERE.parent / "include") -> Program:
    """The program of header_speed.cpp, in a folder of its own."""
    folder = Path(tempfile.mkdtemp(dir=folder))
    program = folder / "header_speed"
    options = ["-std=c++20", "-DNDEBUG", "-pthread", f"-I{include}"]
    subprocess.run([compiler, *flags.split(), *options, HERE / "header_speed.cpp", "-o", program], check=True)

    def run(points: np.ndarray) -> tuple[np.ndarray, float]:
        source, target = folder / "points", folder / "measures"
        points.tofile(source)
        command = [program, str(points.shape[1]), source, target]
        seconds = float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        return np.fromfile(target), seconds

    return run


def programs(folder: Path) -> dict[tuple[str, str], Program]:
    """By compiler and flags; the package comes first."""
    found: dict[tuple[str, str], Program] = {("the Python package", ""): package}
    for compiler in filter(shutil.which, COMPILERS):
        for flags in FLAGS:
            print("compiling with", compiler, flags, flush=True)
            found[compiler, flags] = compiled(compiler, flags, folder)
    return found


def medians(points: np.ndarray, runs: dict[tuple[str, str], Program], rounds: int) -> dict[tuple[str, str], float]:
    """CPU seconds of each program; their measures must agree with the first one's."""
    seconds: dict[tuple[str, str], list[float]] = {name: [] for name in runs}
    for _ in range(rounds):
        expected = None
        for name, run in runs.items():
            measures, time_taken = run(points)
            expected = measures if expected is None else expected
            error = np.abs(measures - expected).max()
            if not error < TOLERANCE:
                raise SystemExit(f"{' '.join(name)}: measures differ by {error:.1e}")
            seconds[name].append(time_taken)
    return {name: statistics.median(of) for name, of in seconds.items()}


def rows_of(points: np.ndarray, runs: dict[tuple[str, str], Program], rounds: int) -> list[list[object]]:
    """A row for each program."""
    n, d = points.shape
    times = medians(points, runs, rounds)
    own = next(iter(times.values()))
    return [[d, n, *name, f"{1e9 * of / n:.0f}", f"{of / own:.2f}"] for name, of in times.items()]


def compiler_versions() -> str:
    lines = [subprocess.run([c, "--version"], check=True, capture_output=True, text=True).stdout.splitlines()[0]
             for c in filter(shutil.which, COMPILERS)]  # fmt: skip
    return ", ".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=10**6, help="of the plane; a tenth of it in space")
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--output", type=Path, default=HERE / "results" / "header_speed.csv")
    options = parser.parse_args()
    rows: list[list[object]] = []
    with tempfile.TemporaryDirectory() as folder:
        runs = programs(Path(folder))
        for d, share in SHARE.items():
            points = np.random.default_rng(1).random((round(share * options.points), d))
            rows += rows_of(points, runs, options.rounds)
            print(*rows[-len(runs) :], sep="\n", flush=True)
    with options.output.open("w", newline="", encoding="utf-8") as file:
        file.write(f"# {machine()}, voroquad {version('voroquad')}, {compiler_versions()}\n")
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows(rows)


if __name__ == "__main__":
    main()
