"""No bias: means of many renders by every setting that samples the whole path, in every scene, pixel by pixel.

    python benchmarks/sampler_bias.py [scene …]

Row after row goes to benchmarks/results/sampler_bias.csv; what is there already is not measured again. The films have
32×24 pixels; the z-scores and the test are those of `scene_bias`, which tests the rules for weights. Each row is 64
renders of 16 samples per pixel, those of adaptive settings with a pilot of 8. The row `control` shares samples out by
each pixel's own noise: a pixel stops where its samples look good, so that its mean is too dark.

A setting is called unbiased if its values pass Mitsuba's test, and the mean z of all values is within `MOST` of its
standard errors of what the skewness of the noise makes of it.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import mitsuba as mi
import numpy as np
from csv_rows import put
from scene_bias import COLUMNS, RULES, score
from scene_measures import CASES, RESULTS, Rows, Stage, on_stage

from voroquad.mitsuba import allocation
from voroquad.mitsuba.loading import make_integrator, own_integrator

SIZE = (32, 24)
#: Samples of the pilot, half of those on average
PILOT = 8
#: Standard errors of the mean z
MOST = 5.0
TABLE = RESULTS / "sampler_bias.csv"
CONTROL = "control: adaptive, own noise"
SETTINGS = (
    "owensobol", "owensobol, joe-kuo", "owensobol, order none", "weights and owensobol", "adaptive, balanced",
    "adaptive, absolute", "adaptive, relative", CONTROL,
)  # fmt: skip


def adaptive(stage: Stage, kind: str) -> mi.Integrator:
    """Samples where a pilot finds noise; `pilot_seed` is the render's own, as one render has it."""
    return make_integrator("plain", own_integrator(stage.scene), adaptive=kind, at_least=PILOT)


def own_noise(values: Any, others: Any) -> Any:
    """In place of `allocation._around`: the noise of each pixel itself."""
    return np.where(np.isfinite(values), values, 0.0)


def maker(stage: Stage, setting: str) -> Callable[[int], mi.Integrator] | None:
    """What makes the integrator of a render by its seed; None if objects move, which adaptive samples cannot."""
    if setting.startswith("owensobol"):
        named = {"": {}, ", joe-kuo": {"generators": "joe-kuo"}, ", order none": {"order": "none"}}
        properties = named[setting.removeprefix("owensobol")]
        return lambda seed: stage.mitsubas("owensobol", seed, **properties)
    if setting.startswith("weights"):
        design, rule = RULES[stage.case.domain]
        return lambda seed: stage.sets(stage.case.domain, design, seed, "owensobol", **rule)
    kind = "absolute" if setting == CONTROL else setting.removeprefix("adaptive, ")  # another name is refused
    return None if stage.moves else lambda seed: adaptive(stage, kind)


def measure(stage: Stage, settings: Sequence[str]) -> Rows:
    """Write the rows of a scene one by one."""
    for setting in settings:
        if (make := maker(stage, setting)) is None:
            continue
        around = allocation._around
        allocation._around = own_noise if setting == CONTROL else around
        try:
            row = [str(entry) for entry in score(stage, setting, make)]
        finally:
            allocation._around = around
        mean, error, skewed = (float(row[COLUMNS.split(",").index(n)]) for n in ("mean_z", "mean_z_error", "skewed_z"))
        if abs(mean - skewed) > MOST * error:
            row[-1] = "no"
        put(TABLE, COLUMNS.split(","), [row], place)
        print(*row, flush=True)
    return []


def place(row: Sequence[str]) -> tuple[int, int]:
    """Where a row stands in the table."""
    return [case.scene for case in CASES].index(row[0]), SETTINGS.index(row[2])


def known() -> set[tuple[str, str]]:
    """Scenes and settings of the rows that are there."""
    if not TABLE.exists():
        return set()
    with TABLE.open(newline="", encoding="utf-8") as file:
        return {(row["scene"], row["rule"]) for row in csv.DictReader(file)}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=[case.scene for case in CASES], metavar="scene")
    there = known()
    for case in (case for name in parser.parse_args().scenes for case in CASES if case.scene == name):
        if left := [setting for setting in SETTINGS if (case.scene, setting) not in there]:
            on_stage(case, True, partial(measure, settings=left), SIZE)
