"""Smooth maps of simplices, balls and spheres against uniform points: errors of `quad`.

    python benchmarks/domain_maps.py
    python benchmarks/domain_maps.py "ball 2" "ball 3"  # only these rows anew

Writes benchmarks/results/domain_maps.csv: for each domain, integrand and number of points the standard deviation of 8
to 64 estimates, with the smooth map and with uniform points. It chose `SMOOTH`, and the numbers of samples from which
smooth maps are taken, in integrals/domains.py.
"""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path

import csv_rows
import numpy as np

import voroquad as vq
from voroquad.integrals import domains

RESULT = Path(__file__).parent / "results" / "domain_maps.csv"
SIZES = (16, 32, 64, 128, 192, 512, 2048)
INTEGRANDS = {
    "linear": lambda x: 1 + x[0] + x[-1] / 2,
    "exp": lambda x: np.exp(x.sum(axis=0)),
    "peak": lambda x: np.exp(-50 * ((x - 0.2) ** 2).sum(axis=0)),
    "edge": lambda x: 1.0 * (x[0] + 0.7 * x[1] < 0.35),
}


def regions() -> dict[str, domains.HasUniformMap]:
    found: dict[str, domains.HasUniformMap] = {}
    for k in (2, 3, 4):
        found[f"simplex {k}"] = vq.Simplex(np.concatenate([np.zeros((1, k)), np.eye(k)]))
        if k <= domains.SMOOTH:
            found[f"ball {k}"] = vq.Ball(np.zeros(k))
        found[f"sphere {k}"] = vq.SphereSurface(np.zeros(k + 1))
    return found


class Mapped:
    """A domain by one of its maps, whatever the number of samples."""

    empty = False

    def __init__(self, domain: domains.HasUniformMap, uniform: bool):
        self.d, self._domain, self._uniform = domain.d, domain, uniform

    def pull_back(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self._domain.mapped(u, self._uniform)


def errors(region: Mapped, n: int) -> np.ndarray:
    """The spread of estimates of each integrand."""

    def func(x: np.ndarray) -> np.ndarray:
        return np.stack([f(x) for f in INTEGRANDS.values()])

    sets = min(64, max(8, 8192 // n))
    found = [vq.quad(func, region, n_points=n, adapt=False, rng=seed).integral for seed in range(sets)]
    return np.std(found, axis=0, ddof=1)


def main() -> None:
    known = regions()
    order, of_domain = list(known), list(INTEGRANDS)
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("domains", nargs="*", default=order, help="to measure; all others keep their rows")
    warnings.simplefilter("ignore", vq.IntegrationWarning)
    for name in parser.parse_args().domains:
        rows = []
        for n in SIZES:
            kinds = [errors(Mapped(known[name], uniform), n) for uniform in (False, True)]
            for integrand, smooth, uniform in zip(INTEGRANDS, *kinds, strict=True):
                rows.append([name, n, integrand, f"{smooth:.2e}", f"{uniform:.2e}"])
        csv_rows.put(
            RESULT,
            ("domain", "n", "integrand", "smooth", "uniform"),
            rows,
            key=lambda row: (order.index(row[0]), int(row[1]), of_domain.index(row[2])),
        )


if __name__ == "__main__":
    main()
