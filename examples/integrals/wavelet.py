"""Wavelet coefficients: a bell seen by Mexican hats at eight places, all from the same samples."""

import numpy as np
from report import report

import voroquad as vq


def example(seed):
    places = np.arange(8.0)[:, None] / 2

    def products(x):
        t = x[0] - places
        return np.exp(-(x[0] ** 2) / 2) * (1 - t**2) * np.exp(-(t**2) / 2)

    result = vq.quad(products, -8, 8, n_points=256, rng=seed)
    b = places[:, 0]
    return result, np.sqrt(np.pi) * (1 / 2 - b**2 / 4) * np.exp(-(b**2) / 4)


if __name__ == "__main__":
    report(example)
