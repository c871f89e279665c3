"""vq.quad against its peers at equal numbers of evaluations.

Six Genz families and two with slanted edges × d = 1, 2, 3, 4, 6 × 128, 512, 2048 evaluations, several
random members of each family and many repetitions of each rule. A line of
benchmarks/results/quad_peers.csv has, for a family, the geometric mean over its members of
MSE(peer) / MSE(vq.quad) with its standard error in the logarithm over the members, and for "all" the
geometric mean over the families; and the wall time of one call. `evaluations` is what a rule really used.

    python benchmarks/quad_peers.py [--peers qmc_quad,…] [--dimensions 1,2] [--repetitions 50]
"""

import argparse
import csv
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import scipy.integrate
from peer_rules import PEERS

import voroquad as vq
from voroquad.study.genz import FAMILIES, Integrand, instances

RESULTS = Path(__file__).parent / "results" / "quad_peers.csv"
Rule = Callable[[Integrand, int, int], tuple[float, int]]  # integrand, evaluations, seed -> estimate, evaluations


def voroquad_errors(functions: list[Integrand], n: int, repetitions: int) -> tuple[np.ndarray, int]:
    """Errors (functions, repetitions) of vq.quad, all functions at once as a vector-valued integrand."""
    d, truth = functions[0].d, np.array([f.integral for f in functions])
    results = [
        vq.quad(lambda x: np.stack([f(x) for f in functions]), np.zeros(d), np.ones(d), n_points=n, rng=seed)
        for seed in range(repetitions)
    ]
    return np.array([r.integral - truth for r in results]).T, results[0].n_evaluations


def voroquad_alone(f: Integrand, n: int, seed: int) -> tuple[float, int]:
    """vq.quad on one function, for its wall time."""
    result = vq.quad(f, np.zeros(f.d), np.ones(f.d), n_points=n, rng=seed)
    return result.integral, result.n_evaluations


def peer_errors(rule: Rule, functions: list[Integrand], n: int, repetitions: int) -> tuple[np.ndarray, int]:
    """Errors (functions, repetitions) of a peer and the evaluations it used."""
    results = [[rule(f, n, seed) for seed in range(repetitions)] for f in functions]
    errors = np.array([[value for value, _ in row] for row in results])
    return errors - [[f.integral] for f in functions], results[0][0][1]


def milliseconds(rule: Rule, f: Integrand, n: int) -> str:
    """Of one call: the least of five."""
    times = []
    for seed in range(5):
        start = time.perf_counter()
        rule(f, n, seed)
        times.append(time.perf_counter() - start)
    return f"{1e3 * min(times):.3f}"


def mean_squares(errors: np.ndarray, functions: list[Integrand]) -> np.ndarray:
    """Mean squared errors (functions,), not below rounding, where all rules are equal."""
    return np.maximum(np.square(errors).mean(axis=1), [(2.0**-52 * f.integral) ** 2 for f in functions])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--peers", default=",".join(PEERS))
    parser.add_argument("--dimensions", default="1,2,3,4,6")
    parser.add_argument("--evaluations", default="128,512,2048")
    parser.add_argument("--repetitions", type=int, default=50)
    parser.add_argument("--instances", type=int, default=5)
    parser.add_argument("-o", "--output", type=Path, default=RESULTS)
    options = parser.parse_args()
    warnings.filterwarnings("ignore", category=vq.IntegrationWarning)
    warnings.filterwarnings("ignore", category=scipy.integrate.IntegrationWarning)

    header = ["d", "n", "peer", "family", "mse_ratio", "log_error", "evaluations", "peer_evaluations"]
    rows = []
    for d in map(int, options.dimensions.split(",")):
        functions = list(instances(d, options.instances, rng=d))
        for n in map(int, options.evaluations.split(",")):
            errors, used = voroquad_errors(functions, n, options.repetitions)
            ours, our_time = mean_squares(errors, functions), milliseconds(voroquad_alone, functions[0], n)
            for name in options.peers.split(","):
                rule = PEERS[name](d, n)
                if rule is None:
                    continue
                errors, peer_used = peer_errors(rule, functions, n, options.repetitions)
                logs = np.log(mean_squares(errors, functions) / ours).reshape(len(FAMILIES), -1)
                spread = logs.std(axis=1, ddof=1) / np.sqrt(logs.shape[1])
                times = [our_time, milliseconds(rule, functions[0], n)]
                for family, log, error in zip(FAMILIES, logs.mean(axis=1), spread, strict=True):
                    rows.append([d, n, name, family, f"{np.exp(log):.3g}", f"{error:.2f}", used, peer_used, *times])
                overall = np.sqrt(np.square(spread).sum()) / len(spread)
                rows.append(
                    [d, n, name, "all", f"{np.exp(logs.mean()):.3g}", f"{overall:.2f}", used, peer_used, *times]
                )
                print(d, n, f"{name:22}", " ".join(r[4] for r in rows[-9:-1]), "|", rows[-1][4], *times, flush=True)
    options.output.parent.mkdir(exist_ok=True)
    with options.output.open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow([*header, "milliseconds", "peer_milliseconds"])
        table.writerows(rows)


if __name__ == "__main__":
    main()
