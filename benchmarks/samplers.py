"""The sampler ``owensobol`` beside Mitsuba's five, in all scenes: the pixels' areas are sampled, nothing is weighted.

    python benchmarks/samplers.py [--spp 16,64,256] [--samplers zsobol,owen-sobol] [--renders 8] [--again] [scene …]

Row after row goes to benchmarks/results/samplers.csv. What is there already, by as many renders, is not measured again
without `--again`. Errors are those of images of 160×120 pixels against a reference (`scene_measures`): MSE, mean ꟻLIP,
and MSE after a Gaussian blur of σ pixels, means over so many renders with standard errors. The reference's own variance
is taken off the MSE; after the blur 1/(4πσ²) of it, as its pixels are independent. `zsobol` and `owen-sobol` are those
of pbrt-v4 (`pbrt_samplers`). `adaptive` shares out samples, as many on average, by owensobol. `weights` are stratified
sets of the scene's domain with blend, and owensobol for all else; `weights of its own` weigh the emitter samples that
owensobol draws.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Sequence
from functools import partial
from typing import Any

import mitsuba as mi
import pbrt_samplers
from csv_rows import put
from scene_measures import CASES, RESULTS, Rows, Stage, mean_and_error, on_stage

from voroquad._support.checks import whole_numbers
from voroquad.mitsuba.loading import make_integrator, own_integrator
from voroquad.mitsuba.measurements import BLURS, blurred_mse, left_by_blur, mean_flip

#: Renders of a row
RENDERS = 8
MITSUBAS = ("independent", "stratified", "multijitter", "orthogonal", "ldsampler")
OURS: dict[str, dict[str, Any]] = {
    "owensobol joe-kuo": {"generators": "joe-kuo"},
    "owensobol sz": {"generators": "sz"},
    "owensobol sz none": {"generators": "sz", "order": "none"},
}
WEIGHTS, OWN_WEIGHTS = "weights", "weights of its own"
ALL = (*MITSUBAS, *pbrt_samplers.NAMES, *OURS, "adaptive", WEIGHTS, OWN_WEIGHTS)
COLUMNS = "scene,spp,sampler,mse,mse_error,flip,flip_error,blur_1.5,blur_1.5_error,blur_3,blur_3_error,renders"
TABLE = RESULTS / "samplers.csv"


def integrator_of(stage: Stage, name: str, spp: int, seed: int) -> mi.Integrator | None:
    """The plug-in that renders by a sampler; None if the sampler makes another number of samples, or has no sets."""
    if name in OURS:
        return stage.mitsubas("owensobol", seed, **OURS[name])
    if name == WEIGHTS:
        return stage.sets(stage.case.domain, "stratified", seed, "owensobol")
    if name == OWN_WEIGHTS:
        own = stage.case.own
        return stage.sets(own, "scene", seed, "owensobol", debias="none") if own else None
    if name == "adaptive":
        if stage.moves:
            return None
        least = {16: 8}.get(spp, 16)
        return make_integrator("plain", own_integrator(stage.scene), adaptive="balanced", at_least=least)
    integrator = stage.mitsubas(name, seed)
    return integrator if integrator.granted(stage.scene.sensors()[0], spp) == spp else None


def row_of(stage: Stage, spp: int, name: str, renders: int) -> Rows:
    """The row of a sampler; none if it has no such renders."""
    reference, variance = stage.reference()
    own = float(variance.mean())
    measured: list[list[float]] = []
    for seed in range(renders):
        integrator = integrator_of(stage, name, spp, 100 + seed)
        if integrator is None:
            return []
        image = stage.image(integrator, spp, seed)
        error = image - reference
        blurred = [blurred_mse(error, sigma) - own * left_by_blur(sigma) for sigma in BLURS]
        measured.append([float((error**2).mean()) - own, mean_flip(reference, image), *blurred])
    pairs = [mean_and_error(values) for values in zip(*measured, strict=True)]
    return [[stage.case.scene, spp, name, *(f"{x:.4e}" for pair in pairs for x in pair), renders]]


def measure(stage: Stage, spp: int, names: Sequence[str], renders: int) -> Rows:
    """Write the rows of a scene one by one."""
    pbrt_samplers.register()
    for name in names:
        if rows := row_of(stage, spp, name, renders):
            put(TABLE, COLUMNS.split(","), rows, place)
            print(stage.case.scene, spp, name, flush=True)
    return []


def place(row: Sequence[str]) -> tuple[int, int, int]:
    """Where a row stands in the table."""
    scenes, samplers = [case.scene for case in CASES], list(ALL)
    return scenes.index(row[0]), int(row[1]), samplers.index(row[2])


def known(renders: int) -> set[tuple[str, int, str]]:
    """Scene, samples per pixel and sampler of the rows that are there, by as many renders."""
    if not TABLE.exists():
        return set()
    with TABLE.open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if int(row["renders"]) >= renders]
    return {(row["scene"], int(row["spp"]), row["sampler"]) for row in rows}


if __name__ == "__main__":
    mi.set_log_level(mi.LogLevel.Error)  # the orthogonal sampler warns where it rounds
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--spp", default="16,64,256")
    parser.add_argument("--samplers", default=",".join(ALL))
    parser.add_argument("--renders", type=int, default=RENDERS)
    parser.add_argument("--again", action="store_true")
    parser.add_argument("scenes", nargs="*", default=[case.scene for case in CASES], metavar="scene")
    arguments = parser.parse_args()
    there = set() if arguments.again else known(arguments.renders)
    for case in (case for name in arguments.scenes for case in CASES if case.scene == name):
        for n in whole_numbers("spp", arguments.spp):
            if left := [name for name in arguments.samplers.split(",") if (case.scene, n, name) not in there]:
                on_stage(case, True, partial(measure, spp=n, names=left, renders=arguments.renders))
