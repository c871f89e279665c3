"""Light transport: what share of the light of a square lamp reaches an equal square opposite, at the distance 1."""

import numpy as np
from report import report

import voroquad as vq


def example(seed):
    def geometry(x):
        squared = 1 + (x[0] - x[2]) ** 2 + (x[1] - x[3]) ** 2
        return 1 / (np.pi * squared**2)  # both cosines are 1 / r

    result = vq.quad(geometry, np.zeros(4), np.ones(4), n_points=1296, rng=seed)
    logarithm = np.log(np.sqrt(4 / 3))
    known = 2 / np.pi * (logarithm + 2 * np.sqrt(2) * np.arctan(1 / np.sqrt(2)) - np.pi / 2)
    return result, known


if __name__ == "__main__":
    report(example)
