"""Smooth maps of simplices, balls and spheres against uniform points: errors of `quad`.

    python benchmarks/domain_maps.py
    python benchmarks/domain_maps.py "ball 2" "ball 3"  # only these rows anew

Writes benchmarks/results/domain_maps.csv: for each domain, integrand and number of points the root mean square of the
standard errors of 4 sets, with the smooth map and with uniform points. It chose `SMOOTH` in integrals/domains.py.
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
INTEGRANDS = {
    "exp": lambda x: np.exp(x.sum(axis=0)),
    "peak": lambda x: np.exp(-50 * ((x - 0.2) ** 2).sum(axis=0)),
    "edge": lambda x: 1.0 * (x[0] + 0.7 * x[1] < 0.35),
}


def regions() -> dict[str, object]:
    found: dict[str, object] = {}
    for k in (2, 3, 4):
        found[f"simplex {k}"] = vq.Simplex(np.concatenate([np.zeros((1, k)), np.eye(k)]))
        if k <= domains.SMOOTH:
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
    known = regions()
    order, of_domain = list(known), list(INTEGRANDS)
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("domains", nargs="*", default=order, help="to measure; all others keep their rows")
    warnings.simplefilter("ignore", vq.IntegrationWarning)
    for name in parser.parse_args().domains:
        rows = []
        for n in (128, 512, 2048):
            kinds = []
            for domains.SMOOTH in (8, 0):
                kinds.append(errors(known[name], n))
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
