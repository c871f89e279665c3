"""What is the mean grade of an ore body, if rich places were drilled more often?

    pip install '.[study]'
    python examples/declustering.py -o out/grades

Declustering weights are the areas of the samples' cells. They correct the mean and the distribution that a variogram or
a simulation starts from. The grade is a formula here, so that the truth is known. `grades.png` shows weights and
distributions.
"""

import argparse
from pathlib import Path

import numpy as np

import voroquad as vq

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("-o", "--output", type=Path)
output = parser.parse_args().output

SIDES = [(0, 400), (0, 200)]  # metres
rng = np.random.default_rng(11)
lenses = np.column_stack([rng.uniform((30, 30), (370, 170), (8, 2)), rng.uniform(10, 35, 8), rng.uniform(1, 5, 8)])


def grade(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Grams per tonne: a background and eight rich lenses."""
    u, v, size, height = (column[:, None] for column in lenses.T)
    return 0.5 + (height * np.exp(-((x - u) ** 2 + (y - v) ** 2) / (2 * size**2))).sum(axis=0)


first = rng.uniform((0, 0), (400, 200), (60, 2))  # everywhere, then where that was rich
rich = first[np.argsort(grade(*first.T))[-12:]]
infill = np.clip(np.repeat(rich, 10, axis=0) + rng.normal(0, 6, (120, 2)), 0, [400, 200])
holes = np.concatenate([first, infill])
grades = grade(*holes.T)

cells = vq.cells(holes, bounds=SIDES)
share = cells.measures / cells.measures.sum()

fine = grade(*rng.uniform((0, 0), (400, 200), (1_000_000, 2)).T)
print(f"mean of the samples  {grades.mean():.3f} g/t")
print(f"declustered          {share @ grades:.3f} g/t")
print(f"ore body             {fine.mean():.3f} g/t")

if output:
    import matplotlib.pyplot as plt

    output.mkdir(parents=True, exist_ok=True)
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.4), layout="constrained", width_ratios=[2, 1])
    cells.plot(np.log10(share * len(holes)), ax=left, cmap="PuOr_r")
    left.set(title="Weights, from much below to much above the mean", xlabel="m", ylabel="m")
    order = np.argsort(grades)
    right.plot(grades[order], np.arange(1, len(order) + 1) / len(order), label="samples")
    right.plot(grades[order], np.cumsum(share[order]), label="declustered")
    right.plot(np.sort(fine)[::1000], np.linspace(0, 1, 1000), "k:", label="ore body")
    right.set(title="Distribution", xlabel="grade, g/t", ylabel="share below")
    right.legend(frameon=False)
    figure.savefig(output / "grades.png", dpi=150)
