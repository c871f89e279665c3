"""The examples of cells in domains beside what their fields use: processor time and difference.

    pip install -e '.[bench,geo,mri]' geopandas pykrige
    python benchmarks/use_peers.py                          (2 minutes; peers that are not there are left out)

Each example of docs/uses is run, and its points are given to a peer. Writes what examples print into
benchmarks/results/use_answers.csv, and into use_peers.csv the least processor time of interleaved runs on one thread,
and how far results differ. Measures of cells are compared one by one, relative to their mean. PyKrige and mri-nufft
answer the example's question in another way, so their answers are compared with the truth.
"""

from __future__ import annotations

import contextlib
import csv
import importlib.util
import io
import re
import runpy
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

import voroquad as vq

HERE = Path(__file__).parent
COLUMNS = "example,n,peer,compares,voroquad ms,peer ms,times voroquad,voroquad off by,peer off by,largest difference"
SHORT, ROUNDS = 2.0, 5  # a peer that takes longer, in seconds, runs once
ANSWERS: list[list[str]] = []
PACKAGES = ("voroquad", "geopandas", "pykrige", "freud-analysis", "pyvoro2", "mri-nufft")


@dataclass
class Use:
    """An example, a peer, and for both what they compute: measures of cells, or an answer with its truth."""

    example: str
    peer: str
    compares: str
    n: int
    ours: Callable[[], Any]
    theirs: Callable[[], Any]
    truth: float | None = None


def example(name: str) -> dict[str, Any]:
    """What an example has computed; what it prints is kept in ANSWERS."""
    sys.argv = [name]
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        found = runpy.run_path(str(HERE.parent / "examples" / f"{name}.py"))
    for line in printed.getvalue().splitlines():
        what, answer = re.fullmatch(r"(.*?)\s+(-?\d.*|volume \d.*)", line).groups()
        ANSWERS.append([name, what, answer])
    return found


def installed(name: str) -> bool:
    return importlib.util.find_spec(name) is not None


def rain_gauges() -> Iterator[Use]:
    if not installed("geopandas"):
        return
    import geopandas as gpd
    import shapely

    found = example("rain_gauges")
    gauges, area = found["gauges"], found["area"]

    def by_geopandas() -> np.ndarray:
        points = gpd.GeoSeries(shapely.points(gauges))
        pieces = gpd.GeoDataFrame(geometry=points.voronoi_polygons(extend_to=area))
        joined = gpd.GeoDataFrame(geometry=points).sjoin(pieces, predicate="within")["index_right"]
        return pieces.intersection(area).area.to_numpy()[joined.to_numpy()]

    yield Use(
        "Rain gauges",
        "GeoPandas",
        "areas",
        len(gauges),
        lambda: vq.weights(gauges, domain=area, threads=1),
        by_geopandas,
    )


def declustering() -> Iterator[Use]:
    if not installed("pykrige"):
        return
    from pykrige.ok import OrdinaryKriging

    found = example("declustering")
    holes, grades, sides = found["holes"], found["grades"], found["SIDES"]

    def by_kriging() -> float:
        """The mean of ordinary kriging on a grid of 4 m, with a variogram fitted to the samples."""
        krige = OrdinaryKriging(*holes.T, grades, variogram_model="spherical")
        x, y = (np.arange(low + 2, high, 4.0) for low, high in sides)
        return float(krige.execute("grid", x, y)[0].mean())

    def by_cells() -> float:
        w = vq.weights(holes, bounds=sides, threads=1)
        return float(w @ grades / w.sum())

    truth = float(found["fine"].mean())
    yield Use("Declustering", "PyKrige", "mean grade", len(holes), by_cells, by_kriging, truth)


def brillouin_zone() -> Iterator[Use]:
    if not installed("freud"):
        return
    import freud

    found = example("brillouin_zone")
    first, second = found["RECIPROCAL"]
    turn = np.array([first, [-first[1], first[0]]]) / np.linalg.norm(first)  # freud's first vector is along x
    (length, _), (shear, height) = (turn @ vector for vector in (first, second))
    box = freud.box.Box(Lx=length, Ly=abs(height), xy=shear / height, is2D=True)
    flip = np.array([1, np.sign(height)])
    points = np.column_stack([(found["k_points"] @ turn.T) * flip, np.zeros(len(found["k_points"]))])

    def by_freud() -> np.ndarray:
        return np.asarray(freud.locality.Voronoi().compute((box, box.wrap(points))).volumes)

    yield Use(
        "Brillouin zone",
        "freud",
        "areas",
        len(points),
        lambda: vq.weights(found["k_points"], cell=found["RECIPROCAL"], threads=1),
        by_freud,
    )


def particles() -> Iterator[Use]:
    found = example("particles")
    side, points = found["SIDE"], found["clustered"]

    def ours() -> np.ndarray:
        return vq.weights(points, bounds=(0, side), periodic=True, threads=1)

    if installed("pyvoro2"):
        import pyvoro2

        domain = pyvoro2.OrthorhombicCell([(0, side)] * 3, (True, True, True))
        none = {"return_vertices": False, "return_adjacency": False, "return_faces": False}
        compute = pyvoro2.compute
        yield Use(
            "Particles",
            "pyvoro2 (voro++)",
            "volumes",
            len(points),
            ours,
            lambda: np.asarray(compute(points, domain=domain, **none).cell_measures),
        )
    if installed("freud"):
        import freud

        box = freud.box.Box.cube(side)
        yield Use(
            "Particles",
            "freud",
            "volumes",
            len(points),
            ours,
            lambda: np.asarray(freud.locality.Voronoi().compute((box, points - side / 2)).volumes),
        )


def stack_of_spirals() -> Iterator[Use]:
    if not installed("mrinufft"):
        return
    from mrinufft.density import get_density

    found = example("stack_of_spirals")
    stack, at, measured = found["stack"], found["at"], found["measured"]

    def answer(w: np.ndarray) -> float:
        return float(found["brightness"](at[:1], at[1:], stack, w * measured).item())

    def scaled(w: np.ndarray) -> np.ndarray:
        """Weights of any scale, so that they sum to the cylinder as ours do."""
        return w * (np.pi / 4 / w.sum())

    for method in ("cell_count", "voronoi"):
        options = {"shape": (48, 48, 24)} if method == "cell_count" else {}
        density = get_density(method)
        yield Use(
            "Stack of spirals",
            f"mri-nufft, {method}",
            "brightness",
            len(stack),
            lambda: answer(vq.density_compensation(stack, threads=1)),
            lambda density=density, options=options: answer(scaled(np.asarray(density(stack, **options)))),
            float(found["truth"]),
        )


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    start = time.process_time()
    result = call()
    return result, time.process_time() - start


def row(use: Use) -> list[object]:
    """Least times of interleaved runs, and the differences."""
    (ours, our_time), (theirs, their_time) = timed(use.ours), timed(use.theirs)
    for _ in range(ROUNDS if their_time < SHORT else 0):
        our_time = min(our_time, timed(use.ours)[1])
        their_time = min(their_time, timed(use.theirs)[1])
    if use.truth is None:
        differences = ["", "", f"{np.abs(ours - theirs).max() / ours.mean():.1e}"]
    else:
        differences = [f"{ours / use.truth - 1:+.3f}", f"{theirs / use.truth - 1:+.3f}", ""]
    times = [f"{1e3 * our_time:.2f}", f"{1e3 * their_time:.1f}", f"{their_time / our_time:.1f}"]
    return [use.example, use.n, use.peer, use.compares, *times, *differences]


def main() -> None:
    rows: list[list[object]] = []
    if installed("freud"):
        import freud

        freud.parallel.set_num_threads(1)
    for uses in (rain_gauges, declustering, brillouin_zone, particles, stack_of_spirals):
        for use in uses():
            rows.append(row(use))
            print(*rows[-1], sep=", ", flush=True)
    versions = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    write("use_peers.csv", versions, COLUMNS.split(","), rows)
    write("use_answers.csv", versions, ["example", "what", "answer"], ANSWERS)


def write(name: str, versions: str, columns: list[str], rows: list[Any]) -> None:
    with open(HERE / "results" / name, "w", newline="") as file:
        file.write(f"# {versions}\n")
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(rows)


if __name__ == "__main__":
    main()
