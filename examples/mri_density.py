"""Images from radial, spiral and koosh-ball MRI data, weighted by voroquad and by mri-nufft's own two methods.

    pip install '.[mri,study]'
    python examples/mri_density.py -o out/mri

The scanner sees a Shepp-Logan phantom, whose k-space is known in closed form. Every weight function is called with the
same trajectory, and the image is the adjoint NUFFT of the weighted samples, without iterations. Its error is that
against the image that all of k-space within the disc or ball makes. The folder gets `density.csv` (samples, CPU
seconds on one thread, error) and `density.png`.

The 3-D case takes mri-nufft's `voronoi` a few minutes; `--scale 0.5` halves the shots, the samples of each and the
sides of the images.
"""

from __future__ import annotations

import argparse
import csv
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import mrinufft
import numpy as np
from mrinufft.density import get_density
from scipy.special import j1

import voroquad.mri_nufft  # noqa: F401 (registers "voroquad")
from voroquad.results.style import DPI, house_style, new_figure

METHODS = {"voroquad": {"threads": 1}, "voronoi": {}, "cell_count": {}}

# Shepp and Logan's head with the contrast of Toft (1996), in a field of view of [-1, 1]^3: value, half-axes, centre,
# angle in the plane of the first two axes in degrees. The 2-D phantom leaves out the third axis.
HEAD = [
    (1.0, (0.690, 0.920, 0.810), (0.00, 0.0000, 0.00), 0),
    (-0.8, (0.6624, 0.874, 0.780), (0.00, -0.0184, 0.00), 0),
    (-0.2, (0.110, 0.310, 0.220), (0.22, 0.0000, 0.00), -18),
    (-0.2, (0.160, 0.410, 0.280), (-0.22, 0.0000, 0.00), 18),
    (0.1, (0.210, 0.250, 0.410), (0.00, 0.3500, -0.15), 0),
    (0.1, (0.046, 0.046, 0.050), (0.00, 0.1000, 0.25), 0),
    (0.1, (0.046, 0.046, 0.050), (0.00, -0.1000, 0.25), 0),
    (0.1, (0.046, 0.023, 0.050), (-0.08, -0.6050, 0.00), 0),
    (0.1, (0.023, 0.023, 0.020), (0.00, -0.6060, 0.00), 0),
    (0.1, (0.023, 0.046, 0.020), (0.06, -0.6050, 0.00), 0),
]


@dataclass
class Case:
    """A trajectory (shots, samples, d) in cycles per voxel and the shape of its image."""

    name: str
    trajectory: np.ndarray
    shape: tuple[int, ...]


def cases(scale: float) -> list[Case]:
    """The trajectories; a scale of 1 samples as densely as the images need."""

    def size(n: int) -> int:
        return max(4, 2 * round(n * scale / 2))

    square, cube = (size(256),) * 2, (size(64),) * 3
    radial = mrinufft.initialize_2D_radial(size(200), size(512), in_out=True)
    spiral = mrinufft.initialize_2D_spiral(size(48), size(3000), nb_revolutions=4)
    koosh_ball = mrinufft.initialize_3D_golden_means_radial(size(6250), size(160), in_out=True)
    return [
        Case("radial", radial, square),
        Case("radial, every other spoke twice", np.concatenate([radial, radial[::2]]), square),
        Case("spiral", spiral, square),
        Case("koosh ball", koosh_ball, cube),
    ]


def in_own_axes(x: np.ndarray, angle: float) -> np.ndarray:
    """Vectors (..., d) along the axes of an ellipsoid that is turned by an angle in degrees."""
    c, s = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
    return np.concatenate([x[..., :2] @ np.array([[c, -s], [s, c]]), x[..., 2:]], axis=-1)


def samples_of_head(k: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Fourier transform of the head at positions (n, d): a sum of those of ellipsoids."""
    d = len(shape)
    side = shape[0] / 2  # voxels per unit of length
    signal = np.zeros(len(k), dtype=complex)
    for value, axes, centre, angle in HEAD:
        half = side * np.array(axes[:d])
        q = 2 * np.pi * np.linalg.norm(in_own_axes(k, angle) * half, axis=-1)
        small = q < 1e-2
        r = np.where(small, 1.0, q)
        if d == 2:
            ball = np.pi * np.where(small, 1 - q**2 / 8, 2 * j1(r) / r)
        else:
            ball = 4 / 3 * np.pi * np.where(small, 1 - q**2 / 10, 3 * (np.sin(r) - r * np.cos(r)) / r**3)
        signal += value * half.prod() * ball * np.exp(-2j * np.pi * side * (k @ np.array(centre[:d])))
    return signal


def image_of_all(shape: tuple[int, ...]) -> np.ndarray:
    """The image that all of k-space within the disc or ball |k| ≤ 1/2 makes, by Gaussian quadrature.

    Weights can do no better. Against the head itself, rings of a finite k-space would hide what they do.
    """
    side = shape[0]  # phases go through π side radians at most: a few nodes more than half of that for each axis
    node, weight = np.polynomial.legendre.leggauss(2 * side)
    radius, radius_weight = (node + 1) / 4, weight / 4
    angle = 2 * np.pi * np.arange(4 * side) / (4 * side)
    directions, weights = np.stack([np.cos(angle), np.sin(angle)], axis=-1), np.full(4 * side, 2 * np.pi / (4 * side))
    if len(shape) == 3:
        z, z_weight = np.polynomial.legendre.leggauss(4 * side)
        around = np.sqrt(1 - z**2)[:, None, None] * directions
        height = np.broadcast_to(z[:, None, None], (*around.shape[:2], 1))
        directions = np.concatenate([around, height], axis=-1).reshape(-1, 3)
        weights = np.outer(z_weight, weights).ravel()
    positions = (radius[:, None, None] * directions).reshape(-1, len(shape))
    return adjoint(positions, np.outer(radius_weight * radius ** (len(shape) - 1), weights).ravel(), shape)


def adjoint(positions: np.ndarray, weights: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """The image Σ w s(k) exp(2πi k·r) of the head, by mri-nufft."""
    radians = 2 * np.pi * positions
    operator = mrinufft.get_operator("finufft")(radians, shape, density=weights, squeeze_dims=True)
    return operator.adj_op(samples_of_head(positions, shape)).real * operator.norm_factor


def field_of_view(shape: tuple[int, ...]) -> np.ndarray:
    """The disc or ball of which radial sampling at the Nyquist rate makes an image."""
    axes = np.meshgrid(*[(np.arange(n) - n // 2) * 2 / n for n in shape], indexing="ij", sparse=True)
    return sum(x**2 for x in axes) <= 1


def cpu_seconds(call: Callable[[], np.ndarray]) -> tuple[np.ndarray, float]:
    """What a call returns, and its CPU time."""
    start = time.process_time()
    result = call()
    return result, time.process_time() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("out/mri"))
    parser.add_argument("--scale", type=float, default=1.0, help="of shots, samples per shot and image sides")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)

    rows, panels = [], []
    for case in cases(options.scale):
        positions = case.trajectory.reshape(-1, len(case.shape))
        seen = field_of_view(case.shape)
        best = image_of_all(case.shape) * seen
        panels.append([("all of the disc or ball", best)])
        for method, settings in METHODS.items():
            weigh = get_density(method)
            weights, seconds = cpu_seconds(lambda: weigh(case.trajectory.copy(), case.shape, **settings))  # noqa: B023
            image = adjoint(positions, weights, case.shape) * seen
            image *= (image * best).sum() / (image**2).sum()  # mri-nufft's weights have no scale
            error = np.linalg.norm(image - best) / np.linalg.norm(best)
            rows.append([case.name, len(positions), "x".join(map(str, case.shape)), method, seconds, error])
            panels[-1].append((f"{method}: {error:.2g}", image))
            print(f"{case.name}: {method} {seconds:.2f} s, error {error:.3g}", flush=True)

    with (options.output / "density.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["trajectory", "samples", "image", "method", "cpu_seconds", "error"])
        writer.writerows([*row[:4], f"{row[4]:.4g}", f"{row[5]:.4g}"] for row in rows)
    draw(panels, [case.name for case in cases(options.scale)], options.output / "density.png")


def draw(panels: list[list[tuple[str, np.ndarray]]], names: list[str], target: Path) -> None:
    """A row of images for each trajectory; of a volume the middle slice."""
    with house_style():
        figure = new_figure(height=2.2 * len(panels), width=8.8)
        grid = figure.subplots(len(panels), len(panels[0]))
        for axes_row, row, name in zip(grid, panels, names, strict=True):
            for axes, (title, image) in zip(axes_row, row, strict=True):
                middle = image if image.ndim == 2 else image[:, :, image.shape[2] // 2]
                axes.imshow(middle.T, origin="lower", cmap="gray", vmin=0, vmax=0.5)
                axes.set_title(title, fontsize=9, fontweight="normal")
                axes.set_xticks([])
                axes.set_yticks([])
            axes_row[0].set_ylabel(name, fontsize=9)
        figure.savefig(target, dpi=DPI)


if __name__ == "__main__":
    main()
