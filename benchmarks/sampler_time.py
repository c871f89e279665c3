"""What the sampler ``owensobol`` and adaptive sampling cost: draws, and whole renders, beside those of `multijitter`.

    python benchmarks/sampler_time.py [--pairs 15] [--size 240x180] [--spp 64] [--again] [scene …]

First the nanoseconds of a pair of coordinates (`next_2d`) of each sampler, in turns: benchmarks/results/
sampler_draws.csv. Then renders of each scene by `multijitter`, `owensobol` and adaptive samples, in turns and in
alternating order, after two that compile: benchmarks/results/sampler_time.csv, a line per turn with the seconds by the
clock and of the processor. What is there already, by as many turns, is not measured again without `--again`. Prints the
median of the ratios in each turn, with the interval between the order statistics that cover it with at least 95 %, and
what an adaptive sample costs over one of `owensobol`, which the pilot of a render reckons with (`methods.ADAPTIVE`).
"""

from __future__ import annotations

import argparse
import csv
import gc
import time
from collections.abc import Callable

import drjit as dr
import mitsuba as mi
import numpy as np
from csv_rows import put
from render_overhead import median_interval
from scene_measures import CASES, RESULTS, Rows, Stage, on_stage

from voroquad.mitsuba.loading import VARIANT, make_integrator, own_integrator, parse_size

SAMPLERS = ("independent", "stratified", "ldsampler", "multijitter", "owensobol")
#: Lanes of a wavefront, pairs of coordinates that each draws, and samples per pixel
LANES, DRAWS, SPP = 2**20, 16, 64
SETTINGS = ("multijitter", "owensobol", "adaptive")
DRAWN, TIMES = RESULTS / "sampler_draws.csv", RESULTS / "sampler_time.csv"
DRAW_COLUMNS = ("sampler", "turn", "nanoseconds")
TIME_COLUMNS = ("scene", "turn", *(f"{name}_{kind}" for name in SETTINGS for kind in ("seconds", "cpu")))


def draw(sampler: mi.Sampler, seed: int) -> None:
    """Draw what a wavefront of camera and light samples draws, in one kernel."""
    sampler.seed(dr.opaque(mi.UInt32, seed), LANES)
    total = mi.Float(0)
    for _ in range(DRAWS):
        total += dr.sum(mi.Point2f(sampler.next_2d()))
    dr.eval(total)


def seconds(work: Callable[[], object]) -> tuple[float, float]:
    """Seconds by the clock and of the processor."""
    dr.sync_thread()
    start, start_cpu = time.perf_counter(), time.process_time()
    work()
    dr.sync_thread()
    return time.perf_counter() - start, time.process_time() - start_cpu


def time_draws(turns: int) -> Rows:
    """Processor time of a pair of coordinates by each sampler, in turns."""
    mi.set_variant(VARIANT)
    size = {"width": 2**7, "height": LANES // SPP // 2**7}
    made = {name: {"type": name, "sample_count": SPP} | (size if name == "owensobol" else {}) for name in SAMPLERS}
    samplers = {name: mi.load_dict(properties) for name, properties in made.items()}
    rows: Rows = []
    for turn in range(-2, turns):
        for name, sampler in samplers.items():
            _, cpu = seconds(lambda sampler=sampler, turn=turn: draw(sampler, turn + 2))
            rows += [[name, turn, f"{1e9 * cpu / LANES / DRAWS:.3f}"]] if turn >= 0 else []
    return rows


def time_renders(stage: Stage, turns: int, spp: int) -> Rows:
    """The lines of a scene."""
    adaptive = make_integrator("plain", own_integrator(stage.scene), adaptive="balanced")
    integrators = {name: stage.mitsubas(name, 1) for name in SETTINGS[:2]} | {"adaptive": adaptive}
    rows: Rows = []
    for turn in range(-2, turns):
        order = SETTINGS if turn % 2 else SETTINGS[::-1]
        found = {
            name: seconds(lambda name=name, turn=turn: stage.image(integrators[name], spp, turn + 2)) for name in order
        }
        times = [f"{value:.4f}" for name in SETTINGS for value in found[name]]
        rows += [[stage.case.scene, turn, *times]] if turn >= 0 else []
    return rows


def told(rows: list[dict[str, str]], above: str, below: str) -> str:
    """The median of ratios with its interval."""
    ratios = np.array([float(row[above]) / float(row[below]) for row in rows])
    low, high = median_interval(ratios)
    return f"{above} over {below} {np.median(ratios):.3f}, {low:.3f} to {high:.3f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=15)
    parser.add_argument("--size", default="240x180")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--again", action="store_true")
    still = [
        case.scene for case in CASES if case.scene != "moving-objects"
    ]  # whose slices adaptive samples do not know
    parser.add_argument("scenes", nargs="*", default=still, metavar="scene")
    options = parser.parse_args()

    def known(scene: str) -> list[dict[str, str]]:
        if not TIMES.exists():
            return []
        with TIMES.open(newline="", encoding="utf-8") as file:
            return [row for row in csv.DictReader(file) if row["scene"] == scene]

    if options.again or not DRAWN.exists():
        put(DRAWN, DRAW_COLUMNS, time_draws(options.pairs), lambda row: (SAMPLERS.index(row[0]), int(row[1])))
    with DRAWN.open(newline="", encoding="utf-8") as file:
        drawn = list(csv.DictReader(file))
    for name in SAMPLERS:
        print(name, f"{np.median([float(row['nanoseconds']) for row in drawn if row['sampler'] == name]):.2f} ns")
    cases = {case.scene: case for case in CASES}
    costs = []
    for scene in options.scenes:
        if options.again or len(known(scene)) < options.pairs:
            size = parse_size(options.size)
            rows = on_stage(cases[scene], True, lambda s: time_renders(s, options.pairs, options.spp), size)
            put(TIMES, TIME_COLUMNS, rows, lambda row: (list(cases).index(row[0]), int(row[1])))
            gc.collect()
        rows_of_scene = known(scene)
        for kind in ("seconds", "cpu"):
            print(
                scene,
                told(rows_of_scene, f"owensobol_{kind}", f"multijitter_{kind}"),
                told(rows_of_scene, f"adaptive_{kind}", f"owensobol_{kind}"),
                sep="; ",
                flush=True,
            )
        costs.append(np.median([float(row["adaptive_cpu"]) / float(row["owensobol_cpu"]) for row in rows_of_scene]))
    print(f"cost of adaptive samples, geometric mean over the scenes: {np.exp(np.log(costs).mean()):.3f}")


if __name__ == "__main__":
    main()
