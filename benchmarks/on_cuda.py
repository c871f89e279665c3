"""Every plug-in in every scene on an NVIDIA GPU: mean radiance against that of the processor, and times.

    python benchmarks/on_cuda.py [scene …]

Scene after scene goes to benchmarks/results/on_cuda.csv. Each setting renders SEEDS images of 160×120 pixels at SPP
samples per pixel in `llvm_ad_rgb` and in `cuda_ad_rgb` (`…_spectral` for the scene of wavelengths), of the same seeds:
`z` is the difference of the mean radiances over its standard error, by pairs of images. Seconds are medians, after a
first image that compiles. Without a GPU it says so in one line, and measures nothing.
"""

from __future__ import annotations

import gc
import sys
import time
from collections.abc import Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from csv_rows import put
from scene_measures import CASES, RESULTS, Case, Rows, Stage

from voroquad.mitsuba.loading import make_integrator, motion_of, own_integrator

SPP, SEEDS = 64, 8
COLUMNS = "scene,setting,llvm_mean,cuda_mean,z,llvm_seconds,cuda_seconds"


def settings(stage: Stage) -> dict[str, dict[str, Any]]:
    """Kind and properties of the plug-ins, by name."""
    case = stage.case
    sets = {
        f"reweighted {case.domain}": {"kind": "reweighted", "domain": case.domain},
        f"reweighted {case.domain}, owensobol": {
            "kind": "reweighted", "domain": case.domain, "all_else": {"type": "owensobol"},
        },
    }  # fmt: skip
    if stage.moves:
        return sets
    return sets | {
        "plain": {"kind": "plain"},
        "owensobol": {"kind": "plain", "sampler": {"type": "owensobol"}},
        "adaptive": {"kind": "plain", "adaptive": "balanced"},
    }


def means(case: Case, backend: str) -> dict[str, tuple[list[float], float]]:
    """Mean radiances of images by each setting, and the median of their seconds."""
    mi.set_variant(f"{backend}_ad_{'spectral' if case.spectral else 'rgb'}")
    stage = Stage(case, True)
    found = {}
    for name, setting in settings(stage).items():
        levels, seconds = [], []
        for seed in range(SEEDS + 1):
            moving = motion_of(stage.scene) if setting["kind"] == "reweighted" else {}
            integrator = make_integrator(nested=own_integrator(stage.scene), **setting, **moving)
            begun = time.perf_counter()
            image = stage.image(integrator, SPP, seed)
            dr.sync_thread()
            seconds.append(time.perf_counter() - begun)
            levels.append(float(image[np.isfinite(image)].mean()))
        found[name] = levels[1:], float(np.median(seconds[1:]))
    del stage
    gc.collect()
    return found


def rows_of(case: Case) -> Rows:
    """Rows of a scene."""
    here, there = means(case, "llvm"), means(case, "cuda")
    rows: Rows = []
    for name, (levels, seconds) in here.items():
        others, other_seconds = there[name]
        difference = np.subtract(others, levels)
        error = difference.std(ddof=1) / np.sqrt(SEEDS)
        z = difference.mean() / error if error > 0 else 0.0
        numbers = (np.mean(levels), np.mean(others), z, seconds, other_seconds)
        rows.append([case.scene, name, *(f"{number:.5g}" for number in numbers)])
    return rows


def place(row: Sequence[str]) -> tuple[int, str]:
    """Where a row stands in the table."""
    return [case.scene for case in CASES].index(row[0]), row[1]


if __name__ == "__main__":
    if not dr.has_backend(dr.JitBackend.CUDA):
        sys.exit("there is no CUDA here: an NVIDIA GPU and its driver are needed, nothing was measured")
    asked = sys.argv[1:] or [case.scene for case in CASES]
    for case in CASES:
        if case.scene in asked:
            put(RESULTS / "on_cuda.csv", COLUMNS.split(","), rows_of(case), place)
            print(case.scene, flush=True)
