"""vq.quad and cubic stratification (Chopin and Gerber), each at all its orders: d = 2, at most 1024 evaluations.

Four functions: smooth, a narrow Gaussian, a kink and a half-plane jump. Mean squared errors with their standard errors
over independent sets go to benchmarks/results/cubic_stratification.csv; `best` marks the best order of a rule. Lines of
rules that are not measured stay.

    python benchmarks/cubic_stratification.py [--replicates 2000] [--only "vq.quad auto"]
"""

import argparse
import csv
import itertools
import warnings
from pathlib import Path

import numpy as np
from peer_rules import CUBIC_ORDERS, cubic_rule
from scipy.special import erf

import voroquad as vq
from voroquad.rules.method import highest_order
from voroquad.study.functions import INTEGRANDS, half_plane_moment
from voroquad.study.integrand import Array, KnownIntegrand

RESULTS = Path(__file__).parent / "results" / "cubic_stratification.csv"
EVALUATIONS = 1024
RATE, CENTRE = 10.0, np.array([0.4, 0.6])  # of the Gaussian: a standard deviation of 0.07, little over two strata


def narrow_gaussian() -> KnownIntegrand:
    sides = erf(RATE * (1 - CENTRE)) + erf(RATE * CENTRE)
    return KnownIntegrand(
        "gaussian",
        "Narrow Gaussian",
        "exp(−100 |x − c|²)",
        2,
        lambda x: np.exp(-((RATE * (x - CENTRE)) ** 2).sum(axis=-1)),
        float(np.prod(np.sqrt(np.pi) / (2 * RATE) * sides)),
    )


def half_plane() -> KnownIntegrand:
    return KnownIntegrand(
        "half-plane",
        "Half-plane",
        "1 where x + 0.6 y > 0.7, else 0",
        2,
        lambda x: np.where(x @ np.array([1, 0.6]) > 0.7, 1.0, 0.0),
        half_plane_moment(1, 0.6, 0.7, 0),
    )


FUNCTIONS = (INTEGRANDS["smooth-2d"], narrow_gaussian(), INTEGRANDS["kink-2d"], half_plane())


def by_quad(order: int | str, seed: int) -> tuple[Array, int]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", vq.IntegrationWarning)
        result = vq.quad(
            lambda x: np.stack([f(x) for f in FUNCTIONS]), [0, 0], [1, 1], n_points=EVALUATIONS, order=order, rng=seed
        )
    return result.integral, result.n_evaluations


def by_cubic(order: int, seed: int) -> tuple[Array, int]:
    return cubic_rule(order).estimate(FUNCTIONS, EVALUATIONS, np.random.default_rng(seed))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--replicates", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="a rule and its order")
    options = parser.parse_args()

    truth = np.array([f.integral for f in FUNCTIONS])
    rules = [("vq.quad", order, by_quad) for order in ("auto", "kriging", *range(1, highest_order(2) + 1))]
    rules += [("cubic stratification", order, by_cubic) for order in CUBIC_ORDERS]
    lines = {} if not options.only else measured()
    for rule, order, estimate in rules:
        if options.only not in ("", f"{rule} {order}"):
            continue
        results = [estimate(order, options.seed * options.replicates + k) for k in range(options.replicates)]
        squares = np.square([value - truth for value, _ in results])
        error = squares.std(axis=0, ddof=1) / np.sqrt(len(squares))
        for f, mean, spread in zip(FUNCTIONS, squares.mean(axis=0), error, strict=True):
            lines[f.name, rule, str(order)] = [str(results[0][1]), f"{mean:.3g}", f"{spread:.2g}"]
            print(rule, order, results[0][1], f.name, f"{mean:.3g} ± {spread:.1g}", flush=True)

    with RESULTS.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["rule", "order", "evaluations", "function", "mse", "mse_standard_error", "best"])
        for f, (rule, order, _) in itertools.product(FUNCTIONS, rules):
            used, mse, error = lines[f.name, rule, str(order)]
            least = min(float(line[1]) for key, line in lines.items() if key[:2] == (f.name, rule))
            table.writerow([rule, order, used, f.name, mse, error, "best" if float(mse) == least else ""])


def measured() -> dict[tuple[str, str, str], list[str]]:
    """The lines that are there, by function, rule and order."""
    with RESULTS.open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))[1:]
    return {(name, rule, order): [used, mse, error] for rule, order, used, name, mse, error, _ in rows}


if __name__ == "__main__":
    main()
