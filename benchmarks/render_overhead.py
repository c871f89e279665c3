"""What `reweighted` costs: its render time and memory over those of the nested integrator, in interleaved pairs.

    python benchmarks/render_overhead.py [--pairs 31] [--size 320x240] [--spp 64] [--scenes moving-camera room]

For each domain a scene; both integrators render it with the same sampler and jitter, `reweighted` with its default
settings, or with the samples that the scene's own sampler draws: blend, and all that makes an image of it, are part of
its time. The table is made and the kernels are compiled by two warm-up renders before the clock starts. Writes
benchmarks/results/render_overhead.csv, a line per pair with seconds by the clock and of the processor, and
benchmarks/results/render_memory.csv: the most memory of a new process that renders once by the one or by the other, its
kernel compiled by a process before it. Lines of scenes that are not measured stay. Prints for each domain the median
ratios with the interval between the order statistics that cover them with at least 95 %. Objects that move in slices
are not among the scenes: Mitsuba has no integrator to compare them with.
"""

from __future__ import annotations

import argparse
import gc
import multiprocessing
import resource
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
from csv_rows import put
from scipy import stats

from voroquad.mitsuba.loading import (
    SPECTRAL_VARIANT,
    VARIANT,
    load_scene,
    make_integrator,
    own_integrator,
    parse_size,
)

RESULTS = Path(__file__).parent / "results"
SCENES = {
    "depth-of-field": "lens",
    "moving-camera": "time",
    "spectral": "wavelength",
    "large-light": "light",
    "sky": "light",
    "sky, own samples": "light",
    "room": "lens",
    "passage": "pixel+time",
}
TIMES = ["scene", "domain", "pair", "nested_seconds", "reweighted_seconds", "nested_cpu", "reweighted_cpu"]
MEMORY = ["scene", "domain", "nested_megabytes", "reweighted_megabytes", "ratio"]

Lines = list[list[object]]


def cost(scene: mi.Scene, integrator: mi.Integrator, spp: int, seed: int) -> tuple[float, float]:
    """Seconds by the clock and of the processor of one render with its kernels finished."""
    dr.sync_thread()
    start, start_cpu = time.perf_counter(), time.process_time()
    dr.eval(mi.render(scene, integrator=integrator, spp=spp, seed=seed))
    dr.sync_thread()
    return time.perf_counter() - start, time.process_time() - start_cpu


def median_interval(ratios: np.ndarray, level: float = 0.95) -> tuple[float, float]:
    """Distribution-free interval of the median (binomial order statistics)."""
    k = int(stats.binom.ppf((1 - level) / 2, len(ratios), 0.5))
    ordered = np.sort(ratios)
    return float(ordered[max(k - 1, 0)]), float(ordered[min(len(ratios) - k, len(ratios) - 1)])


def staged(name: str, size: str) -> tuple[mi.Scene, list[mi.Integrator]]:
    """A scene, and the integrators: its own, and that inside `reweighted`."""
    domain = SCENES[name]
    mi.set_variant(SPECTRAL_VARIANT if domain == "wavelength" else VARIANT)
    scene_name, _, own = name.partition(", ")
    scene = load_scene(scene_name, parse_size(size), domain)
    nested = own_integrator(scene)
    properties = {"sampler": "scene", "debias": "none"} if own else {}
    return scene, [nested, make_integrator("reweighted", nested, domain=domain, **properties)]


def time_pairs(name: str, options: argparse.Namespace) -> Lines:
    """The lines of a scene."""
    scene, both = staged(name, options.size)
    for warm_up in range(2):
        for integrator in both:
            cost(scene, integrator, options.spp, warm_up)
    lines: Lines = []
    for pair in range(options.pairs):
        measured = {k: cost(scene, both[k], options.spp, 2 + pair) for k in ((0, 1) if pair % 2 == 0 else (1, 0))}
        seconds, cpu = zip(measured[0], measured[1], strict=True)
        lines.append([name, SCENES[name], pair, *(f"{t:.4f}" for t in (*seconds, *cpu))])
    return lines


def megabytes(name: str, which: int, size: str, spp: int) -> float:
    """The most memory that this process has held after one render."""
    scene, both = staged(name, size)
    cost(scene, both[which], spp, 0)
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def memory(name: str, options: argparse.Namespace) -> list[object]:
    """The line of a scene: of new processes, the second for each integrator."""
    new = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=new, max_tasks_per_child=1) as pool:
        held = [pool.submit(megabytes, name, k, options.size, options.spp) for k in (0, 1, 0, 1)]
        *_, nested, ours = (process.result() for process in held)
    return [name, SCENES[name], f"{nested:.1f}", f"{ours:.1f}", f"{ours / nested:.4f}"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=31)
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=SCENES, help="some of them")
    options = parser.parse_args()

    names = list(SCENES)
    for name in options.scenes:
        held = memory(name, options)
        own = time_pairs(name, options)
        gc.collect()  # a scene that exists slows every later render
        text = f"{name} ({SCENES[name]}): memory {held[-1]}"
        for what, below, above in (("time", 3, 4), ("processor time", 5, 6)):
            ratios = np.array([float(str(line[above])) / float(str(line[below])) for line in own])
            low, high = median_interval(ratios)
            text += f"; {what} {np.median(ratios):.4f}, {low:.4f} to {high:.4f}"
        print(text, flush=True)
        put(RESULTS / "render_overhead.csv", TIMES, own, lambda row: names.index(row[0]))
        put(RESULTS / "render_memory.csv", MEMORY, [held], lambda row: names.index(row[0]))


if __name__ == "__main__":
    main()
