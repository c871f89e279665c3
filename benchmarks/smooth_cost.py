"""What the first look of `adapt="auto"` costs smooth integrands, and how often it calls for adaptation.

    VOROQUAD_NUM_THREADS=1 python benchmarks/smooth_cost.py

Writes benchmarks/results/smooth_cost.csv. On Genz's families, `squared_error` is the mean squared error with a first
look that calls for nothing over that without: the geometric mean over 4 members, of 32 estimates each, all families in
one call. `calls` is the part of 200 other members for which a first look calls for adaptation, or in up to three
dimensions for the pilot rule. The two families with kinks and edges along the axes have only `calls`.
"""

from __future__ import annotations

import csv
import functools
import math
import warnings
from collections.abc import Callable
from pathlib import Path
from unittest import mock

import numpy as np

import voroquad as vq
from voroquad.integrals import adaptive_grid
from voroquad.integrals.adaptation import Learner, look_size
from voroquad.integrals.adaptive_grid import coarse_side, rough
from voroquad.integrals.evaluation import Function
from voroquad.integrals.integrand import Integrand
from voroquad.integrals.pilot import PilotRun
from voroquad.integrals.places import parts_of
from voroquad.integrals.regions import Region
from voroquad.study.genz import FAMILIES

RESULT = Path(__file__).parent / "results" / "smooth_cost.csv"
SMOOTH = ("oscillatory", "peak", "corner", "gaussian")
SIZES = {2: (3000, 8000), 3: (3000, 5000, 8000), 4: (1024, 2048, 8000), 6: (2048, 4096, 8000)}
MEMBERS, REPETITIONS, LOOKS = 4, 32, 200


def on_box(f: Callable[[np.ndarray], np.ndarray], d: int) -> tuple[Callable[..., Integrand], Region]:
    """What makes the integrand of a region, and the unit box."""
    (part,), library = parts_of([0] * d, [1] * d, None, 0, 1)
    function = Function(f, library)
    return functools.partial(Integrand, function), part.region


def calls(f: Callable[[np.ndarray], np.ndarray], d: int, n: int, seed: int) -> bool:
    """Whether the first look at an integrand calls for adaptation, or in up to three dimensions for the pilot rule."""
    learner = Learner(*on_box(f, d), False, np.random.default_rng(seed))
    if d > 3:
        u, values, _ = learner.even(look_size(n, d))
        return learner.adapts(u, values)
    coarse = PilotRun(learner.integrand(learner.region), coarse_side(n, d), learner.rng, 1)
    coarse.evaluate_grid()
    return rough(coarse)


def never(*_: object) -> bool:
    return False


def ratio(d: int, n: int) -> np.ndarray:
    """Squared errors with a look that calls for nothing over those without, (families, members)."""
    rng = np.random.default_rng([18, d])
    members = [FAMILIES[name](d, rng) for name in SMOOTH for _ in range(MEMBERS)]
    exact = np.array([m.integral for m in members])

    def squares(adapt: bool | str) -> np.ndarray:
        found = [
            vq.quad(lambda x: np.stack([m(x) for m in members]), [0] * d, [1] * d, n_points=n, adapt=adapt, rng=seed)
            for seed in range(REPETITIONS)
        ]
        return np.mean([np.square(r.integral - exact) for r in found], axis=0)

    with mock.patch.object(Learner, "adapts", never), mock.patch.object(adaptive_grid, "rough", never):
        looked_at = squares("auto")
    return (looked_at / squares(False)).reshape(len(SMOOTH), MEMBERS)


def main() -> None:
    warnings.simplefilter("ignore", vq.IntegrationWarning)
    with RESULT.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["d", "n", "family", "squared_error", "calls"])
        for d, sizes in SIZES.items():
            for n in sizes:
                costs = dict(zip(SMOOTH, np.exp(np.log(ratio(d, n)).mean(axis=1)), strict=True))
                costs["all smooth"] = math.exp(np.mean(np.log(list(costs.values()))))
                shares = {}
                for name in (*SMOOTH, "kink", "jump"):
                    rng = np.random.default_rng([19, d])
                    shares[name] = np.mean([calls(FAMILIES[name](d, rng), d, n, seed) for seed in range(LOOKS)])
                shares["all smooth"] = np.mean([shares[name] for name in SMOOTH])
                for name, share in shares.items():
                    cost = f"{costs[name]:.2f}" if name in costs else ""
                    writer.writerow([d, n, name, cost, f"{share:.3f}"])
                file.flush()


if __name__ == "__main__":
    main()
