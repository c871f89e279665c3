"""A Green's function over a polygon: the potential at a corner inside an L-shaped plate of charge, −log(r) / 2π."""

import numpy as np
from report import report

import voroquad as vq

PLATE = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], float)
PLACE = np.array([0.5, 0.5])


def example(seed):
    def potential(x):
        return -np.log(np.hypot(x[0] - PLACE[0], x[1] - PLACE[1])) / (2 * np.pi)

    return vq.quad(potential, vq.Polygon(PLATE), n_points=4096, rng=seed), known()


def known():
    """Sum over the triangles that the edges make with the place."""
    total = 0.0
    for a, b in zip(PLATE - PLACE, np.roll(PLATE, -1, axis=0) - PLACE, strict=True):
        along = (b - a) / np.hypot(*(b - a))
        height = a[0] * along[1] - a[1] * along[0]
        ends = np.array([a @ along, b @ along])
        terms = ends * (np.log(np.hypot(height, ends)) - 1.5) + height * np.arctan(ends / height)
        total += height / 2 * (terms[1] - terms[0])
    return -total / (2 * np.pi)


if __name__ == "__main__":
    report(example)
