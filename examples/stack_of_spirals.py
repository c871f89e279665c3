"""How bright is a small lesion in an MRI scan by a stack of spirals?

    pip install '.[study]'
    python examples/stack_of_spirals.py -o out/spirals

Each plane of k-space is read along spirals, densely at the centre. A sample stands for its Voronoi cell in a cylinder:
round across the stack, and periodic along it, since k-space ends and begins there. The object is a sum of Gaussian
blobs, whose signal has a closed form. `spirals.png` shows weights and images.
"""

import argparse
from pathlib import Path

import numpy as np

import voroquad as vq

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("-o", "--output", type=Path)
output = parser.parse_args().output

N, PLANES, SHOTS, SAMPLES, TURNS = 48, 24, 8, 384, 5  # voxels across, planes, spirals in each, of samples and turns
BLOBS = np.array([(1.0, 0, 0, 0, 9), (0.6, -9, 4, 0, 2.5), (1.2, 7, -8, 0, 1.6)])  # height, place, size in voxels
LESION = BLOBS[2]


def signal(k: np.ndarray) -> np.ndarray:
    """The Fourier transform (n,) of the object at k (n, 3), in cycles per voxel."""
    height, *place, size = BLOBS.T
    decay = np.exp(-2 * (np.pi * size) ** 2 * (k**2).sum(axis=1, keepdims=True))
    return (height * (2 * np.pi * size**2) ** 1.5 * decay * np.exp(-2j * np.pi * k @ np.array(place))).sum(axis=1)


def brightness(x: np.ndarray, y: np.ndarray, k: np.ndarray, weighted: np.ndarray) -> np.ndarray:
    """The image (len(x), len(y)) at height 0: the sum of w s exp(2πi k·r)."""
    across, along = (np.exp(2j * np.pi * np.outer(r, axis)) for r, axis in ((x, k[:, 0]), (y, k[:, 1])))
    return ((across * weighted) @ along.T).real


along = np.linspace(0, 1, SAMPLES) ** 0.6  # slowly at the centre, as gradients allow
angle = 2 * np.pi * (TURNS * along + np.arange(SHOTS)[:, None] / SHOTS)
plane = 0.5 * along[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
heights = np.arange(PLANES) / PLANES - 0.5
stack = np.concatenate([np.insert(plane.reshape(-1, 2), 2, height, axis=1) for height in heights])

weights = vq.density_compensation(stack)  # finds the cylinder; the same as rim="cylinder"
equal = np.full(len(stack), weights.sum() / len(stack))

at = LESION[1:3]
truth = (BLOBS[:, 0] * np.exp(-((BLOBS[:, 1:3] - at) ** 2).sum(axis=1) / (2 * BLOBS[:, 4] ** 2))).sum()
measured = signal(stack)
print(f"equal weights    {brightness(at[:1], at[1:], stack, equal * measured).item():.3f}")
print(f"cells' volumes   {brightness(at[:1], at[1:], stack, weights * measured).item():.3f}")
print(f"object           {truth:.3f}")

if output:
    import matplotlib.pyplot as plt

    output.mkdir(parents=True, exist_ok=True)
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 3.8), layout="constrained")
    one = plane.reshape(-1, 2)
    shown = vq.cells(one, bounds=(-0.5, 0.5), domain="ball")
    shown.plot(np.log10(shown.measures), ax=left)
    left.set(title="Cells in a quarter of a plane", xlabel="cycles per voxel", xlim=(-0.02, 0.52), ylim=(-0.02, 0.52))
    voxels = np.arange(-N / 2, N / 2)
    extent = (-N / 2 - 0.5, N / 2 - 0.5) * 2
    for ax, name, w in ((middle, "Equal weights", equal), (right, "Cells' volumes", weights)):
        image = brightness(voxels, voxels, stack, w * measured)
        shades = ax.imshow(image.T, origin="lower", cmap="magma", extent=extent, vmin=0, vmax=2)
        ax.plot(*at, "o", markersize=16, fillstyle="none", color="white")
        ax.set(title=name, xlabel="voxels")
    figure.colorbar(shades, label="brightness", extend="max")
    figure.savefig(output / "spirals.png", dpi=120)
