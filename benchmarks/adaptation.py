"""Peaks: `quad` with and without adaptation beside vegas, at equal evaluations.

    python benchmarks/adaptation.py
    python benchmarks/adaptation.py adapt=auto  # only these rows anew

Writes benchmarks/results/adaptation.csv. Each row of it is a family of integrands whose integrals are 1. Its members
have centres, widths, corners and signs drawn at random (seed 18); while `quad` was tuned, others were looked at. `mse`
is the geometric mean over 4 members of the mean squared error of 6 estimates from 8000 evaluations each, `covered` the
part of all 95 % intervals that hold the integral or come with a warning. vegas adapts in 2 iterations and takes the
mean of 3 ("vegas"), or adapts in 5 iterations on 40 % with alpha = 0.8 and is frozen then ("tuned").
"""

from __future__ import annotations

import argparse
import csv
import itertools
import math
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import scipy.integrate
import vegas
from scipy.special import erf

import voroquad as vq

RESULT = Path(__file__).parent / "results" / "adaptation.csv"
N, MEMBERS, REPETITIONS = 8000, 4, 6
Function = Callable[[np.ndarray], np.ndarray]
Family = Callable[[int, np.random.Generator], Function]
#: Of a function, its dimension, a seed and a number of evaluations: the mean, and whether its interval holds 1
Method = Callable[[Function, int, int, int], tuple[float, bool]]


def width(typical: float, rng: np.random.Generator) -> float:
    """Within a factor 2^½ of what is typical, either way."""
    return typical * 2 ** rng.uniform(-0.5, 0.5)


def bell(center: np.ndarray, sigma: float) -> tuple[Function, float]:
    """A Gaussian of the height 1, and its integral."""
    s, c = sigma * math.sqrt(2), center[:, None]
    exact = np.prod(math.sqrt(math.pi) * s / 2 * (erf((1 - c) / s) + erf(c / s)))
    return (lambda x: np.exp(-(((x - c) / s) ** 2).sum(axis=0))), float(exact)


def gaussian(d: int, rng: np.random.Generator) -> Function:
    f, exact = bell(rng.uniform(0.25, 0.75, d), width(0.03 if d < 6 else 0.06, rng))
    return lambda x: f(x) / exact


def gaussians(d: int, rng: np.random.Generator) -> Function:
    """Three, one of them negative."""
    bells = [bell(rng.uniform(0.2, 0.8, d), width(0.04, rng)) for _ in range(3)]
    signs = (1.0, 1.0, -0.5)
    exact = sum(sign * integral for sign, (_, integral) in zip(signs, bells, strict=True))
    return lambda x: sum(sign * f(x) for sign, (f, _) in zip(signs, bells, strict=True)) / exact


def smooth_rest(x: np.ndarray) -> np.ndarray:
    """exp of all coordinates but the first two, over its integral."""
    return np.exp(x[2:].sum(axis=0)) / (math.e - 1) ** (len(x) - 2)


def resonances(d: int, rng: np.random.Generator) -> Function:
    """A product of two Breit-Wigner peaks."""
    c, w = rng.uniform(0.25, 0.75, (2, 1)), width(0.01, rng)
    exact = np.prod((np.arctan((1 - c) / w) + np.arctan(c / w)) / w)
    return lambda x: smooth_rest(x) * np.prod(1 / ((x[:2] - c) ** 2 + w**2), axis=0) / exact


def resonance_in_product(d: int, rng: np.random.Generator) -> Function:
    """A Breit-Wigner peak of xy, whose density is -log."""
    m, w = rng.uniform(0.15, 0.4), width(0.01, rng)
    ends = (0, m - 5 * w, m, m + 5 * w, 1)
    exact = sum(
        scipy.integrate.quad(lambda s: -math.log(s) / ((s - m) ** 2 + w**2), a, b, limit=500, epsabs=0, epsrel=1e-12)[0]
        for a, b in itertools.pairwise(ends)
    )
    return lambda x: smooth_rest(x) / ((x[0] * x[1] - m) ** 2 + w**2) / exact


def ridge(d: int, rng: np.random.Generator) -> Function:
    """Along either diagonal of the first two axes: the integral is that of a Gaussian of t = x - y, 1 - |t| dense."""
    sigma, falling = width(0.02, rng), rng.random() < 0.5
    t = np.linspace(-1, 1, 200_001)
    exact = np.trapezoid((1 - abs(t)) * np.exp(-(t**2) / (2 * sigma**2)), t)

    def f(x: np.ndarray) -> np.ndarray:
        y = 1 - x[1] if falling else x[1]
        return smooth_rest(x) * np.exp(-((x[0] - y) ** 2) / (2 * sigma**2)) / exact

    return f


def at_corner(x: np.ndarray, corner: np.ndarray) -> np.ndarray:
    """The first two coordinates, counted from a corner of the square."""
    return np.where(corner[:, None], 1 - x[:2], x[:2])


def power(d: int, rng: np.random.Generator) -> Function:
    p, corner = rng.uniform(0.35, 0.45), rng.random(2) < 0.5
    return lambda x: smooth_rest(x) * np.prod(at_corner(x, corner), axis=0) ** -p * (1 - p) ** 2


def pole(d: int, rng: np.random.Generator) -> Function:
    """1/r at a corner."""
    corner = rng.random(2) < 0.5
    return lambda x: 1 / np.hypot(*at_corner(x, corner)) / (2 * math.log(1 + math.sqrt(2)))


def disc(d: int, rng: np.random.Generator) -> Function:
    c, r = rng.uniform(0.25, 0.75, (2, 1)), width(0.1, rng)
    return lambda x: (np.square(x - c).sum(axis=0) < r * r) / (math.pi * r * r)


FAMILIES: list[tuple[str, Family, tuple[int, ...]]] = [
    ("Gaussian", gaussian, (2, 4, 6)),
    ("three Gaussians", gaussians, (2,)),
    ("Breit-Wigner product", resonances, (2, 4, 6)),
    ("resonance in xy", resonance_in_product, (2, 4)),
    ("diagonal ridge", ridge, (2, 4)),
    ("power at a corner", power, (2, 4, 6)),
    ("1/r at a corner", pole, (2,)),
    ("disc", disc, (2,)),
]
CASES = sorted(((d, name, family) for name, family, ds in FAMILIES for d in ds), key=lambda case: case[0])


def members(family: Family, d: int, seed: int = 18) -> Iterator[Function]:
    for k in range(MEMBERS):
        yield family(d, np.random.default_rng([seed, d, k]))


def by_quad(adapt: bool | str) -> Method:
    def estimate(f: Function, d: int, seed: int, n: int) -> tuple[float, bool]:
        r = vq.quad(f, [0] * d, [1] * d, n_points=n, adapt=adapt, rng=seed)
        low, high = r.confidence_interval()
        return float(r.integral), bool(low <= 1 <= high) or bool(r.warnings)

    return estimate


def covered(mean: float, error: float) -> tuple[float, bool]:
    return mean, abs(mean - 1) <= 1.96 * error


def by_vegas(f: Function, d: int, seed: int, n: int) -> tuple[float, bool]:
    integrator = vegas.Integrator([[0, 1]] * d, ran_array_generator=np.random.default_rng([seed, 1]).random)
    batch = vegas.batchintegrand(lambda x: f(x.T))
    integrator(batch, nitn=2, neval=n // 5)
    r = integrator(batch, nitn=3, neval=n // 5)
    return covered(float(r.mean), float(r.sdev))


def by_tuned_vegas(f: Function, d: int, seed: int, n: int) -> tuple[float, bool]:
    integrator = vegas.Integrator([[0, 1]] * d, alpha=0.8, ran_array_generator=np.random.default_rng([seed, 2]).random)
    batch = vegas.batchintegrand(lambda x: f(x.T))
    integrator(batch, nitn=5, neval=int(0.4 * n / 5))
    r = integrator(batch, nitn=1, neval=int(0.6 * n), adapt=False)
    return covered(float(r.mean), float(r.sdev))


METHODS: dict[str, Method] = {
    "vegas": by_vegas,
    "tuned": by_tuned_vegas,
    "adapt=False": by_quad(False),
    "adapt=True": by_quad(True),
    "adapt=auto": by_quad("auto"),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("methods", nargs="*", default=list(METHODS), help="to measure; all others keep their rows")
    chosen = parser.parse_args().methods
    warnings.simplefilter("ignore", vq.IntegrationWarning)
    kept: dict[tuple[str, str, str], list[str]] = {}
    if RESULT.exists():
        with RESULT.open() as file:
            kept = {(d, name, method): row for d, name, method, *row in list(csv.reader(file))[1:]}
    for d, name, family in CASES:
        for method in chosen:
            found = np.array([[METHODS[method](f, d, s, N) for s in range(REPETITIONS)] for f in members(family, d)])
            mse = np.exp(np.log(np.square(found[..., 0] - 1).mean(axis=1)).mean())
            kept[str(d), name, method] = [f"{mse:.1e}", f"{found[..., 1].mean():.2f}"]
        rows = [[*key, *kept[key]] for key in itertools.product([str(d)], [name], METHODS) if key in kept]
        print(*rows, sep="\n", flush=True)
    with RESULT.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["d", "integrand", "method", "mse", "covered"])
        for key in ((str(d), name, method) for d, name, _ in CASES for method in METHODS):
            if key in kept:
                writer.writerow([*key, *kept[key]])


if __name__ == "__main__":
    main()
