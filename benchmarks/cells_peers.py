"""Time of cell measures beside peers, on the same points in the same run, one thread.

    python benchmarks/cells_peers.py                (2 minutes; needs voro++-dev and a C++ compiler for voro++)

Writes benchmarks/results/cells_peers.csv: nanoseconds of CPU time per point, the least of a few
interleaved runs. SciPy's columns are the diagram alone, without areas and without the border.
"""

from __future__ import annotations

import csv
import platform
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import scipy
from scipy.spatial import Delaunay, Voronoi

import voroquad as vq

HERE = Path(__file__).parent
ROUNDS = 3


def cpu_seconds(call: Callable[[], object]) -> float:
    start = time.process_time()
    call()
    return time.process_time() - start


def uniform(n: int, d: int) -> np.ndarray:
    return np.random.default_rng(1).random((n, d))


def gaussian(n: int, d: int) -> np.ndarray:
    return 0.5 + 1e-4 * np.random.default_rng(1).normal(size=(n, d))


def cantor(n: int, d: int) -> np.ndarray:
    digits = np.random.default_rng(1).integers(0, 2, (n, d, 30))
    return (2 * digits / 3.0 ** np.arange(1, 31)).sum(axis=-1)


def voroquad(points: np.ndarray) -> float:
    return cpu_seconds(lambda: vq.cells(points, threads=1).measures)


def voropp(program: Path) -> Callable[[np.ndarray], float]:
    def run(points: np.ndarray) -> float:
        with tempfile.TemporaryDirectory() as folder:
            source, target = Path(folder, "points"), Path(folder, "volumes")
            points.tofile(source)
            command = [str(program), str(len(points)), str(source), str(target)]
            seconds = float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
            error = np.abs(np.fromfile(target) - vq.cells(points, threads=1).measures).max()
            assert error < 1e-10, f"voro++ differs by {error:.1e}"
        return seconds

    return run


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        peers_in_space: dict[str, Callable[[np.ndarray], float]] = {"voroquad": voroquad}
        if shutil.which("c++"):
            program = Path(folder, "voropp")
            built = subprocess.run(
                ["c++", "-O3", "-std=c++17", str(HERE / "voropp.cpp"), "-o", str(program), "-lvoro++"], check=False
            )
            if built.returncode == 0:
                peers_in_space["voro++"] = voropp(program)
        peers_in_plane: dict[str, Callable[[np.ndarray], float]] = {
            "voroquad": voroquad,
            "scipy Voronoi": lambda x: cpu_seconds(lambda: Voronoi(x)),
            "scipy Delaunay": lambda x: cpu_seconds(lambda: Delaunay(x)),
        }
        on_a_line: dict[str, Callable[[np.ndarray], float]] = {
            "voroquad": voroquad,
            "numpy argsort": lambda x: cpu_seconds(lambda: np.argsort(x[:, 0])),
        }
        alone = {"voroquad": voroquad}
        cases = [
            ("1-D uniform", uniform(10**6, 1), on_a_line),
            ("2-D uniform", uniform(10**5, 2), peers_in_plane),
            ("2-D uniform", uniform(10**6, 2), alone),
            ("2-D Gaussian, sigma 1e-4", gaussian(10**5, 2), alone),
            ("2-D Cantor set", cantor(10**5, 2), alone),
            ("2-D 4096 sets of 64", uniform(4096 * 64, 2).reshape(4096, 64, 2), alone),
            ("3-D uniform", uniform(10**5, 3), peers_in_space),
            ("3-D Gaussian, sigma 1e-4", gaussian(10**5, 3), alone),
            ("3-D Cantor set", cantor(10**5, 3), alone),
        ]
        rows = []
        for name, points, peers in cases:
            least = dict.fromkeys(peers, np.inf)
            for _ in range(ROUNDS):
                for peer, run in peers.items():
                    least[peer] = min(least[peer], run(points))
            n = points.size // points.shape[-1]
            for peer, seconds in least.items():
                rows.append([name, n, peer, f"{1e9 * seconds / n:.0f}", f"{seconds / least['voroquad']:.2f}"])
                print(*rows[-1], sep=", ", flush=True)
    with open(HERE / "results" / "cells_peers.csv", "w", newline="") as file:
        file.write(
            f"# {platform.machine()}, NumPy {np.__version__}, SciPy {scipy.__version__}, voroquad {vq.__version__}\n"
        )
        writer = csv.writer(file)
        writer.writerow(["points", "n", "program", "ns per point", "times voroquad"])
        writer.writerows(rows)


if __name__ == "__main__":
    main()
