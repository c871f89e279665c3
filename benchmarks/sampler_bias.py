"""No bias: means of many renders by `owensobol` and by adaptive sampling against references, pixel by pixel.

    python benchmarks/sampler_bias.py [scene …]

Scene after scene goes to benchmarks/results/sampler_bias.csv; what is there already is not measured again. The z-scores
and the test are those of `scene_bias`. The row `control` shares samples out by each pixel's own noise: a pixel stops
where its samples look good, so that its mean is too dark.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mitsuba as mi
import numpy as np
from scene_bias import COLUMNS, score
from scene_measures import CASES, Rows, Stage, run

from voroquad.mitsuba import allocation
from voroquad.mitsuba.loading import make_integrator, own_integrator

#: Samples of the pilot, half of those on average
PILOT = 8


def adaptive(stage: Stage) -> mi.Integrator:
    """Samples where a pilot finds noise; `pilot_seed` is the render's own, as one render has it."""
    return make_integrator("plain", own_integrator(stage.scene), adaptive="absolute", at_least=PILOT)


def own_noise(values: Any, others: Any) -> Any:
    """In place of `allocation._around`: the noise of each pixel itself."""
    return np.where(np.isfinite(values), values, 0.0)


def rows_of(stage: Stage) -> Rows:
    """Rows of a scene."""
    if stage.moves:
        return []
    makers: dict[str, Callable[[int], mi.Integrator]] = {
        "owensobol": lambda seed: stage.mitsubas("owensobol", seed),
        "adaptive": lambda seed: adaptive(stage),
    }
    rows = [score(stage, name, make) for name, make in makers.items()]
    around, allocation._around = allocation._around, own_noise
    try:
        rows.append(score(stage, "control: adaptive, own noise", makers["adaptive"]))
    finally:
        allocation._around = around
    return rows


if __name__ == "__main__":
    run("sampler_bias", COLUMNS, CASES, True, rows_of)
