"""A thermally averaged rate: fusion through the Coulomb barrier, ∫ exp(−E/kT − √(E_G/E)) dE, in units of kT."""

import numpy as np
from report import report
from scipy.integrate import quad

import voroquad as vq

GAMOW = 390.0  # E_G / kT of two protons at 15 million kelvin


def example(seed):
    def gamow(x):
        with np.errstate(divide="ignore"):
            return np.exp(-x[0] - np.sqrt(GAMOW / x[0]))

    peak = (np.sqrt(GAMOW) / 2) ** (2 / 3)
    result = vq.quad(gamow, 0, np.inf, scale=peak, n_points=512, rng=seed)
    known = quad(lambda e: gamow([e]), 0, 60, points=[peak], epsabs=0, epsrel=1e-12)[0]
    return result, known


if __name__ == "__main__":
    report(example)
