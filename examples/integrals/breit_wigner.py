"""A Breit–Wigner cross section, integrated over the squared energy: the peak of the Z boson, GeV."""

import numpy as np
from report import report

import voroquad as vq

MASS, WIDTH = 91.19, 2.495


def example(seed):
    low, high = 60.0**2, 120.0**2

    def resonance(x):
        return 1 / ((x[0] - MASS**2) ** 2 + (MASS * WIDTH) ** 2)

    result = vq.quad(resonance, low, high, n_points=512, rng=seed)
    angle = np.arctan((np.array([low, high]) - MASS**2) / (MASS * WIDTH))
    return result, (angle[1] - angle[0]) / (MASS * WIDTH)


if __name__ == "__main__":
    report(example)
