"""Errors of rules over many independent sets, a little at a time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence

import numpy as np

from .._support.arrays import Array
from ..designs.sampling import sample
from ..study.convergence import Measurement, Scheme, measurement, powers_of_two
from ..study.integrand import KnownIntegrand
from ..study.moments import Moments

#: Evaluations of a batch. It takes milliseconds for most rules, a third of a second for order 8.
_BATCH = 4096
#: Number of sets, or of evaluations, at which a histogram or an MSE ends.
MOST_SETS = 20_000
MOST_EVALUATIONS = 2**21
#: Batches of a histogram for each batch of a size of MSE against N.
_HISTOGRAMS_FIRST = 8
#: The largest N of the plot of MSE against N.
LARGEST_N = 1024


class Replicates:
    """Errors of one method on one integrand, from batches of independent sets.

    Batch k is drawn with the seed [seed, n, k]: the number of batches determines all numbers.
    """

    def __init__(self, method: Scheme, integrand: KnownIntegrand, n: int, seed: int):
        self.method = method
        self.integrand = integrand
        self.n = n
        self.seed = seed
        self.sets_per_batch = max(1, _BATCH // n)
        self.batches: list[Array] = []

    @property
    def errors(self) -> Array:
        """Error (sets,) of each estimate so far."""
        return np.concatenate(self.batches) if self.batches else np.empty(0)

    @property
    def complete(self) -> bool:
        """Whether the largest number of sets is reached."""
        sets = len(self.batches) * self.sets_per_batch
        return sets >= MOST_SETS or sets * self.n >= MOST_EVALUATIONS

    def add_batch(self) -> None:
        """Draw and integrate one more batch."""
        rng = np.random.default_rng([self.seed, self.n, len(self.batches)])
        samples = sample(self.method.design, self.n, self.integrand.d, sets=self.sets_per_batch, rng=rng)
        estimates = (self.method.weights(samples) * self.integrand.values(samples.points)).sum(axis=-1)
        self.batches.append(estimates - self.integrand.integral)

    def measured(self) -> Measurement | None:
        """Mean squared error and bias so far; None before the second set."""
        errors = self.errors
        return measurement(self.integrand, self.method, self.n, Moments.of(errors), ()) if len(errors) > 1 else None


class Experiment:
    """Two methods (or more) side by side: a histogram of errors each at one N, and MSE against N.

    Parameters
    ----------
    methods : sequence of Scheme
    integrand : KnownIntegrand
    n : int
        Samples of a set behind the histograms.
    seed : int

    Attributes
    ----------
    still : threading.Lock
        While it is held the numbers do not change, whichever thread runs the experiment.
    """

    def __init__(self, methods: Sequence[Scheme], integrand: KnownIntegrand, n: int, seed: int):
        self.still = threading.Lock()
        self.histograms = [Replicates(m, integrand, n, seed) for m in methods]
        sizes = powers_of_two(LARGEST_N)
        self.convergence = [[Replicates(m, integrand, size, seed) for size in sizes] for m in methods]

    @property
    def complete(self) -> bool:
        """Whether nothing is left to do."""
        return all(r.complete for r in self._everything())

    def run(self, seconds: float, clock: Callable[[], float] = time.perf_counter) -> None:
        """Add batches in turn, to those with the fewest, until the time is up; at least one."""
        end = clock() + seconds
        while waiting := [r for r in self._everything() if not r.complete]:
            with self.still:
                min(waiting, key=self._turns_had).add_batch()
            if clock() >= end:
                return

    def _everything(self) -> list[Replicates]:
        return [*self.histograms, *(r for row in self.convergence for r in row)]

    def _turns_had(self, replicates: Replicates) -> float:
        return len(replicates.batches) / (_HISTOGRAMS_FIRST if replicates in self.histograms else 1)
