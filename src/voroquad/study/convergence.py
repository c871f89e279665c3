"""Mean squared error against N: which (design, weights) gets what from N evaluations."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..samplers import SampleSet, sample
from ..weights import weights
from .integrand import Integrand


@dataclass(frozen=True)
class Method:
    """A way to integrate: sampling design and weights. `debias` None means equal weights 1/N."""

    name: str
    design: str
    debias: str | None = None
    order: int = 0

    def weights(self, samples: SampleSet) -> NDArray[np.float64]:
        """Weights (sets, n) of a batch of sets."""
        if self.debias is None:
            return np.full(samples.points.shape[:-1], 1 / samples.n)
        return weights(samples, order=self.order, debias=self.debias)


METHODS_1D = (
    Method("uniform", "uniform"),
    Method("uniform + Voronoi Î_C", "uniform", "none"),
    Method("uniform + Î_GR", "uniform", "bias-function"),
    Method("uniform + exchange", "uniform", "exchange"),
    Method("stratified", "stratified"),
    Method("stratified + Voronoi Î_C", "stratified", "none"),
    Method("stratified + exchange", "stratified", "exchange"),
    Method("Sobol'", "sobol"),
    Method("Halton", "halton"),
)

METHODS_2D = (
    Method("uniform", "uniform"),
    Method("uniform + Voronoi Î_C", "uniform", "none"),
    Method("stratified", "stratified"),
    Method("stratified + Voronoi Î_C", "stratified", "none"),
    Method("Sobol'", "sobol"),
    Method("Halton", "halton"),
)


@dataclass(frozen=True)
class Measurement:
    """What one method made of one integrand with n samples, over independent replicates."""

    integrand: str
    method: Method
    n: int
    replicates: int
    mse: float
    mse_error: float  # standard error of mse
    bias: float  # mean error
    bias_error: float  # its standard error


@dataclass(frozen=True)
class Slope:
    """Least-squares line through (log n, log MSE), n_from ≤ n ≤ n_to."""

    value: float
    error: float
    n_from: int
    n_to: int


def powers_of_two(max_n: int) -> list[int]:
    """The sizes 8, 16, … up to `max_n`: Sobol' sets are balanced at powers of two only."""
    if max_n < 32:
        raise ValueError(f"max_n must be at least 32 (a slope needs three sizes from 8 up), got {max_n}")
    return [2**k for k in range(3, max_n.bit_length())]


def replicates_at(n: int, replicates: int) -> int:
    """Replicates at size n: `replicates` above n = 512, twice as many up to there, where they are cheap."""
    return 2 * replicates if n <= 512 else replicates


def measure(
    methods: Sequence[Method],
    integrands: Sequence[Integrand],
    sizes: Sequence[int],
    *,
    replicates: int,
    seed: int,
    advance: Callable[[str, int], None] = lambda description, steps: None,
) -> list[Measurement]:
    """MSE of every method on every integrand at every size.

    Methods of one design see the same sample sets, and so do all integrands: differences between
    them are then far better known than their values.

    Parameters
    ----------
    methods, integrands
        All of one dimension.
    sizes : sequence of int
        Numbers of samples n.
    replicates : int
        Independent sets at the largest sizes; :func:`replicates_at` gives those at the others.
    seed : int
        A measurement depends on the seed, the design, d and n only.
    advance : callable, optional
        Called with a description and 1 after each design and size.
    """
    (d,) = {f.d for f in integrands}
    measurements = []
    for n in sizes:
        for number, design in enumerate(dict.fromkeys(m.design for m in methods)):
            of_design = [m for m in methods if m.design == design]
            rng = np.random.default_rng([seed, d, n, number])
            count = replicates_at(n, replicates)
            errors = _errors(of_design, integrands, n, count, rng)
            for method, row in zip(of_design, errors, strict=True):
                for f, e in zip(integrands, row, strict=True):
                    measurements.append(measurement(f, method, n, e))
            advance(f"{d}-D, {design}, N = {n}", 1)
    return measurements


def fit_slope(measurements: Sequence[Measurement], n_from: int = 64) -> Slope:
    """Slope of log MSE against log n by least squares over n ≥ n_from, or over the last three sizes.

    Its standard error follows from those of the MSEs, independent between sizes.
    """
    ordered = sorted(measurements, key=lambda m: m.n)
    fitted = [m for m in ordered if m.n >= n_from]
    if len(fitted) < 3:
        fitted = ordered[-3:]
    x = np.log([m.n for m in fitted])
    c = (x - x.mean()) / ((x - x.mean()) ** 2).sum()  # slope = Σ c_k log MSE_k
    mse = np.array([m.mse for m in fitted])
    relative = np.array([m.mse_error for m in fitted]) / mse
    return Slope(float(c @ np.log(mse)), float(np.sqrt(c**2 @ relative**2)), fitted[0].n, fitted[-1].n)


_BATCH_POINTS = 2**20  # keeps a batch of sets within 50 MB


def _errors(
    methods: Sequence[Method], integrands: Sequence[Integrand], n: int, count: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Errors (methods, integrands, count) of the estimates of `count` independent sets."""
    batches = []
    for sets in _batches(count, max(1, _BATCH_POINTS // n)):
        samples = sample(methods[0].design, n, integrands[0].d, sets=sets, rng=rng)
        values = np.stack([f.values(samples.points) for f in integrands])
        estimates = [np.einsum("sn,fsn->fs", m.weights(samples), values) for m in methods]
        batches.append(np.stack(estimates))
    exact = np.array([f.integral for f in integrands])
    return np.concatenate(batches, axis=-1) - exact[:, None]


def _batches(count: int, largest: int) -> Iterator[int]:
    while count > 0:
        yield min(count, largest)
        count -= largest


def measurement(f: Integrand, method: Method, n: int, errors: NDArray[np.float64]) -> Measurement:
    """Mean squared error and bias from the errors (replicates,) of one method."""
    squares, root = errors**2, math.sqrt(len(errors))
    return Measurement(
        f.name,
        method,
        n,
        len(errors),
        float(squares.mean()),
        float(squares.std(ddof=1)) / root,
        float(errors.mean()),
        float(errors.std(ddof=1)) / root,
    )
