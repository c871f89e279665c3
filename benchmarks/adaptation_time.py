"""Peaks: `quad` beside vegas at equal processor time, where func costs 10 µs per point.

    VOROQUAD_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/adaptation_time.py  # about four minutes

The families, their members and the two settings of vegas are those of benchmarks/adaptation.py. `quad` gets 8000
evaluations and its defaults. vegas gets, for each member, as many evaluations as take it the same processor time: the
times of two calls with 8000 tell how many. Calls of all three with one seed follow each other.

Writes benchmarks/results/adaptation_time.csv: by family and setting of vegas the evaluations of vegas, the milliseconds
of a call of `quad` and of vegas (means), and the mean squared errors (geometric means over members). The table of
docs/measured/integrals.md is made from it.
"""

from __future__ import annotations

import argparse
import csv
import time
import warnings
from pathlib import Path

import numpy as np
from adaptation import CASES, MEMBERS, METHODS, REPETITIONS, Function, N, members

import voroquad as vq

RESULT = Path(__file__).parent / "results" / "adaptation_time.csv"
#: `quad`, and its peers
RACE = ("adapt=auto", "vegas", "tuned")
COLUMNS = ("d", "integrand", "peer", "evaluations", "milliseconds", "milliseconds_peer", "mse", "mse_peer")


def costly(f: Function, seconds: float) -> Function:
    """The same function, which takes so many seconds of processor time per point."""

    def values(x: np.ndarray) -> np.ndarray:
        end = time.process_time() + seconds * x.shape[1]
        found = f(x)
        while time.process_time() < end:
            pass
        return found

    return values


def timed(method: str, f: Function, d: int, seed: int, n: int) -> tuple[float, float]:
    """Processor time in seconds, and the squared error."""
    begin = time.process_time()
    mean, _ = METHODS[method](f, d, seed, n)
    return time.process_time() - begin, (mean - 1) ** 2


def sizes(f: Function, d: int) -> np.ndarray:
    """Evaluations of each method on one integrand that take as much processor time as N of `quad`."""
    times = np.array([min(timed(method, f, d, seed, N)[0] for seed in (0, 1)) for method in RACE])
    return np.rint(N * times[0] / times).astype(int)


def race(f: Function, d: int, evaluations: np.ndarray, repetitions: int) -> np.ndarray:
    """Mean times and mean squared errors (methods, 2)."""
    runs = [
        [timed(method, f, d, seed, int(n)) for method, n in zip(RACE, evaluations, strict=True)]
        for seed in range(repetitions)
    ]
    return np.mean(runs, axis=0)


def rows(functions: list[Function], d: int, repetitions: int) -> list[list[str]]:
    """What the CSV has of a family after its name, by peer."""
    evaluations = np.array([sizes(f, d) for f in functions])
    found = np.array([race(f, d, n, repetitions) for f, n in zip(functions, evaluations, strict=True)])
    n, times = evaluations.mean(axis=0), 1e3 * found[..., 0].mean(axis=0)
    mse = np.exp(np.log(found[..., 1]).mean(axis=0))
    return [
        [RACE[k], f"{n[k]:.0f}", f"{times[0]:.1f}", f"{times[k]:.1f}", f"{mse[0]:.2g}", f"{mse[k]:.2g}"]
        for k in range(1, len(RACE))
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--microseconds", type=float, default=10.0, help="of a point")
    parser.add_argument("--members", type=int, default=MEMBERS)
    parser.add_argument("--repetitions", type=int, default=REPETITIONS)
    parser.add_argument("--integrands", default="|".join(dict.fromkeys(name for _, name, _ in CASES)))
    parser.add_argument("--output", type=Path, default=RESULT)
    options = parser.parse_args()
    warnings.simplefilter("ignore", vq.IntegrationWarning)
    with options.output.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for d, name, family in CASES:
            if name not in options.integrands.split("|"):
                continue
            drawn = list(members(family, d))[: options.members]
            functions = [costly(f, 1e-6 * options.microseconds) for f in drawn]
            lines = [[d, name, *row] for row in rows(functions, d, options.repetitions)]
            print(*lines, sep="\n", flush=True)
            writer.writerows(lines)


if __name__ == "__main__":
    main()
