"""What the pilot of `voroquad render` finds in each scene, beside the errors of whole images (samplers.py).

    python benchmarks/auto_setting.py [--spp 16,64,256] [scene …]

Row after row goes to benchmarks/results/auto_setting.csv; what is there already is not measured again. Each row is a
candidate: its variance per second over that of the first one, the geometric mean over SEEDS pilots (`predicted`); how
many of them took it (`taken`); the pilot's samples over those of the image (`pilot`); and what the pilot reckons that a
sample of the candidate costs (`cost`). Images have 160×120 pixels.
"""

from __future__ import annotations

import argparse
import csv
from functools import partial

import mitsuba as mi
import numpy as np
from csv_rows import put
from scene_measures import CASES, RESULTS, Rows, Stage, on_stage

from voroquad._support.checks import whole_numbers
from voroquad.mitsuba import pilot
from voroquad.mitsuba.default_domain import known_domain
from voroquad.mitsuba.methods import Stage as Shared
from voroquad.mitsuba.rounds import pilot_seed

SEEDS = 8
TABLE = RESULTS / "auto_setting.csv"
COLUMNS = ("scene", "spp", "candidate", "predicted", "taken", "pilots", "pilot", "cost")


def rows_of(stage: Stage, spp: int) -> Rows:
    """Rows of a scene; of one whose objects move the setting without a pilot."""
    sensor = stage.scene.sensors()[0]
    own = Shared(stage.scene, sensor, known_domain(stage.scene, sensor, jitter=True), True)
    methods = pilot.candidates(own, [spp])
    if not methods:
        return [[stage.case.scene, spp, f"weights-{own.domain}", 1, SEEDS, SEEDS, 0, 1]]
    step = pilot.pilot_step(sensor, methods, spp)
    assert step is not None
    ratios, taken = [], []
    for seed in range(SEEDS):
        seeds = [pilot_seed(seed, k) for k in range(pilot.IMAGES)]
        found = pilot.findings(own, methods, spp, seeds, step)
        ratios.append([finding.over(found[0])[0] for finding in found])
        taken.append(pilot.best(found).method.name)
    width, height = sensor.film().crop_size()
    part = pilot.images_of(methods, spp) * (width // step) * (height // step) / (width * height)
    return [
        [
            stage.case.scene,
            spp,
            method.name,
            f"{np.exp(np.log(values).mean()):.3f}",
            taken.count(method.name),
            SEEDS,
            f"{part:.4f}",
            method.cost,
        ]
        for method, values in zip(methods, np.transpose(ratios), strict=True)
    ]


def measure(stage: Stage, spp: int) -> Rows:
    """Write the rows of a scene."""
    names = [case.scene for case in CASES]
    put(TABLE, COLUMNS, rows_of(stage, spp), lambda row: (names.index(row[0]), int(row[1]), row[2]))
    print(stage.case.scene, spp, flush=True)
    return []


def known() -> set[tuple[str, int]]:
    """Scenes and samples per pixel of the rows that are there."""
    if not TABLE.exists():
        return set()
    with TABLE.open(newline="", encoding="utf-8") as file:
        return {(row["scene"], int(row["spp"])) for row in csv.DictReader(file)}


if __name__ == "__main__":
    mi.set_log_level(mi.LogLevel.Error)
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--spp", default="16,64,256")
    parser.add_argument("scenes", nargs="*", default=[case.scene for case in CASES], metavar="scene")
    arguments = parser.parse_args()
    there = known()
    for case in (case for name in arguments.scenes for case in CASES if case.scene == name):
        for n in whole_numbers("spp", arguments.spp):
            if (case.scene, n) not in there:
                on_stage(case, True, partial(measure, spp=n))
