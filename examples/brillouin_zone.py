"""What is the energy of the electrons of graphene, from irregular k-points?

    pip install '.[study]'
    python examples/brillouin_zone.py -o out/brillouin_zone

The energy per unit cell is the mean over the Brillouin zone of E(k) f(E(k)), with E the two bands of the tight-binding
model and f the Fermi function. The bands touch at two points, K and K', so k-points crowd there. A plain mean counts
these places too often; cells on the torus of the reciprocal lattice give each point the share it stands for.
`k_points.png` shows the cells.
"""

import argparse
from pathlib import Path

import numpy as np

import voroquad as vq

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("-o", "--output", type=Path)
output = parser.parse_args().output

LATTICE = np.array([[1.0, 0.0], [0.5, np.sqrt(3) / 2]])  # of graphene, in its lattice constant
RECIPROCAL = 2 * np.pi * np.linalg.inv(LATTICE).T
TEMPERATURE = 0.05  # in units of the hopping energy


def energy(k: np.ndarray) -> np.ndarray:
    """Of the electrons at k (n, 2), both bands occupied as the Fermi function has it."""
    band = np.abs(1 + np.exp(1j * k @ LATTICE.T).sum(axis=1))
    return -band * np.tanh(band / (2 * TEMPERATURE))


rng = np.random.default_rng(4)
touching = np.array([[1, 2], [2, 1]]) / 3 @ RECIPROCAL  # K and K'
everywhere = rng.random((600, 2)) @ RECIPROCAL
crowded = touching[rng.integers(0, 2, 600)] + 0.3 * rng.normal(size=(600, 2))
k_points = np.concatenate([everywhere, crowded])

cells = vq.cells(k_points, cell=RECIPROCAL)
weights = cells.measures / cells.measures.sum()
grid = np.stack(np.meshgrid(*[np.arange(600) / 600] * 2), axis=-1).reshape(-1, 2) @ RECIPROCAL

print(f"plain mean {energy(k_points).mean():.5f}")
print(f"weighted   {weights @ energy(k_points):.5f}")
print(f"fine grid  {energy(grid).mean():.5f}")

if output:
    import matplotlib.pyplot as plt

    output.mkdir(parents=True, exist_ok=True)
    figure, ax = plt.subplots(figsize=(4.6, 5), layout="constrained")
    cells.plot(energy(k_points), ax=ax, cmap="magma")
    ax.set(title="Cells of k-points", xticks=[], yticks=[])
    figure.colorbar(ax.collections[0], label="energy over the hopping energy")
    figure.savefig(output / "k_points.png", dpi=120)
