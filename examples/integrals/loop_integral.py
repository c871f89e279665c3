"""A loop integral: the triangle of three equal masses, as in the decay of the Higgs boson to photons."""

import numpy as np
from report import report

import voroquad as vq

MASS, S = 1.0, 3.0  # below the threshold, s < 4 m²


def example(seed):
    parameters = vq.Triangle([[0, 0], [1, 0], [0, 1]])
    result = vq.quad(lambda x: 1 / (MASS**2 - S * x[0] * x[1]), parameters, n_points=1024, rng=seed)
    return result, 2 / S * np.arcsin(np.sqrt(S) / (2 * MASS)) ** 2


if __name__ == "__main__":
    report(example)
