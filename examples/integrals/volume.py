"""The volume of a body: what two cylinders of radius 1 at a right angle have in common, 16/3 (Archimedes)."""

import numpy as np
from report import report

import voroquad as vq


def example(seed):
    def inside(x):
        return (x[0] ** 2 + x[2] ** 2 < 1) & (x[1] ** 2 + x[2] ** 2 < 1)

    return vq.quad(lambda x: inside(x).astype(float), -np.ones(3), np.ones(3), n_points=2744, rng=seed), 16 / 3


if __name__ == "__main__":
    report(example)
