"""The sampler ``owensobol`` beside Mitsuba's five, in all scenes: the pixels' areas are sampled, nothing is weighted.

    python benchmarks/samplers.py [--spp 16,64,256] [--samplers zsobol,owen-sobol] [scene …]

Scene after scene goes to benchmarks/results/samplers.csv, in the place of what was measured before. Errors are those of
images of 160×120 pixels against a reference (`scene_measures`): MSE, mean ꟻLIP, and MSE after a Gaussian blur of σ
pixels, means over SEEDS renders with standard errors. The reference's own variance is taken off the MSE; after the blur
1/(4πσ²) of it, as its pixels are independent. `zsobol` and `owen-sobol` are those of pbrt-v4 (`pbrt_samplers`).
`adaptive` shares out samples, as many on average, by owensobol.
"""

from __future__ import annotations

import argparse
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

SEEDS = 4
MITSUBAS = ("independent", "stratified", "multijitter", "orthogonal", "ldsampler")
OURS: dict[str, dict[str, Any]] = {
    "owensobol joe-kuo": {"generators": "joe-kuo"},
    "owensobol sz": {"generators": "sz"},
    "owensobol sz none": {"generators": "sz", "order": "none"},
}
ALL = (*MITSUBAS, *pbrt_samplers.NAMES, *OURS, "adaptive")
COLUMNS = "scene,spp,sampler,mse,mse_error,flip,flip_error,blur_1.5,blur_1.5_error,blur_3,blur_3_error"


def integrator_of(stage: Stage, name: str, spp: int, seed: int) -> mi.Integrator | None:
    """The plug-in that renders by a sampler; None if the sampler makes another number of samples, or has no sets."""
    if name in OURS:
        return stage.mitsubas("owensobol", seed, **OURS[name])
    if name == "adaptive":
        if stage.moves:
            return None
        least = {16: 8}.get(spp, 16)
        return make_integrator("plain", own_integrator(stage.scene), adaptive="absolute", at_least=least)
    integrator = stage.mitsubas(name, seed)
    return integrator if integrator.granted(stage.scene.sensors()[0], spp) == spp else None


def rows_of(stage: Stage, spp: int, names: Sequence[str]) -> Rows:
    """Rows of a scene."""
    pbrt_samplers.register()
    reference, variance = stage.reference()
    own = float(variance.mean())
    rows: Rows = []
    for name in names:
        measured: list[list[float]] = []
        for seed in range(SEEDS):
            integrator = integrator_of(stage, name, spp, 100 + seed)
            if integrator is None:
                break
            image = stage.image(integrator, spp, seed)
            error = image - reference
            blurred = [blurred_mse(error, sigma) - own * left_by_blur(sigma) for sigma in BLURS]
            measured.append([float((error**2).mean()) - own, mean_flip(reference, image), *blurred])
        if measured:
            pairs = [mean_and_error(values) for values in zip(*measured, strict=True)]
            rows.append([stage.case.scene, spp, name, *(f"{x:.4e}" for pair in pairs for x in pair)])
    return rows


def place(row: Sequence[str]) -> tuple[int, int, int]:
    """Where a row stands in the table."""
    scenes, samplers = [case.scene for case in CASES], list(ALL)
    return scenes.index(row[0]), int(row[1]), samplers.index(row[2])


if __name__ == "__main__":
    mi.set_log_level(mi.LogLevel.Error)  # the orthogonal sampler warns where it rounds
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--spp", default="16,64,256")
    parser.add_argument("--samplers", default=",".join(ALL))
    parser.add_argument("scenes", nargs="*", default=[case.scene for case in CASES], metavar="scene")
    arguments = parser.parse_args()
    for case in CASES:
        for n in whole_numbers("spp", arguments.spp) if case.scene in arguments.scenes else ():
            rows = on_stage(case, True, partial(rows_of, spp=n, names=arguments.samplers.split(",")))
            put(RESULTS / "samplers.csv", COLUMNS.split(","), rows, place)
            print(case.scene, n, flush=True)
