"""Scenes that no one of this project made: the setting of `voroquad render` beside the scene's own sampler.

    git clone https://github.com/mitsuba-renderer/mitsuba-data
    python benchmarks/public_scenes.py mitsuba-data

Row after row goes to benchmarks/results/public_scenes.csv; what is there already is not measured again. Images of
160×120 pixels with SPP samples each: MSE against a reference, less the reference's own, means over SEEDS renders, each
with a pilot of its own. `setting` is what most of these take. `ratio` is `auto_mse` over `own_mse`, `time` the samples
of pilot and image over those of the image alone, times the cost of a sample that the pilot reckons with. `mean_z`: the
mean radiance of the images by `auto` less that of the scene's own sampler, over its standard error.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import mitsuba as mi
import numpy as np
from csv_rows import put
from scene_measures import RESULTS, SIZE, VARIANT, Floats, Rows, mean_and_error

from voroquad.mitsuba import pilot
from voroquad.mitsuba.default_domain import known_domain
from voroquad.mitsuba.loading import load_scene
from voroquad.mitsuba.methods import OWEN_SOBOL, OWN, RenderMethod, Stage
from voroquad.mitsuba.render import render_image
from voroquad.mitsuba.settling import choose

SPP, SEEDS = 64, 8
#: Rounds of a reference, and samples per pixel of each
ROUNDS, ROUND_SPP = 16, 64
SCENES = (
    "scenes/cbox/cbox.xml",
    "docs/scenes/sensor_thinlens.xml",
    "docs/scenes/integrator_direct_both.xml",
    "docs/scenes/bsdf_roughplastic_ggx.xml",
    "docs/scenes/emitter_projector_textured.xml",
    "tests/scenes/participating_media/test_homo_obj_inside_medium_volpath.xml",
)
#: Parameters that a scene needs
PARAMETERS = {"docs/scenes/sensor_thinlens.xml": {"spp": str(SPP)}}
TABLE = RESULTS / "public_scenes.csv"
COLUMNS = (
    "scene", "spp", "setting", "own_sampler", "own_mse", "own_error", "auto_mse", "auto_error", "ratio", "time",
    "mean_z",
)  # fmt: skip


def row_of(folder: Path, name: str) -> Rows:
    """The row of a scene."""
    scene = load_scene(folder / name, SIZE, parameters=PARAMETERS.get(name))
    sensor = scene.sensors()[0]
    stage = Stage(scene, sensor, known_domain(scene, sensor, jitter=True), True)

    def image(method: RenderMethod, spp: int, seed: int) -> Floats:
        return render_image(scene, stage.integrator(method), spp, seed)[..., :3]

    rounds = np.array([image(OWEN_SOBOL, ROUND_SPP, 9000 + k) for k in range(ROUNDS)])
    reference = rounds.mean(0)
    own_variance = float((rounds.var(0, ddof=1) / ROUNDS).mean())
    chosen = [choose(stage, SPP, seed)[0] for seed in range(SEEDS)]
    images = {
        "own": [image(OWN, SPP, seed) for seed in range(SEEDS)],
        "auto": [image(method, SPP, seed) for seed, method in enumerate(chosen)],
    }
    own, auto = ([float(((i - reference) ** 2).mean()) - own_variance for i in images[k]] for k in ("own", "auto"))
    levels = {name: [float(i.mean()) for i in made] for name, made in images.items()}
    difference = np.mean(levels["auto"]) - np.mean(levels["own"])
    z = difference / np.hypot(*(np.std(level, ddof=1) / np.sqrt(SEEDS) for level in levels.values()))
    methods = pilot.candidates(stage, [SPP])
    step = pilot.pilot_step(sensor, methods, SPP)
    assert step is not None
    width, height = sensor.film().crop_size()
    part = pilot.images_of(methods, SPP) * (width // step) * (height // step) / (width * height)
    time = np.mean([method.cost for method in chosen]) + part
    labels = [method.label for method in chosen]
    numbers = [f"{x:.4e}" for x in (*mean_and_error(own), *mean_and_error(auto))]
    sampler = sensor.sampler().class_name().removesuffix("Sampler").lower()
    ratio = np.mean(auto) / np.mean(own)
    most = max(set(labels), key=labels.count)
    return [[name, SPP, most, sampler, *numbers, f"{ratio:.3f}", f"{time:.3f}", f"{z:.2f}"]]


def known() -> set[str]:
    """Scenes of the rows that are there."""
    if not TABLE.exists():
        return set()
    with TABLE.open(newline="", encoding="utf-8") as file:
        return {row["scene"] for row in csv.DictReader(file)}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="with a copy of the repository mitsuba-data")
    folder = parser.parse_args().folder
    mi.set_variant(VARIANT)
    mi.set_log_level(mi.LogLevel.Error)
    for name in SCENES:
        if name not in known():
            put(TABLE, COLUMNS, row_of(folder, name), lambda row: SCENES.index(row[0]))
            print(name, flush=True)
