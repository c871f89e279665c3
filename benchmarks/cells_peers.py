"""Time of cell measures beside peers, on the same points in the same run.

    pip install -e '.[bench]'; apt-get install voro++-dev     (and a C++ compiler; cargo for delaunator)
    python benchmarks/cells_peers.py                          (5 minutes; peers that are not there are left out)

Writes benchmarks/results/cells_peers.csv: nanoseconds per point, the least of three interleaved runs, of fifteen where
one takes less than two seconds, on one thread and of CPU time; where the number of threads is named, of wall time on a
machine that does nothing else. SciPy's columns and delaunator are the diagram or the triangulation alone, without
measures and without the border. All measures that a peer returns are compared with voroquad's.
"""

from __future__ import annotations

import csv
import importlib.util
import platform
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import TypeVar

import numpy as np
from scipy.spatial import Delaunay, Voronoi

import voroquad as vq

HERE = Path(__file__).parent
ROUNDS, MOST_ROUNDS = 3, 15
SHORT = 2.0  # seconds; a program that takes less runs in all rounds
PACKAGES = ("voroquad", "numpy", "scipy", "pyvoro2", "freud-analysis")

Result = TypeVar("Result")
Program = Callable[[np.ndarray], float]  # points (n, d) or (sets, n, d): seconds


def timed(call: Callable[[], Result]) -> tuple[Result, float]:
    """What a call returns, and its CPU time."""
    start = time.process_time()
    result = call()
    return result, time.process_time() - start


def cpu_seconds(call: Callable[[], object]) -> float:
    return timed(call)[1]


def agree(measures: np.ndarray, points: np.ndarray, *, periodic: bool = False, tolerance: float = 1e-10) -> None:
    """Stop where a peer's measures of the cells of the unit box differ."""
    error = np.abs(measures - vq.cells(points, periodic=periodic, threads=1).measures).max()
    if not error < tolerance:
        raise SystemExit(f"a peer's measures differ by {error:.1e}")


# ---------------------------------------------------------------------- points


def uniform(n: int, d: int) -> np.ndarray:
    return np.random.default_rng(1).random((n, d))


def gaussian(n: int, d: int) -> np.ndarray:
    return 0.5 + 1e-4 * np.random.default_rng(1).normal(size=(n, d))


def cantor(n: int, d: int) -> np.ndarray:
    digits = np.random.default_rng(1).integers(0, 2, (n, d, 30))
    return (2 * digits / 3.0 ** np.arange(1, 31)).sum(axis=-1)


# ---------------------------------------------------------------------- programs


def voroquad(points: np.ndarray) -> float:
    return cpu_seconds(lambda: vq.cells(points, threads=1).measures)


def voroquad_torus(points: np.ndarray) -> float:
    return cpu_seconds(lambda: vq.cells(points, periodic=True, threads=1).measures)


def on_threads(threads: int) -> Program:
    def run(points: np.ndarray) -> float:
        start = time.perf_counter()
        vq.cells(points, threads=threads).measures  # noqa: B018
        return time.perf_counter() - start

    return run


def pyvoro2(points: np.ndarray) -> float:
    """voro++ from Python, without vertices, neighbours and faces."""
    from pyvoro2 import Box, compute, planar

    unit, none = ((0.0, 1.0),) * points.shape[1], {"return_vertices": False, "return_adjacency": False}
    if points.shape[1] == 2:
        cells, seconds = timed(lambda: planar.compute(points, domain=planar.Box(unit), return_edges=False, **none))
    else:
        cells, seconds = timed(lambda: compute(points, domain=Box(unit), return_faces=False, **none))
    agree(np.asarray(cells.cell_measures), points)
    return seconds


def freud(points: np.ndarray) -> float:
    """Cells of the torus in space, of points in single precision. (In the plane its time grows with their square.)"""
    import freud

    freud.parallel.set_num_threads(1)
    centred = (points - 0.5).astype(np.float32)
    cells, seconds = timed(lambda: freud.locality.Voronoi().compute((freud.box.Box.cube(1), centred)))
    agree(cells.volumes, (centred.astype(float) + 0.5) % 1.0, periodic=True, tolerance=1e-2 / len(points))
    return seconds


def voropp(folder: Path) -> Program | None:
    """voro++ as a library."""
    if not shutil.which("c++"):
        return None
    program = folder / "voropp"
    build = ["c++", "-O3", "-std=c++17", str(HERE / "voropp.cpp"), "-o", str(program), "-lvoro++"]
    if subprocess.run(build, check=False, capture_output=True).returncode:
        return None

    def run(points: np.ndarray) -> float:
        source, target = folder / "points", folder / "volumes"
        points.tofile(source)
        seconds = float(output_of(program, len(points), source, target))
        agree(np.fromfile(target), points)
        return seconds

    return run


def delaunator(folder: Path) -> Program | None:
    """The Delaunay triangulation of the Rust crate."""
    if not shutil.which("cargo"):
        return None
    manifest, target = HERE / "delaunator" / "Cargo.toml", folder / "rust"
    build = ["cargo", "build", "--quiet", "--release", f"--manifest-path={manifest}", f"--target-dir={target}"]
    if subprocess.run(build, check=False).returncode:
        return None

    def run(points: np.ndarray) -> float:
        source = folder / "points"
        points.tofile(source)
        seconds, triangles = output_of(target / "release" / "delaunator-time", source).split()
        if not 1.95 * len(points) < int(triangles) < 2 * len(points):
            raise SystemExit(f"delaunator made {triangles} triangles of {len(points)} points")
        return float(seconds)

    return run


def output_of(*command: object) -> str:
    return subprocess.run([str(c) for c in command], check=True, capture_output=True, text=True).stdout


# ---------------------------------------------------------------------- the run


def cases(folder: Path) -> list[tuple[str, np.ndarray, dict[str, Program | None]]]:
    """Names, points and programs; the first program is what the others are compared with."""
    alone: dict[str, Program | None] = {"voroquad": voroquad}
    beside_uniform: dict[str, Program | None] = {
        "voroquad": voroquad,
        "voroquad, uniform points": lambda x: voroquad(uniform(*x.shape)),
    }
    torus: dict[str, Program | None] = {
        "voroquad": voroquad_torus,
        "freud": freud if importlib.util.find_spec("freud") else None,
    }
    threads: dict[str, Program | None] = {"voroquad, 1 thread": on_threads(1), "voroquad, 2 threads": on_threads(2)}
    pyvoro = pyvoro2 if importlib.util.find_spec("pyvoro2") else None
    in_plane: dict[str, Program | None] = {
        "voroquad": voroquad,
        "scipy Voronoi": lambda x: cpu_seconds(lambda: Voronoi(x)),
        "scipy Delaunay": lambda x: cpu_seconds(lambda: Delaunay(x)),
        "delaunator": delaunator(folder),
    }
    in_space: dict[str, Program | None] = {"voroquad": voroquad, "voro++": voropp(folder), "pyvoro2": pyvoro}
    on_a_line: dict[str, Program | None] = {
        "voroquad": voroquad,
        "numpy sort": lambda x: cpu_seconds(lambda: np.sort(x[:, 0])),
        "numpy argsort": lambda x: cpu_seconds(lambda: np.argsort(x[:, 0])),
    }
    small_sets = uniform(4096 * 64, 2).reshape(4096, 64, 2)
    return [
        ("1-D uniform", uniform(10**6, 1), on_a_line),
        ("2-D uniform", uniform(10**4, 2), {"voroquad": voroquad, "pyvoro2": pyvoro}),
        ("2-D uniform", uniform(10**5, 2), in_plane),
        ("2-D uniform", uniform(10**6, 2), in_plane),
        ("2-D uniform", uniform(10**7, 2), alone),
        ("2-D uniform", uniform(10**6, 2), threads),
        ("2-D Gaussian, sigma 1e-4", gaussian(10**5, 2), beside_uniform),
        ("2-D Cantor set", cantor(10**5, 2), beside_uniform),
        ("2-D 4096 sets of 64", small_sets, alone),
        ("2-D 4096 sets of 64", small_sets, threads),
        ("3-D uniform", uniform(10**5, 3), in_space),
        ("3-D uniform", uniform(10**6, 3), alone),
        ("3-D uniform", uniform(10**5, 3), threads),
        ("3-D uniform, torus", uniform(10**5, 3), torus),
        ("3-D Gaussian, sigma 1e-4", gaussian(10**5, 3), alone),
        ("3-D Cantor set", cantor(10**5, 3), alone),
    ]


def machine() -> str:
    """The processor's name."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def main() -> None:
    rows: list[list[object]] = []
    with tempfile.TemporaryDirectory() as folder:
        for name, points, programs in cases(Path(folder)):
            present = {program: run for program, run in programs.items() if run}
            least = dict.fromkeys(present, np.inf)
            for k in range(MOST_ROUNDS):
                for program, run in present.items():
                    if k < ROUNDS or least[program] < SHORT:
                        least[program] = min(least[program], run(points))
            n = points.size // points.shape[-1]
            for program, seconds in least.items():
                ratio = seconds / next(iter(least.values()))
                rows.append([name, n, program, f"{1e9 * seconds / n:.0f}", f"{ratio:.2f}"])
                print(*rows[-1], sep=", ", flush=True)
            write(rows)


def write(rows: list[list[object]]) -> None:
    versions = ", ".join(f"{name} {version(name)}" for name in PACKAGES if importlib.util.find_spec(name.split("-")[0]))
    with open(HERE / "results" / "cells_peers.csv", "w", newline="") as file:
        file.write(f"# {machine()}, {versions}\n")
        writer = csv.writer(file)
        writer.writerow(["points", "n", "program", "ns per point", "times voroquad"])
        writer.writerows(rows)


if __name__ == "__main__":
    main()
