"""What `reweighted` costs: its render time over that of the nested integrator, in interleaved pairs.

    python benchmarks/render_overhead.py [--pairs 21] [--size 320x240] [--spp 64]

Both render the scene depth-of-field with the same sampler and jitter; the table is made and the kernels are compiled
by two warm-up renders before the clock starts. Writes benchmarks/results/render_overhead.csv: a line per pair, and
prints the median ratio with the interval between the order statistics that cover it with at least 95 %.
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
from scipy import stats

from voroquad.mitsuba.render import load_scene, make_integrator, own_integrator, parse_size

RESULT = Path(__file__).parent / "results" / "render_overhead.csv"


def seconds(scene: mi.Scene, integrator: mi.Integrator, spp: int, seed: int) -> float:
    """Wall-clock time of one render, kernels finished."""
    dr.sync_thread()
    start = time.perf_counter()
    dr.eval(mi.render(scene, integrator=integrator, spp=spp, seed=seed))
    dr.sync_thread()
    return time.perf_counter() - start


def median_interval(ratios: np.ndarray, level: float = 0.95) -> tuple[float, float]:
    """Distribution-free interval of the median (binomial order statistics)."""
    k = int(stats.binom.ppf((1 - level) / 2, len(ratios), 0.5))
    ordered = np.sort(ratios)
    return float(ordered[max(k - 1, 0)]), float(ordered[min(len(ratios) - k, len(ratios) - 1)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=21)
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--spp", type=int, default=64)
    options = parser.parse_args()

    scene = load_scene("depth-of-field", parse_size(options.size))
    nested = own_integrator(scene)
    reweighted = make_integrator("reweighted", nested)
    for warm_up in range(2):
        for integrator in (nested, reweighted):
            seconds(scene, integrator, options.spp, warm_up)

    times = []
    for pair in range(options.pairs):
        both = [nested, reweighted]
        measured = {}
        for k in (0, 1) if pair % 2 == 0 else (1, 0):
            measured[k] = seconds(scene, both[k], options.spp, 2 + pair)
        times.append((measured[0], measured[1]))
    RESULT.parent.mkdir(exist_ok=True)
    with RESULT.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["pair", "nested_seconds", "reweighted_seconds", "ratio"])
        writer.writerows([k, f"{a:.4f}", f"{b:.4f}", f"{b / a:.4f}"] for k, (a, b) in enumerate(times))
    ratios = np.array([b / a for a, b in times])
    low, high = median_interval(ratios)
    print(f"{options.pairs} pairs at {options.size}, {options.spp} spp: median ratio {np.median(ratios):.4f}, "
          f"95 % interval {low:.4f} to {high:.4f}")  # fmt: skip


if __name__ == "__main__":
    main()
