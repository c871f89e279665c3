"""All scenes with the pixel's area sampled: what blend does to samples, and the best of ours beside Mitsuba's five.

    python benchmarks/scene_blend.py [scene …]

Scene after scene goes to benchmarks/results/scene_blend.csv; what is there already is not measured again. MSE as in
scene_domains.py, means over SEEDS renders of 64 samples per pixel. `blend_mse` is that of the same samples with
blend="auto", `ratio` the one over the other with its standard error (pairs). Mitsuba's orthogonal sampler makes no 64
samples: it has 49, and so has the best of ours beside it.
"""

from __future__ import annotations

import numpy as np
from scene_measures import CASES, Rows, Stage, mean_and_error, ratio_and_error, run

SEEDS = 8
SPP, SPP_ORTHOGONAL = 64, 49
COLUMNS = "scene,samples,domain,all_else,spp,mse,mse_error,weighted_mse,blend_mse,ratio,ratio_error,mean_lambda"


def measure(stage: Stage) -> Rows:
    """Rows of a scene."""
    reference, variance = stage.reference()
    own = float(variance.mean())
    case = stage.case
    rows: Rows = []

    def mse(image: np.ndarray) -> float:
        return float(((image - reference) ** 2).mean()) - own

    def unweighted(samples: str, domain: str, nested: str, spp: int = SPP) -> None:
        errors = []
        for seed in range(SEEDS):
            if samples == "Mitsuba":
                integrator = stage.mitsubas(nested, 100 + seed)
            else:
                integrator = stage.sets(domain, samples, 100 + seed, nested, weighted=False, blend="off")
            errors.append(mse(stage.image(integrator, spp, seed)))
        numbers = [f"{x:.4e}" for x in mean_and_error(errors)]
        rows.append([case.scene, samples, domain, nested, spp, *numbers, "", "", "", "", ""])

    def blended(samples: str, nested: str) -> None:
        errors, lambdas = [], []
        for seed in range(SEEDS):
            integrator = stage.sets(case.domain, samples, 100 + seed, nested)
            *images, share = stage.three(integrator, SPP, seed)
            errors.append([mse(image) for image in images])
            lambdas.append(share)
        plain, weighted, blend = zip(*errors, strict=True)
        numbers = [f"{x:.4e}" for x in (*mean_and_error(plain), np.mean(weighted), np.mean(blend))]
        ratio = [f"{x:.4f}" for x in ratio_and_error(blend, plain)]
        rows.append([case.scene, samples, case.domain, nested, SPP, *numbers, *ratio, f"{np.mean(lambdas):.3f}"])

    for sampler in ("independent", "stratified", "multijitter", "ldsampler"):
        unweighted("Mitsuba", "", sampler)
    unweighted("Mitsuba", "", "orthogonal", SPP_ORTHOGONAL)
    for samples in ("stratified", "sobol"):
        blended(samples, "independent")
    for samples in ("zero-two", "sobol") if case.domain == "light" else ("stratified", "sobol"):
        blended(samples, case.best)
    for domain in case.joint:
        unweighted("sobol", domain, case.best)
    unweighted("sobol", case.joint[-1] if case.joint else case.domain, case.best, SPP_ORTHOGONAL)
    return rows


if __name__ == "__main__":
    run("scene_blend", COLUMNS, CASES, True, measure)
