"""Time of cell measures beside peers, on the same points in the same run.

    pip install -e '.[bench]' geogram; apt-get install voro++-dev libcgal-dev   (and a C++ compiler; cargo for Rust)
    python benchmarks/cells_peers.py                          (15 minutes; peers that are not there are left out)
    python benchmarks/cells_peers.py cells_threads            (one of cells_peers, cells_threads, cells_curves)

Writes benchmarks/results/cells_peers.csv: nanoseconds per point, the least of three interleaved runs, of fifteen where
one takes less than two seconds, on one thread and of CPU time. SciPy's columns, delaunator, spade, CGAL and geogram are
the diagram or the triangulation alone, without measures and without the border. All measures that a peer returns are
compared with voroquad's.

cells_threads.csv has wall times on a machine that does nothing else: of one thread, of two, and of two processes, each
with points of its own on one thread, which share nothing but the processor and its memory. Two processes are what the
hardware allows, and their time per point counts the points of both.

cells_curves.csv has points on circles, spheres, and tilted lines and planes; peers get the smaller sets only. SciPy
moves the points a little (QJ), since Qhull refuses those of a line.

Programs in C++ are compiled with CPP_FLAGS, those in Rust with RUST_FLAGS and link-time optimization.
`--only WORD` runs the cases whose name contains the word, and writes no file.
"""

from __future__ import annotations

import argparse
import csv
import importlib.util
import multiprocessing
import os
import platform
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from importlib.metadata import version
from multiprocessing.synchronize import Barrier
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from scipy.spatial import Delaunay, Voronoi

import voroquad as vq

HERE = Path(__file__).parent
ROUNDS, MOST_ROUNDS = 3, 15
SHORT = 2.0  # seconds; a program that takes less runs in all rounds
CPP_FLAGS = ("-O3", "-march=native", "-DNDEBUG")
RUST_FLAGS = "-C opt-level=3 -C target-cpu=native"
PACKAGES = ("voroquad", "numpy", "scipy", "pyvoro2", "freud-analysis")

Result = TypeVar("Result")
Program = Callable[[np.ndarray], float]  # points (n, d) or (sets, n, d): seconds
Case = tuple[str, np.ndarray, dict[str, Program | None]]
FEW = 10**4  # points on curves that peers get


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


def circle(n: int, d: int) -> np.ndarray:
    """Points on a circle or sphere, rounded."""
    ways = np.random.default_rng(1).normal(size=(n, d))
    return 0.5 + 0.3 * ways / np.linalg.norm(ways, axis=1, keepdims=True)


def line(n: int, d: int) -> np.ndarray:
    """Points on a tilted line, rounded."""
    return 0.1 + 0.8 * uniform(n, 1) * np.array([1.0, 0.61, 0.37])[:d]


def plane(n: int, d: int) -> np.ndarray:
    """Points on a tilted plane, rounded."""
    u = uniform(n, 2)
    return 0.1 + 0.4 * np.column_stack([u, u @ np.array([0.7, 0.3])])


# ---------------------------------------------------------------------- programs


def voroquad(points: np.ndarray) -> float:
    return cpu_seconds(lambda: vq.cells(points, threads=1).measures)


def voroquad_torus(points: np.ndarray) -> float:
    return cpu_seconds(lambda: vq.cells(points, periodic=True, threads=1).measures)


def made(method: str, then: Callable[[object], object] = lambda result: result) -> Program:
    """A method of cells, on one thread, and what is done with its result."""
    return lambda points: cpu_seconds(lambda: then(getattr(vq.cells(points, threads=1), method)()))


def in_box(high: float) -> Program:
    """Cells of the same points in the box [0, high]^d."""
    return lambda points: cpu_seconds(lambda: vq.cells(points, bounds=(0, high), threads=1).measures)


def on_threads(threads: int) -> Program:
    def run(points: np.ndarray) -> float:
        start = time.perf_counter()
        vq.cells(points, threads=threads).measures  # noqa: B018
        return time.perf_counter() - start

    return run


def in_processes(processes: int) -> Program:
    """The same in processes at once, each on one thread: seconds until all end, over their number."""

    def measure(points: np.ndarray, start: Barrier, spans: Any) -> None:
        vq.cells(points, threads=1).measures  # noqa: B018  # memory is fetched from the system as in later runs
        start.wait()
        begin = time.perf_counter()  # one clock for all
        vq.cells(points, threads=1).measures  # noqa: B018
        spans.put((begin, time.perf_counter()))

    def run(points: np.ndarray) -> float:
        context = multiprocessing.get_context("fork")
        start, spans = context.Barrier(processes), context.SimpleQueue()
        workers = [context.Process(target=measure, args=(points, start, spans)) for _ in range(processes)]
        for worker in workers:
            worker.start()
        begins, ends = zip(*(spans.get() for _ in workers), strict=True)
        for worker in workers:
            worker.join()
        return (max(ends) - min(begins)) / processes

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


def compiled(name: str, folder: Path, *libraries: str) -> Path | None:
    """The program of a C++ file of this folder, if its library is installed."""
    if not shutil.which("c++"):
        return None
    program = folder / name
    build = ["c++", *CPP_FLAGS, "-std=c++17", str(HERE / f"{name}.cpp"), "-o", str(program), *libraries]
    return None if subprocess.run(build, check=False, capture_output=True).returncode else program


def crate(name: str, program: str, folder: Path) -> Path | None:
    """The program of a Rust package of this folder, if there is cargo."""
    if not shutil.which("cargo"):
        return None
    manifest, target = HERE / name / "Cargo.toml", folder / "rust"
    build = ["cargo", "build", "--quiet", "--release", f"--manifest-path={manifest}", f"--target-dir={target}"]
    environment = {**os.environ, "RUSTFLAGS": RUST_FLAGS}
    return None if subprocess.run(build, check=False, env=environment).returncode else target / "release" / program


def voropp(folder: Path) -> Program | None:
    """voro++ as a library."""
    program = compiled("voropp", folder, "-lvoro++")
    if not program:
        return None

    def run(points: np.ndarray) -> float:
        source, target = folder / "points", folder / "volumes"
        points.tofile(source)
        seconds = float(output_of(program, len(points), source, target))
        agree(np.fromfile(target), points)
        return seconds

    return run


def triangulation(name: str, folder: Path, *command: object, in_any_place: bool = False) -> Program:
    """A program that prints seconds and the number of triangles or tetrahedra of a file of points.

    The number is checked, except for points that may lie in any place, such as on a line.
    """

    def run(points: np.ndarray) -> float:
        n, d = points.shape
        source = folder / "points"
        points.tofile(source)
        seconds, simplices = output_of(*command, source).split()
        # In the plane almost two for each point; in space 6.77 of uniform points away from the border
        least, most = (1.95 * n, 2 * n) if d == 2 else (6 * n, 7 * n)
        if not (in_any_place or least < int(simplices) < most):
            raise SystemExit(f"{name} made {simplices} simplices of {n} points")
        return float(seconds)

    return run


def triangulating_crate(name: str, folder: Path) -> Program | None:
    """Delaunay triangulation in the plane by the Rust crates delaunator and spade."""
    program = crate(name, f"{name}-time", folder)
    return triangulation(name, folder, program) if program else None


def cgal(folder: Path, in_any_place: bool = False) -> dict[int, Program]:
    """Delaunay triangulation by CGAL, by dimension."""
    program = compiled("cgal", folder, "-lgmp", "-lmpfr")
    dimensions = (2, 3) if program else ()
    return {d: triangulation("CGAL", folder, program, d, in_any_place=in_any_place) for d in dimensions}


def geogram(folder: Path) -> dict[int, Program]:
    """The same by geogram; the wheel of its Python binding holds the library and its headers."""
    binding = importlib.util.find_spec("geogram")
    if binding is None or binding.origin is None:
        return {}
    site = Path(binding.origin).parent.parent
    bundled = site / "geogram.libs"
    library = [f"-I{site / 'include' / 'geogram1'}", f"-L{site / 'lib64'}", "-lgeogram", "-fopenmp", "-pthread", "-ldl"]
    needs = [*map(str, bundled.glob("libtbb*")), f"-Wl,-rpath,{bundled}"]
    program = compiled("geogram", folder, *library, *needs)
    return {d: triangulation("geogram", folder, program, d) for d in (2, 3)} if program else {}


def meshless_voronoi(folder: Path) -> Program | None:
    """Volumes by the Rust crate."""
    program = crate("meshless_voronoi", "meshless-time", folder)
    if not program:
        return None

    def run(points: np.ndarray) -> float:
        source, target = folder / "points", folder / "volumes"
        points.tofile(source)
        seconds = float(output_of(program, source, target))
        agree(np.fromfile(target), points)
        return seconds

    return run


def output_of(*command: object) -> str:
    return subprocess.run([str(c) for c in command], check=True, capture_output=True, text=True).stdout


# ---------------------------------------------------------------------- the run


STRUCTURE: dict[int, dict[str, Program | None]] = {
    2: {
        "measures": voroquad,
        "polygons()": made("polygons"),
        "list(polygons())": made("polygons", list),
        "neighbours()": made("neighbours"),
    },
    3: {
        "measures": voroquad,
        "polyhedra()": made("polyhedra"),
        "list(polyhedra())": made("polyhedra", list),
        "neighbours()": made("neighbours"),
    },
}


def on_two_threads(folder: Path) -> list[Case]:
    """What two threads gain, beside two processes."""
    programs: dict[str, Program | None] = {
        "voroquad, 1 thread": on_threads(1),
        "voroquad, 2 threads": on_threads(2),
        "voroquad, 2 processes": in_processes(2),
    }
    return [
        ("2-D uniform", uniform(10**6, 2), programs),
        ("2-D 4096 sets of 64", uniform(4096 * 64, 2).reshape(4096, 64, 2), programs),
        ("3-D uniform", uniform(10**5, 3), programs),
    ]


def on_curves(folder: Path) -> list[Case]:
    """Points on circles, spheres, lines and planes; by peers as many as they take in some seconds."""
    by_cgal = cgal(folder, in_any_place=True)
    alone: dict[str, Program | None] = {"voroquad": voroquad}
    in_plane: dict[str, Program | None] = {
        "voroquad": voroquad,
        "scipy Voronoi": lambda x: cpu_seconds(lambda: Voronoi(x, qhull_options="Qbb Qc Qz QJ")),
        "CGAL Delaunay": by_cgal.get(2),
    }
    in_space: dict[str, Program | None] = {
        "voroquad": voroquad,
        "voro++": voropp(folder),
        "CGAL Delaunay": by_cgal.get(3),
    }
    shapes = [("circle", circle, 2, in_plane), ("tilted line", line, 2, in_plane)]
    shapes += [
        ("sphere", circle, 3, in_space),
        ("tilted line", line, 3, in_space),
        ("tilted plane", plane, 3, in_space),
    ]
    return [
        (f"{d}-D {name}", draw(n, d), beside if n == FEW else alone)
        for name, draw, d, beside in shapes
        for n in (FEW, 4 * FEW)
    ]


def cases(folder: Path) -> list[Case]:
    """Names, points and programs; the first program is what the others are compared with."""
    by_cgal, by_geogram = cgal(folder), geogram(folder)
    alone: dict[str, Program | None] = {"voroquad": voroquad}
    beside_uniform: dict[str, Program | None] = {
        "voroquad": voroquad,
        "voroquad, uniform points": lambda x: voroquad(uniform(*x.shape)),
    }
    torus: dict[str, Program | None] = {
        "voroquad": voroquad_torus,
        "freud": freud if importlib.util.find_spec("freud") else None,
    }
    pyvoro = pyvoro2 if importlib.util.find_spec("pyvoro2") else None
    in_plane: dict[str, Program | None] = {
        "voroquad": voroquad,
        "scipy Voronoi": lambda x: cpu_seconds(lambda: Voronoi(x)),
        "scipy Delaunay": lambda x: cpu_seconds(lambda: Delaunay(x)),
        "delaunator": triangulating_crate("delaunator", folder),
        "spade": triangulating_crate("spade", folder),
        "CGAL Delaunay": by_cgal.get(2),
        "geogram Delaunay": by_geogram.get(2),
    }
    in_space: dict[str, Program | None] = {
        "voroquad": voroquad,
        "voro++": voropp(folder),
        "meshless_voronoi": meshless_voronoi(folder),
        "CGAL Delaunay": by_cgal.get(3),
        "geogram Delaunay": by_geogram.get(3),
        "pyvoro2": pyvoro,
    }
    boxes: dict[str, Program | None] = {"voroquad": voroquad, "voroquad, bounds=(0, 1)": in_box(1.0)}
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
        ("2-D uniform, box", uniform(10**6, 2), boxes),
        ("2-D Gaussian, sigma 1e-4", gaussian(10**5, 2), beside_uniform),
        ("2-D Cantor set", cantor(10**5, 2), beside_uniform),
        ("2-D 4096 sets of 64", small_sets, alone),
        ("3-D uniform", uniform(10**5, 3), in_space),
        ("3-D uniform", uniform(10**6, 3), alone),
        ("2-D structure", uniform(10**5, 2), STRUCTURE[2]),
        ("3-D structure", uniform(10**5, 3), STRUCTURE[3]),
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


#: The files, and what they have
FILES: dict[str, Callable[[Path], list[Case]]] = {
    "cells_peers": cases,
    "cells_threads": on_two_threads,
    "cells_curves": on_curves,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", choices=[*FILES, []], help="what to measure; all by default")
    parser.add_argument("--only", default="", help="cases whose name contains this; writes no file")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.files or FILES:
            measure(name, FILES[name](Path(folder)), arguments.only)


def measure(file: str, measured: list[Case], only: str) -> None:
    """Time the programs of each case in turn, and write the file unless only some cases are wanted."""
    rows: list[list[object]] = []
    for name, points, programs in measured:
        if only not in name:
            continue
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
        if not only:
            write(file, rows)


def write(file: str, rows: list[list[object]]) -> None:
    versions = ", ".join(f"{name} {version(name)}" for name in PACKAGES if importlib.util.find_spec(name.split("-")[0]))
    with open(HERE / "results" / f"{file}.csv", "w", newline="") as target:
        target.write(f"# {machine()}, {versions}\n")
        writer = csv.writer(target)
        writer.writerow(["points", "n", "program", "ns per point", "times voroquad"])
        writer.writerows(rows)


if __name__ == "__main__":
    main()
