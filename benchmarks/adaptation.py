"""Peaks: `quad` with and without adaptation beside vegas, at equal evaluations.

    python benchmarks/adaptation.py

Writes benchmarks/results/adaptation.csv: mean squared errors of 6 estimates from 8000 evaluations each, of integrals
that are 1. vegas adapts in 2 iterations and takes the mean of 3 ("vegas"), or adapts in 5 iterations on 40 % with
alpha = 0.8 and is frozen then ("tuned"). `quad` takes order 1 in d = 4 and method "plain" in d = 6.
"""

from __future__ import annotations

import csv
import math
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import vegas
from scipy.special import erf

import voroquad as vq

RESULT = Path(__file__).parent / "results" / "adaptation.csv"
N, REPETITIONS = 8000, 6
Function = Callable[[np.ndarray], np.ndarray]


def centers(d: int) -> np.ndarray:
    return np.linspace(0.3, 0.6, d)[:, None]


def gaussian(d: int, sigma: float) -> Function:
    s, c = sigma * math.sqrt(2), centers(d)
    exact = np.prod(math.sqrt(math.pi) * s / 2 * (erf((1 - c) / s) + erf(c / s)))
    return lambda x: np.exp(-(((x - c) / s) ** 2).sum(axis=0)) / exact


def resonances(d: int, width: float = 0.01) -> Function:
    """A product of Breit-Wigner peaks."""
    c = centers(d)
    exact = np.prod((np.arctan((1 - c) / width) + np.arctan(c / width)) / width)
    return lambda x: np.prod(1 / ((x - c) ** 2 + width**2), axis=0) / exact


def power(d: int) -> Function:
    return lambda x: (x[0] * x[1]) ** -0.45 * 0.55**2


def ridge(d: int, sigma: float = 0.02) -> Function:
    """Along the diagonal of the first two axes; its integral is that of a Gaussian of x - y, 1 - |x - y| dense."""
    t = np.linspace(-1, 1, 200_001)
    exact = np.trapezoid((1 - abs(t)) * np.exp(-(t**2) / (2 * sigma**2)), t)
    return lambda x: np.exp(-((x[0] - x[1]) ** 2) / (2 * sigma**2)) / exact


CASES: list[tuple[str, int, Function]] = [
    ("Gaussian, sigma = 0.03", 2, gaussian(2, 0.03)),
    ("Breit-Wigner product", 2, resonances(2)),
    ("(xy)^-0.45", 2, power(2)),
    ("diagonal ridge", 2, ridge(2)),
    ("Gaussian, sigma = 0.03", 4, gaussian(4, 0.03)),
    ("Breit-Wigner product", 4, resonances(4)),
    ("(xy)^-0.45", 4, power(4)),
    ("Gaussian, sigma = 0.06", 6, gaussian(6, 0.06)),
    ("Breit-Wigner product", 6, resonances(6)),
]
OPTIONS = {2: {}, 4: {"order": 1}, 6: {"method": "plain"}}


def by_quad(adapt: bool) -> Callable[[Function, int, int], float]:
    def estimate(f: Function, d: int, seed: int) -> float:
        return vq.quad(f, [0] * d, [1] * d, n_points=N, adapt=adapt, rng=seed, **OPTIONS[d]).integral

    return estimate


def by_vegas(f: Function, d: int, seed: int) -> float:
    integrator = vegas.Integrator([[0, 1]] * d, ran_array_generator=np.random.default_rng([seed, 1]).random)
    batch = vegas.batchintegrand(lambda x: f(x.T))
    integrator(batch, nitn=2, neval=N // 5)
    return float(integrator(batch, nitn=3, neval=N // 5).mean)


def by_tuned_vegas(f: Function, d: int, seed: int) -> float:
    integrator = vegas.Integrator([[0, 1]] * d, alpha=0.8, ran_array_generator=np.random.default_rng([seed, 2]).random)
    batch = vegas.batchintegrand(lambda x: f(x.T))
    integrator(batch, nitn=5, neval=int(0.4 * N / 5))
    return float(integrator(batch, nitn=1, neval=int(0.6 * N), adapt=False).mean)


METHODS = {"vegas": by_vegas, "tuned": by_tuned_vegas, "adapt=False": by_quad(False), "adapt=True": by_quad(True)}


def main() -> None:
    warnings.simplefilter("ignore", vq.IntegrationWarning)
    with RESULT.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["d", "integrand", "method", "mse"])
        for name, d, f in CASES:
            for method, estimate in METHODS.items():
                errors = np.array([estimate(f, d, seed) - 1 for seed in range(REPETITIONS)])
                writer.writerow([d, name, method, f"{np.mean(errors**2):.1e}"])
                file.flush()


if __name__ == "__main__":
    main()
