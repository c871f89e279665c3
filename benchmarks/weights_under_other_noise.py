"""When lens weights hurt: an environment light and three bounces, so that the lens is the least of the noise.

    python benchmarks/weights_under_other_noise.py

Var(N w) > 0 multiplies the variance of all that the lens does not explain. Renders spheres on a floor under a constant
sky with `path`, pixels jittered, 64 spp, with and without weights on the same lens samples; the ratio of the variances
over independent seeds, with its standard error, goes to benchmarks/results/weights_under_other_noise.csv.
"""

from __future__ import annotations

import csv
from pathlib import Path

import mitsuba as mi
import numpy as np

import voroquad as vq
from voroquad.mitsuba.loading import make_integrator, use_variant
from voroquad.mitsuba.render import render_image

RESULT = Path(__file__).parent / "results" / "weights_under_other_noise.csv"
SEEDS, SPP, SIZE = 12, 64, (80, 60)
DESIGNS = ("uniform", "stratified", "sobol")


def make_scene() -> mi.Scene:
    """Five spheres from near to far, a floor, a constant sky."""
    to_world = mi.ScalarTransform4f().look_at([0, 1.5, 6], [0, 0.3, 0], [0, 1, 0])
    floor = mi.ScalarTransform4f().rotate([1, 0, 0], -90).scale(20)
    film = {"type": "hdrfilm", "width": SIZE[0], "height": SIZE[1], "rfilter": {"type": "box"}, "pixel_format": "rgb"}
    lens = {"aperture_radius": 0.12, "focus_distance": 6.0, "fov": 40}
    spheres = {f"s{k}": {"type": "sphere", "center": [k - 2, 0.5, 3 - 2 * k], "radius": 0.5} for k in range(5)}
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {"type": "thinlens", "to_world": to_world, "film": film, **lens},
            "floor": {"type": "rectangle", "to_world": floor},
            "sky": {"type": "constant"},
            **spheres,
        }
    )


def variances(scene: mi.Scene, design: str, weighted: bool) -> np.ndarray:
    """Variance of a pixel over seeds, mean over pixels and channels, of each of the pairs of seeds."""
    nested = mi.load_dict({"type": "path", "max_depth": 4})
    images = [
        render_image(
            scene,
            make_integrator("reweighted", nested, sampler=design, weighted=weighted, blend="off", table_seed=seed),
            SPP,
            seed,
        )
        for seed in range(SEEDS)
    ]
    return np.array([np.mean((a - b) ** 2) / 2 for a, b in zip(images[::2], images[1::2], strict=True)])


def main() -> None:
    use_variant()
    scene = make_scene()
    RESULT.parent.mkdir(exist_ok=True)
    with RESULT.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["design", "spp", "variance", "variance_weighted", "ratio", "ratio_standard_error", "var_nw"])
        for design in DESIGNS:
            plain, weighted = (variances(scene, design, w) for w in (False, True))
            ratios = weighted / plain
            error = ratios.std(ddof=1) / np.sqrt(len(ratios))
            spread = np.var(SPP * vq.SampleTable.make(design, SPP, 2, 256, rng=1).weights)
            row = [design, SPP, f"{plain.mean():.4e}", f"{weighted.mean():.4e}", f"{ratios.mean():.3f}", f"{error:.3f}"]
            writer.writerow([*row, f"{spread:.3f}"])
            print(f"{design}: weighted / plain variance {ratios.mean():.3f} ± {error:.3f}, Var(N w) = {spread:.3f}")


if __name__ == "__main__":
    main()
