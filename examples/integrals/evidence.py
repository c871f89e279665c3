"""Evidence of a small model: the probability of the data under a line with normal priors on its two coefficients."""

import numpy as np
from report import report
from scipy import stats

import voroquad as vq


def example(seed):
    t = np.linspace(0, 1, 5)
    y = np.array([0.3, 0.1, 0.9, 1.2, 1.1])
    noise = 0.3

    def likelihood(theta):
        return stats.norm.pdf(y[:, None], theta[0] + t[:, None] * theta[1], noise).prod(axis=0)

    prior = vq.ProductMeasure(stats.norm(), stats.norm())
    result = vq.quad(likelihood, measure=prior, n_points=4096, rng=seed)
    design = np.stack([np.ones(5), t], axis=1)
    known = stats.multivariate_normal(cov=design @ design.T + noise**2 * np.eye(5)).pdf(y)
    return result, known


if __name__ == "__main__":
    report(example)
