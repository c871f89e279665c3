"""An Asian option: a call on the geometric mean of a price at eight dates (Kemna and Vorst 1990)."""

import numpy as np
from report import report
from scipy import stats

import voroquad as vq

DATES, SPOT, STRIKE, RATE, VOLATILITY = 8, 100.0, 100.0, 0.05, 0.2


def example(seed):
    times = np.arange(1, DATES + 1) / DATES
    steps = np.sqrt(np.diff(times, prepend=0.0))

    def payoff(z):
        logs = (RATE - VOLATILITY**2 / 2) * times[:, None] + VOLATILITY * np.cumsum(steps[:, None] * z, axis=0)
        return np.exp(-RATE) * np.maximum(SPOT * np.exp(logs.mean(axis=0)) - STRIKE, 0)

    paths = vq.ProductMeasure(*[stats.norm()] * DATES)
    return vq.quad(payoff, measure=paths, n_points=4096, rng=seed), known(times)


def known(times):
    """The price in closed form: the mean logarithm is normal."""
    mean = np.log(SPOT) + (RATE - VOLATILITY**2 / 2) * times.mean()
    sd = VOLATILITY * np.sqrt(np.minimum.outer(times, times).mean())
    d = (mean - np.log(STRIKE)) / sd
    forward = np.exp(mean + sd**2 / 2) * stats.norm.cdf(d + sd)
    return np.exp(-RATE) * (forward - STRIKE * stats.norm.cdf(d))


if __name__ == "__main__":
    report(example)
