"""No bias: the mean of 64 independent renders by unbiased rules and blend="auto" against the reference, pixel by pixel.

    python benchmarks/scene_bias.py [scene …]

Scene after scene goes to benchmarks/results/scene_bias.csv; what is there already is not measured again. Each render
has 16 samples per pixel and a table of its own. A value (pixel, channel) has z = difference over the standard error
that the renders and the reference's rounds show. As in Mitsuba's own tests, a value passes if its two-sided probability
(Student's t) is above 1 − (1 − 0.01)^(1/values), and a scene does if 99.75 % of its values pass. `mean_square_z` stands
beside what Student's t says it should be, `mean_z` beside its standard error by pixels and beside `skewed_z`, what it
should be by the skewness of the renders: mean and variance of skewed noise go together, Cov(x̄, s²) = κ₃/n, so that
E z ≈ −Cov(x̄, s²/n) / 2 σ³, with the share of the reference (in the same way, of the other sign). The row `control` has
a rule that is biased.
"""

from __future__ import annotations

from collections.abc import Callable

import mitsuba as mi
import numpy as np
from scene_measures import CASES, REFERENCE_ROUNDS, REFERENCE_SPP, Rows, Stage, run
from scipy import stats

RENDERS, SPP = 64, 16
PASSING = 0.9975
COLUMNS = (
    "scene,domain,rule,values,passing,least_p,threshold,mean_square_z,expected,mean_z,mean_z_error,skewed_z,unbiased"
)
RULES = {
    "lens": ("stratified", {"order": 1, "debias": "leave-one-out"}),
    "time": ("stratified", {"order": 0, "debias": "exchange"}),
    "wavelength": ("stratified", {"order": 0, "debias": "none"}),  # on the circle, where cells have no bias
    "light": ("stratified", {"order": 0, "debias": "leave-one-out"}),
}


def measure(stage: Stage, rule: str, design: str, settings: dict[str, object]) -> list[object]:
    """The row of a scene and a rule."""
    return score(stage, rule, lambda seed: stage.sets(stage.case.domain, design, seed, **settings))


def score(stage: Stage, rule: str, make: Callable[[int], mi.Integrator]) -> list[object]:
    """The row of a scene and of what makes the integrators of renders by their seeds."""
    reference, reference_variance = stage.reference()
    total = squares = cubes = np.zeros(())
    for seed in range(500, 500 + RENDERS):
        difference = stage.image(make(seed), SPP, seed) - reference
        total, squares, cubes = total + difference, squares + difference**2, cubes + difference**3
    mean = total / RENDERS
    variance = np.maximum(squares / RENDERS - mean**2, 0) / (RENDERS - 1)
    # What has no noise, such as a background, has rounding errors of single precision
    both = variance + reference_variance + (2e-7 * reference) ** 2
    noisy = both > (1e-6 * reference) ** 2
    # Degrees of freedom after Welch and Satterthwaite
    free = both**2 / (variance**2 / (RENDERS - 1) + reference_variance**2 / (REFERENCE_ROUNDS - 1) + 1e-60)
    score = np.divide(mean, np.sqrt(both), out=np.zeros_like(mean), where=noisy)
    z, free = score[noisy], free[noisy]
    p = 2 * stats.t.sf(np.abs(z), free)
    threshold = 1 - (1 - 0.01) ** (1 / z.size)
    passing = float((p > threshold).mean())
    of_pixels = score.mean(-1)
    numbers = f"{passing:.5f},{p.min():.2e},{threshold:.2e},{(z**2).mean():.4f},{(free / (free - 2)).mean():.4f}"
    # κ₃ of a render falls with the square of its samples
    third = (cubes / RENDERS - 3 * mean * squares / RENDERS + 2 * mean**3) * RENDERS**2
    third /= (RENDERS - 1) * (RENDERS - 2)
    shares = 1 / RENDERS**2 - (SPP / REFERENCE_SPP / REFERENCE_ROUNDS) ** 2
    skewed = np.divide(-third * shares, 2 * both**1.5, out=np.zeros_like(mean), where=noisy)
    error = of_pixels.std() / np.sqrt(of_pixels.size)
    return [
        stage.case.scene, stage.case.domain, rule, z.size, *numbers.split(","), f"{of_pixels.mean():.4f}",
        f"{error:.4f}", f"{skewed.mean():.4f}", "yes" if passing >= PASSING else "no",
    ]  # fmt: skip


def rows_of(stage: Stage) -> Rows:
    """The row of the scene's unbiased rule; one of a biased rule beside the scene that shows it best."""
    design, settings = RULES[stage.case.domain]
    rows = [measure(stage, f"{design}, order {settings['order']}, {settings['debias']}", design, settings)]
    if stage.case.scene == "large-light":
        biased = {"order": 0, "debias": "none", "blend": "off"}
        rows.append(measure(stage, "control: uniform, order 0, none", "uniform", biased))
    return rows


if __name__ == "__main__":
    run("scene_bias", COLUMNS, CASES, True, rows_of)
