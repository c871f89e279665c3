"""The domain `direction`: sets of BSDF samples at the first hit, with and without their weights.

    python benchmarks/directions.py

Writes benchmarks/results/directions.csv. Images of 80×60 pixels, rays from the centres: `sky` by `direct` without
emitter samples, `room` by its own path tracer. MSE against a reference, less the reference's own: means over SEEDS
renders of the same samples with equal weights, with weights, and with blend.
"""

from __future__ import annotations

import mitsuba as mi
import numpy as np
from csv_rows import put
from scene_measures import CASES, RESULTS, Floats, Rows, Stage, mean_and_error, on_stage

from voroquad.mitsuba.loading import make_integrator, own_integrator
from voroquad.mitsuba.rounds import Rounds

SIZE, SEEDS, ROUNDS, ROUND_SPP = (80, 60), 8, 16, 256
SCENES = {"sky": {"type": "direct", "emitter_samples": 0, "bsdf_samples": 1}, "room": None}
COLUMNS = ("scene", "spp", "samples", "mse", "mse_error", "weighted_mse", "weighted_error", "blend_mse", "blend_error")


def rows_of(stage: Stage) -> Rows:
    """Rows of a scene."""
    own = SCENES[stage.case.scene]
    nested = own_integrator(stage.scene) if own is None else mi.load_dict(own)

    def plugin(design: str, seed: int, **rule: object) -> mi.Integrator:
        named = {"domain": "direction", "sampler": design, "jitter": False, "table_seed": seed} | rule
        return make_integrator("reweighted", nested, all_else={"type": "independent"}, **named)

    def equal(seed: int) -> Floats:
        return stage.image(plugin("sobol", seed, weighted=False, blend="off"), ROUND_SPP, seed)

    rounds = np.array([equal(9000 + k) for k in range(ROUNDS)])
    reference, own_mse = rounds.mean(0), float((rounds.var(0, ddof=1) / ROUNDS).mean())
    rows: Rows = []
    for spp in (16, 64, 256):
        for design in ("uniform", "stratified"):
            errors = []
            for seed in range(SEEDS):
                done = plugin(design, seed).render_pass(stage.scene, stage.scene.sensors()[0], seed, spp)
                blended = Rounds(done.plain.shape)
                blended.add(done)
                images = (done.plain, done.blended(np.ones((2, *done.size))), blended.image)
                errors.append([float(((i[..., :3] - reference) ** 2).mean()) - own_mse for i in images])
            numbers = [f"{x:.4e}" for values in zip(*errors, strict=True) for x in mean_and_error(values)]
            rows.append([stage.case.scene, spp, design, *numbers])
            print(*rows[-1], flush=True)
    return rows


if __name__ == "__main__":
    names = list(SCENES)
    for case in CASES:
        if case.scene in SCENES:
            rows = on_stage(case, False, rows_of, SIZE)
            put(
                RESULTS / "directions.csv",
                COLUMNS,
                rows,
                lambda r: (names.index(r[0]), int(r[1]), r[2] == "stratified"),
            )
