"""Errors of `quad` on bodies beside those on the box: a polynomial and a peak, with known integrals.

    VOROQUAD_NUM_THREADS=1 python benchmarks/domain_rates.py        # about five minutes
    python benchmarks/domain_rates.py disc ball                     # only these rows anew

Writes benchmarks/results/domain_rates.csv: the root mean square of the relative errors of 6 estimates. The polynomial
has the degree 16 and the root of the mean square distance from the centre as its scale. The peak is a Gaussian off the
centre, whose width is .11 of the radius of a ball that the body holds. "Polar" bodies are those of
:class:`voroquad.PolarBall`.
"""

from __future__ import annotations

import argparse
import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import csv_rows
import numpy as np
from numpy.polynomial.legendre import leggauss

import voroquad as vq
from voroquad.integrals.places import parts_of

RESULT = Path(__file__).parent / "results" / "domain_rates.csv"
SIZES, REPETITIONS = (512, 2048, 8192), 6
DEGREE, NODES = 16, 40
Function = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Body:
    """A domain as `quad` takes it, one with polynomial or trigonometric maps, and a ball that it holds."""

    domain: tuple[Any, ...]
    known: Any
    center: np.ndarray
    radius: float

    @property
    def d(self) -> int:
        return len(self.center)

    def polynomial(self) -> tuple[Function, float]:
        """(3/2 + t)^16 with t along the diagonal, and its integral by Gauss quadrature."""
        rules = [gauss(region) for region in self.known]
        whole = sum(float(w.sum()) for _, w in rules)
        spread = math.sqrt(sum(float(w @ np.square(self._along(x))) for x, w in rules) / whole)

        def f(x: np.ndarray) -> np.ndarray:
            return (1.5 + self._along(x) / (2 * spread)) ** DEGREE

        return f, sum(float(w @ f(x)) for x, w in rules)

    def _along(self, x: np.ndarray) -> np.ndarray:
        return (x - self.center[:, None]).sum(axis=0)

    def peak(self) -> tuple[Function, float]:
        """What is left outside of the body is less than 10⁻¹²."""
        sigma = 0.11 * self.radius
        at = self.center + self.radius * np.array([0.1, -0.1, 0.05])[: self.d]

        def f(x: np.ndarray) -> np.ndarray:
            return np.exp(-np.square((x - at[:, None]) / sigma).sum(axis=0) / 2)

        return f, (2 * math.pi * sigma**2) ** (self.d / 2)


def gauss(region: Any) -> tuple[np.ndarray, np.ndarray]:
    """Points and weights of a tensor product of Gauss rules."""
    t, w = leggauss(NODES)
    nodes = np.stack([axis.ravel() for axis in np.meshgrid(*[(t + 1) / 2] * region.d)])
    weights = np.prod([axis.ravel() for axis in np.meshgrid(*[w / 2] * region.d)], axis=0)
    x, element = region.pull_back(nodes)
    return x, weights * element


def bodies() -> dict[str, Body]:
    box = {d: [part.region for part in parts_of([-1] * d, [1] * d, None, 0, 1)[0]] for d in (2, 3)}
    polygon = vq.Polygon([[0, 0], [3, 0], [3, 1], [2, 2], [0, 3]], holes=[[[2, 0.4], [2.6, 0.4], [2.3, 0.9]]])
    corner = {d: vq.Simplex(np.concatenate([np.zeros((1, d)), np.eye(d)])) for d in (2, 3)}
    inradius = {d: 1 / (d + math.sqrt(d)) for d in (2, 3)}
    found = {}
    for d, (cube, simplex, ball) in {2: ("square", "triangle", "disc"), 3: ("cube", "tetrahedron", "ball")}.items():
        polar = vq.PolarBall(np.zeros(d))
        found[cube] = Body(([-1] * d, [1] * d), box[d], np.zeros(d), 1.0)
        found[simplex] = Body((corner[d],), [corner[d]], np.full(d, inradius[d]), inradius[d])
        found[ball] = Body((vq.Ball(np.zeros(d)),), [polar], np.zeros(d), 1.0)
        found[f"polar {ball}"] = Body((polar,), [polar], np.zeros(d), 1.0)
    return found | {"polygon": Body((polygon,), polygon.trapezoids, np.array([0.9, 0.9]), 0.9)}


def errors(body: Body, integrand: tuple[Function, float], n: int) -> float:
    f, exact = integrand
    found = [vq.quad(f, *body.domain, n_points=n, rng=seed).integral for seed in range(REPETITIONS)]
    return float(np.sqrt(np.mean(np.square(np.array(found) / exact - 1))))


def main() -> None:
    known = bodies()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bodies", nargs="*", default=list(known), help="to measure; all others keep their rows")
    warnings.simplefilter("ignore", vq.IntegrationWarning)
    order = list(known)
    for name in parser.parse_args().bodies:
        body = known[name]
        for kind, integrand in (("polynomial", body.polynomial()), ("peak", body.peak())):
            rows = [[body.d, name, kind, n, f"{errors(body, integrand, n):.1e}"] for n in SIZES]
            print(*rows, flush=True)
            csv_rows.put(
                RESULT,
                ("d", "body", "integrand", "n", "error"),
                rows,
                key=lambda row: (int(row[0]), order.index(row[1]), row[2], int(row[3])),
            )


if __name__ == "__main__":
    main()
