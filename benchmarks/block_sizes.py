"""How many pixels should share a sequence of `owensobol`: errors of images by squares of 2 to 256 pixels a side.

    python benchmarks/block_sizes.py [scene …]

Scene after scene goes to benchmarks/results/block_sizes.csv. Errors as in samplers.py, means over SEEDS renders of SPP
samples per pixel; `mse_spread` is the standard deviation of the MSE over the renders, divided by its mean.
"""

from __future__ import annotations

import sys

import numpy as np
from csv_rows import put
from scene_measures import CASES, RESULTS, Rows, Stage, on_stage

from voroquad.mitsuba.measurements import BLURS, blurred_mse, left_by_blur, mean_flip

SEEDS, SPP = 8, 16
BITS = (1, 2, 3, 4, 8)
SCENES = ("spectral", "large-light", "sky")
COLUMNS = ("scene", "spp", "pixels_a_side", "mse", "mse_spread", "flip", "blur_1.5", "blur_3")


def rows_of(stage: Stage) -> Rows:
    """Rows of a scene."""
    from voroquad.mitsuba import owen_sobol

    reference, variance = stage.reference()
    own, rows, default = float(variance.mean()), [], owen_sobol.BLOCK_BITS
    for bits in BITS:
        owen_sobol.BLOCK_BITS = bits
        measured = []
        for seed in range(SEEDS):
            image = stage.image(stage.mitsubas("owensobol", 100 + seed), SPP, seed)
            error = image - reference
            blurred = [blurred_mse(error, sigma) - own * left_by_blur(sigma) for sigma in BLURS]
            measured.append([float((error**2).mean()) - own, mean_flip(reference, image), *blurred])
        mse, *others = np.mean(measured, axis=0)
        spread = np.std(measured, axis=0, ddof=1)[0] / mse
        rows.append([stage.case.scene, SPP, 2**bits, f"{mse:.3e}", f"{spread:.3f}", *(f"{x:.3e}" for x in others)])
    owen_sobol.BLOCK_BITS = default
    return rows


if __name__ == "__main__":
    for case in CASES:
        if case.scene in (sys.argv[1:] or SCENES):
            lines = on_stage(case, True, rows_of)
            put(RESULTS / "block_sizes.csv", COLUMNS, lines, lambda row: (row[0], int(row[1]), int(row[2])))
            print(case.scene, flush=True)
