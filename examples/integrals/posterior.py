"""Expectation over a posterior: the variance of normal data with unknown mean, as a ratio of two integrals."""

import numpy as np
from report import report

import voroquad as vq

DATA = np.array([1.2, 0.7, 1.9, 1.4, 0.4, 1.1, 1.6])


def example(seed):
    def numerator_and_evidence(x):
        mean, variance = x
        squares = ((DATA[:, None] - mean) ** 2).sum(axis=0)
        density = variance ** (-len(DATA) / 2 - 1) * np.exp(-squares / (2 * variance))  # prior 1 / variance
        return np.stack([variance * density, density])

    both = vq.quad(numerator_and_evidence, [-np.inf, 0], [np.inf, np.inf], loc=1, scale=0.5, n_points=4096, rng=seed)
    n = len(DATA)
    return both.ratio(0, 1), DATA.var() * n / (n - 3)  # inverse-gamma


if __name__ == "__main__":
    report(example)
