"""All scenes with the pixel's area sampled: what blend does to samples, and the best of ours beside Mitsuba's five.

    python benchmarks/scene_blend.py [scene …]

Scene after scene goes to benchmarks/results/scene_blend.csv; what is there already is not measured again. MSE as in
scene_domains.py, means over SEEDS renders of 64 samples per pixel. `blend_mse` is that of the same samples with
blend="auto", `ratio` the one over the other with its standard error (pairs). Mitsuba's orthogonal sampler makes no 64
samples: it has 49 in benchmarks/results/scene_blend_49.csv, and so have the others that can and some of ours beside it.
"""

from __future__ import annotations

import numpy as np
from scene_measures import CASES, Rows, Stage, mean_and_error, ratio_and_error, run

SEEDS = 8
COLUMNS = "scene,samples,domain,all_else,spp,mse,mse_error,weighted_mse,blend_mse,ratio,ratio_error,mean_lambda"


class Errors:
    """The rows of a scene, at so many samples per pixel."""

    def __init__(self, stage: Stage, spp: int) -> None:
        self.stage, self.spp = stage, spp
        self.reference, variance = stage.reference()
        self.own = float(variance.mean())
        self.rows: Rows = []

    def mse(self, image: np.ndarray) -> float:
        """Against the reference, less its own."""
        return float(((image - self.reference) ** 2).mean()) - self.own

    def unweighted(self, samples: str, domain: str, nested: str) -> None:
        """Add samples with equal weights: Mitsuba's, or sets of a domain inside a sampler of Mitsuba's."""
        errors = []
        for seed in range(SEEDS):
            if samples == "Mitsuba":
                integrator = self.stage.mitsubas(nested, 100 + seed)
            else:
                integrator = self.stage.sets(domain, samples, 100 + seed, nested, weighted=False, blend="off")
            errors.append(self.mse(self.stage.image(integrator, self.spp, seed)))
        numbers = [f"{x:.4e}" for x in mean_and_error(errors)]
        self.rows.append([self.stage.case.scene, samples, domain, nested, self.spp, *numbers, "", "", "", "", ""])

    def blended(self, samples: str, nested: str, domain: str = "") -> None:
        """Add sets of a domain, or of the scene's, with equal weights, with weights and with blend."""
        case, errors, lambdas = self.stage.case, [], []
        domain = domain or case.domain
        for seed in range(SEEDS):
            integrator = self.stage.sets(domain, samples, 100 + seed, nested, **rule_of(samples))
            *images, share = self.stage.three(integrator, self.spp, seed)
            errors.append([self.mse(image) for image in images])
            lambdas.append(share)
        plain, weighted, blend = zip(*errors, strict=True)
        numbers = [f"{x:.4e}" for x in (*mean_and_error(plain), np.mean(weighted), np.mean(blend))]
        numbers += [f"{x:.4f}" for x in ratio_and_error(blend, plain)]
        self.rows.append([case.scene, samples, domain, nested, self.spp, *numbers, f"{np.mean(lambdas):.3f}"])


def rule_of(samples: str) -> dict[str, str]:
    """The plug-in's default rule, which is unbiased; other samples than stratified ones have none that is."""
    return {} if samples == "stratified" else {"debias": "none"}


def rows_of(stage: Stage) -> Rows:
    """Rows of a scene at 64 samples per pixel."""
    errors, case = Errors(stage, 64), stage.case
    for sampler in ("independent", "stratified", "multijitter", "ldsampler"):
        errors.unweighted("Mitsuba", "", sampler)
    for samples in ("stratified", "sobol"):
        errors.blended(samples, "independent")
    for samples in ("zero-two", "sobol") if case.domain == "light" else ("stratified", "sobol"):
        errors.blended(samples, case.best)
    for domain in ("pixel", *case.joint) if case.domain == "light" else case.joint:
        errors.unweighted("sobol", domain, case.best)
    if case.own:
        errors.blended("scene", case.best, case.own)
    return errors.rows


def rows_of_49(stage: Stage) -> Rows:
    """Rows of a scene at 49 samples per pixel, which Mitsuba's orthogonal sampler makes, and its ldsampler does not."""
    errors, case = Errors(stage, 49), stage.case
    for sampler in ("independent", "stratified", "multijitter", "orthogonal"):
        errors.unweighted("Mitsuba", "", sampler)
    errors.blended("stratified", "orthogonal")
    for domain in ("pixel", case.joint[-1]) if case.joint else ():
        errors.unweighted("orthogonal", domain, "orthogonal")
    for domain in ("pixel", *case.joint) if case.domain == "light" else case.joint:
        errors.unweighted("orthogonal", domain, "multijitter")
    for sampler in ("multijitter", "orthogonal") if case.own else ():
        errors.blended("scene", sampler, case.own)
    return errors.rows


if __name__ == "__main__":
    run("scene_blend", COLUMNS, CASES, True, rows_of)
    run("scene_blend_49", COLUMNS, CASES, True, rows_of_49)
