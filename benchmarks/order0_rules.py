"""Order-0 rules on single sets in the plane: squared errors, side by side on the same samples.

    python benchmarks/order0_rules.py

writes benchmarks/results/order0_rules.csv. Control neighbours (Leluc, Portier, Segers and Zhuman,
Bernoulli 2025) is a comparator, written in peer_rules.py from its formula.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from peer_rules import control_neighbours
from scipy.integrate import dblquad

import voroquad as vq
from voroquad.study.drawing import write_rows

Floats = NDArray[np.float64]
RESULTS = Path(__file__).parent / "results" / "order0_rules.csv"


def smooth(x: Floats, y: Floats) -> Floats:
    return np.exp(x + y / 2) * (1 + np.sin(5 * x * y))


def half_plane(x: Floats, y: Floats) -> Floats:
    return x + 2.0 * (x + 0.5 * y < 0.7)


#: name: (f, its integral); the half-plane holds 0.7 − 0.5/2 = 0.45 of the square
FUNCTIONS: dict[str, tuple[Callable[[Floats, Floats], Floats], float]] = {
    "exp(x + y/2) (1 + sin 5xy)": (smooth, dblquad(lambda y, x: smooth(x, y), 0, 1, 0, 1, epsabs=1e-12)[0]),
    "half-plane jump": (half_plane, 0.5 + 2 * 0.45),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=1000, help="replicates of each set")
    parser.add_argument("--n", default="64,256,1024", help="numbers of samples (squares)")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()

    rows = []
    for n in map(int, args.n.split(",")):
        for design in ("uniform", "stratified"):
            s = vq.sample(design, n=n, d=2, sets=args.sets, rng=args.seed)
            rules = {
                "plain": np.full(s.points.shape[:2], 1 / n),
                "consistent (Voronoi)": vq.weights(s),
                "bias function": vq.weights(s, debias="bias-function"),
                "boundary control": vq.weights(s, debias="leave-one-out"),
            }
            if design == "uniform":
                rules["control neighbours"] = np.stack([control_neighbours(points) for points in s.points])
            for name, (f, integral) in FUNCTIONS.items():
                values = f(s.points[..., 0], s.points[..., 1])
                for rule, w in rules.items():
                    error = (w * values).sum(axis=1) - integral
                    squares = error**2
                    rows.append(
                        {
                            "f": name,
                            "design": design,
                            "n": n,
                            "rule": rule,
                            "mse": f"{squares.mean():.4g}",
                            "mse_standard_error": f"{squares.std(ddof=1) / np.sqrt(args.sets):.2g}",
                            "bias_z": f"{error.mean() / error.std(ddof=1) * np.sqrt(args.sets):.2f}",
                        }
                    )
                    print(*rows[-1].values(), sep="  ", flush=True)
    write_rows(RESULTS, rows)


if __name__ == "__main__":
    main()
