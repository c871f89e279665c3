"""How dense is it around each particle of a simulation, and who touches whom?

    pip install '.[study]'
    python examples/particles.py -o out/particles

Particles in a periodic box, clustered or not. The volume of a particle's cell is the inverse of its local density,
without a length scale to choose; cells that share a face are neighbours. `particles.png` shows both.
"""

import argparse
from pathlib import Path

import numpy as np

import voroquad as vq

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("-o", "--output", type=Path)
output = parser.parse_args().output

SIDE, N = 10.0, 3000
rng = np.random.default_rng(2)
gas = rng.uniform(0, SIDE, (N, 3))
clumps = rng.uniform(0, SIDE, (30, 3))
clustered = (clumps[rng.integers(0, 30, N)] + rng.standard_t(2, (N, 3)) * 0.3) % SIDE

found = {}
for name, particles in (("gas", gas), ("clustered", clustered)):
    cells = vq.cells(particles, bounds=(0, SIDE), periodic=True)
    near = cells.neighbours()
    density = SIDE**3 / N / cells.measures  # in units of the mean
    found[name] = cells, density
    print(
        f"{name:<10} volume {cells.measures.sum():.6f}, spread of log density {np.log(density).std():.3f}, "
        f"neighbours {len(near.indices) / N:.2f}"
    )

if output:
    import matplotlib.pyplot as plt

    output.mkdir(parents=True, exist_ok=True)
    figure = plt.figure(figsize=(10, 4), layout="constrained")
    left, right = figure.add_subplot(121, projection="3d"), figure.add_subplot(122)
    around = (clustered - clumps[0] + SIDE / 2) % SIDE - SIDE / 2  # across the ends of the box
    half = (np.abs(around) < 1).all(axis=1) & (around[:, 1] > 0)  # cut open through its middle
    shown = vq.cells(around[half], bounds=[(-1, 1), (0, 1), (-1, 1)])
    shown.plot(-np.log10(shown.measures), ax=left, cmap="magma")
    left.set(title="Half a clump: dense cells are bright", yticks=[0, 0.5, 1])
    for name, (_, density) in found.items():
        right.hist(np.log10(density), np.linspace(-2, 3, 80), histtype="step", label=name)
    right.set(title="Local density", xlabel="log10 of density over its mean", ylabel="particles")
    right.legend(frameon=False)
    figure.savefig(output / "particles.png", dpi=150)
