"""Asian options of 16 steps: expectations over a Gaussian of 16 dimensions, with and without rotation.

    python benchmarks/asian_option.py

Writes benchmarks/results/asian_option.csv: mean squared errors of 40 estimates of the price of a call and of a digital
option (S = K = 100, volatility 0.2, rate 0.05, one year), by Monte Carlo, by 8 sets of scrambled Sobol' points, and by
`quad`. The reference values are means of 32 sets of 2^16 Sobol' points in principal components of the path.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import scipy.stats
from scipy.special import ndtri
from scipy.stats import qmc

import voroquad as vq

RESULT = Path(__file__).parent / "results" / "asian_option.csv"
STEPS, REPETITIONS = 16, 40
TIMES = np.arange(1, STEPS + 1)[:, None] / STEPS


def path_mean(z: np.ndarray) -> np.ndarray:
    """Mean price (n,) along the path that increments z (steps, n) make."""
    w = np.cumsum(z, axis=0) / math.sqrt(STEPS)
    return (100 * np.exp((0.05 - 0.02) * TIMES + 0.2 * w)).mean(axis=0)


PAYOFFS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "call": lambda z: math.exp(-0.05) * np.maximum(path_mean(z) - 100, 0),
    "digital": lambda z: math.exp(-0.05) * (path_mean(z) > 100),
}


def normal(u: np.ndarray) -> np.ndarray:
    return ndtri(np.clip(u, 2.0**-54, 1 - 2.0**-53)).T


def principal_components() -> np.ndarray:
    """Orthogonal (steps, steps): increments of the path from its principal components."""
    values, vectors = np.linalg.eigh(np.minimum(TIMES, TIMES.T))
    vectors, values = vectors[:, ::-1], values[::-1]
    return np.linalg.solve(np.linalg.cholesky(np.minimum(TIMES, TIMES.T)), vectors * np.sqrt(values))


def reference(payoff: Callable[[np.ndarray], np.ndarray]) -> float:
    q = principal_components()
    sets = [qmc.Sobol(STEPS, rng=[1, k]).random_base2(16) for k in range(32)]
    return float(np.mean([payoff(q @ normal(u)).mean() for u in sets]))


def by_monte_carlo(payoff: Callable[[np.ndarray], np.ndarray], n: int, seed: int) -> float:
    return float(payoff(np.random.default_rng([2, seed]).normal(size=(STEPS, n))).mean())


def by_sobol(payoff: Callable[[np.ndarray], np.ndarray], n: int, seed: int) -> float:
    sets = [qmc.Sobol(STEPS, rng=[3, seed, k]).random(n // 8) for k in range(8)]
    return float(np.mean([payoff(normal(u)).mean() for u in sets]))


def by_quad(payoff: Callable[[np.ndarray], np.ndarray], n: int, seed: int) -> float:
    measure = vq.ProductMeasure(*[scipy.stats.norm()] * STEPS)
    return vq.quad(payoff, measure=measure, n_points=n, rng=seed).integral


METHODS = {"monte-carlo": by_monte_carlo, "sobol": by_sobol, "quad": by_quad}


def main() -> None:
    with RESULT.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["option", "n", "method", "mse"])
        for option, payoff in PAYOFFS.items():
            exact = reference(payoff)
            for n in (1024, 8192):
                for name, method in METHODS.items():
                    errors = np.array([method(payoff, n, seed) - exact for seed in range(REPETITIONS)])
                    writer.writerow([option, n, name, f"{np.mean(errors**2):.2e}"])
                    file.flush()


if __name__ == "__main__":
    main()
