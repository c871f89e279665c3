"""Each problem where its domain makes the noise: sets with and without their weights, at the pixels' centres.

    python benchmarks/scene_domains.py [scene …]

Scene after scene goes to benchmarks/results/scene_domains.csv; what is there already is not measured again. MSE is that
of images of 160×120 pixels against a reference (`scene_measures`), less the reference's own; the mean over SEEDS
renders with its standard error. Weighted and unweighted renders have the same samples; the rows without weights are
of Mitsuba's samplers.
"""

from __future__ import annotations

import numpy as np
from scene_measures import CASES, Rows, Stage, mean_and_error, run

SCENES = ("moving-camera", "depth-of-field", "large-light", "spectral")
SEEDS = 4
SPP = {"depth-of-field": (64, 256)}
LEAVE_ONE_OUT = [{"order": p, "debias": "leave-one-out"} for p in (0, 1, 2, 3)]
COLUMNS = "scene,domain,spp,samples,order,debias,mse,mse_error,weighted_mse,weighted_mse_error,gain"


def rules(design: str, periodic: bool) -> list[dict[str, object]]:
    """The rules for the sets of a design."""
    cells: dict[str, object] = {"order": 0, "debias": "none"}
    if periodic or design not in ("uniform", "stratified"):
        return [cells]
    return [cells, *(LEAVE_ONE_OUT if design == "stratified" else LEAVE_ONE_OUT[:1])]


def measure(stage: Stage, spp: int) -> Rows:
    """Rows of a scene."""
    reference, variance = stage.reference()
    own = float(variance.mean())
    case = stage.case

    def mse(image: np.ndarray) -> float:
        return float(((image - reference) ** 2).mean()) - own

    rows: Rows = []
    for design in ("uniform", "stratified", "sobol"):
        for rule in rules(design, case.domain == "wavelength"):
            pairs = []
            for seed in range(SEEDS):
                plain, weighted, *_ = stage.three(stage.sets(case.domain, design, 100 + seed, **rule), spp, seed)
                pairs.append((mse(plain), mse(weighted)))
            (a, a_error), (b, b_error) = (mean_and_error(values) for values in zip(*pairs, strict=True))
            numbers = [f"{x:.4e}" for x in (a, a_error, b, b_error)]
            rows.append([case.scene, case.domain, spp, design, rule["order"], rule["debias"], *numbers, f"{a / b:.2f}"])
    for sampler in ("independent", "stratified", "multijitter", "ldsampler"):
        errors = [mse(stage.image(stage.mitsubas(sampler, 100 + seed), spp, seed)) for seed in range(SEEDS)]
        a, a_error = mean_and_error(errors)
        label = f"Mitsuba {sampler}"
        rows.append([case.scene, case.domain, spp, label, "", "", f"{a:.4e}", f"{a_error:.4e}", "", "", ""])
    return rows


def rows_of(stage: Stage) -> Rows:
    """Rows of a scene, at all its samples per pixel."""
    return [row for spp in SPP.get(stage.case.scene, (64,)) for row in measure(stage, spp)]


if __name__ == "__main__":
    run("scene_domains", COLUMNS, [case for case in CASES if case.scene in SCENES], False, rows_of)
