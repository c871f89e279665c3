"""Smooth maps of simplices, balls and spheres against uniform points: errors of `quad`.

    python benchmarks/domain_maps.py

Writes benchmarks/results/domain_maps.csv: for each domain, integrand and number of points the root mean square of the
standard errors of 4 sets, with the smooth map and with uniform points. It chose `SMOOTH` in integrals/domains.py.
"""

from __future__ import annotations

import csv
import warnings
from pathlib import Path

import numpy as np

import voroquad as vq
from voroquad.integrals import domains

RESULT = Path(__file__).parent / "results" / "domain_maps.csv"
INTEGRANDS = {
    "exp": lambda x: np.exp(x.sum(axis=0)),
    "peak": lambda x: np.exp(-50 * ((x - 0.2) ** 2).sum(axis=0)),
    "edge": lambda x: 1.0 * (x[0] + 0.7 * x[1] < 0.35),
}


def regions() -> dict[str, object]:
    found: dict[str, object] = {}
    for k in (2, 3, 4):
        found[f"simplex {k}"] = vq.Simplex(np.concatenate([np.zeros((1, k)), np.eye(k)]))
        found[f"ball {k}"] = vq.Ball(np.zeros(k))
        found[f"sphere {k}"] = vq.SphereSurface(np.zeros(k + 1))
    return found


def errors(region: object, n: int) -> np.ndarray:
    """Root mean square of the standard errors of each integrand."""
    found = [
        vq.quad(lambda x: np.stack([f(x) for f in INTEGRANDS.values()]), region, n_points=n, rng=seed).standard_error
        for seed in range(4)
    ]
    return np.sqrt(np.mean(np.square(found), axis=0))


def main() -> None:
    warnings.simplefilter("ignore", vq.IntegrationWarning)
    with RESULT.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["domain", "n", "integrand", "smooth", "uniform"])
        for name, region in regions().items():
            for n in (128, 512, 2048):
                kinds = []
                for domains.SMOOTH in (8, 0):
                    kinds.append(errors(region, n))
                for integrand, smooth, uniform in zip(INTEGRANDS, *kinds, strict=True):
                    writer.writerow([name, n, integrand, f"{smooth:.2e}", f"{uniform:.2e}"])


if __name__ == "__main__":
    main()
