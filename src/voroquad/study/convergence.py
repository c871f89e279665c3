"""Mean squared error against N for pairs of a design and weights."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from .._support.arrays import Array
from .._support.units import ONE_PROCESS, Advance, Pool, Series
from ..designs.sampling import SampleSet, sample
from ..results.power_law import fit_power_law
from ..rules.registry import weights
from .integrand import KnownIntegrand
from .moments import Moments, add_packed


@dataclass(frozen=True)
class Scheme:
    """A way to integrate: sampling design and weights. `debias` None means equal weights 1/N."""

    name: str
    design: str
    debias: str | None = None
    order: int = 0

    def weights(self, samples: SampleSet) -> Array:
        """Weights (sets, n) of a batch of sets."""
        if self.debias is None:
            return np.full(samples.points.shape[:-1], 1 / samples.n)
        return weights(samples, order=self.order, debias=self.debias)


METHODS_1D = (
    Scheme("uniform", "uniform"),
    Scheme("uniform + Voronoi Î_C", "uniform", "none"),
    Scheme("uniform + Î_GR", "uniform", "bias-function"),
    Scheme("uniform + exchange", "uniform", "exchange"),
    Scheme("stratified", "stratified"),
    Scheme("stratified + Voronoi Î_C", "stratified", "none"),
    Scheme("stratified + exchange", "stratified", "exchange"),
    Scheme("Sobol'", "sobol"),
    Scheme("Halton", "halton"),
)

METHODS_2D = (
    Scheme("uniform", "uniform"),
    Scheme("uniform + Voronoi Î_C", "uniform", "none"),
    Scheme("stratified", "stratified"),
    Scheme("stratified + Voronoi Î_C", "stratified", "none"),
    Scheme("Sobol'", "sobol"),
    Scheme("Halton", "halton"),
)


@dataclass(frozen=True)
class Measurement:
    """The errors of one method on one integrand with n samples, over independent replicates."""

    integrand: str
    method: Scheme
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
    """Replicates at size n: `replicates` above n = 512, and twice as many below, where they are cheap."""
    return 2 * replicates if n <= 512 else replicates


def measure(
    methods: Sequence[Scheme],
    integrands: Sequence[KnownIntegrand],
    sizes: Sequence[int],
    *,
    replicates: int,
    seed: int,
    pool: Pool = ONE_PROCESS,
    advance: Advance = lambda description, steps: None,
) -> list[Measurement]:
    """MSE of every method on every integrand at every size.

    Methods of one design use the same sample sets, and so do all integrands. Differences between them are therefore
    known far better than their values.

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
    pool : Pool
        What computes the units of work: blocks of replicates of each design and size.
    advance : callable, optional
        Called with the design and size and 1 after each unit.
    """
    (d,) = {f.d for f in integrands}
    designs = list(dict.fromkeys(m.design for m in methods))
    cases = [(n, number, design) for n in sizes for number, design in enumerate(designs)]
    of_design = {design: tuple(m for m in methods if m.design == design) for design in designs}
    series = [
        _series(of_design[design], tuple(integrands), n, replicates_at(n, replicates), (seed, d, n, number))
        for n, number, design in cases
    ]
    measurements = []
    for (n, _, design), total in zip(cases, pool.sums(series, add_packed, advance), strict=True):
        moments = Moments.unpacked(total)
        for i, method in enumerate(of_design[design]):
            measurements += [measurement(f, method, n, moments, (i, j)) for j, f in enumerate(integrands)]
    return measurements


def fit_slope(measurements: Sequence[Measurement], n_from: int = 64) -> Slope:
    """Slope of log MSE against log n by least squares over n ≥ n_from, or over the last three sizes.

    Its standard error follows from those of the MSEs, independent between sizes.
    """
    ordered = sorted(measurements, key=lambda m: m.n)
    fitted = [m for m in ordered if m.n >= n_from]
    if len(fitted) < 3:
        fitted = ordered[-3:]
    law = fit_power_law([m.n for m in fitted], [m.mse for m in fitted], [m.mse_error for m in fitted])
    if law is None:
        raise ValueError(f"a slope needs measurements over a range of n, got n = {[m.n for m in fitted]}")
    return Slope(law.slope, law.slope_error, fitted[0].n, fitted[-1].n)


#: Samples of a unit of work: this takes seconds, or tenths of a second for the smallest sets
UNIT_POINTS, UNIT_SETS = 2**22, 2**17
_BATCH_POINTS = 2**20  # keeps a batch of sets within 50 MB


def units(n: int, replicates: int) -> int:
    """Number of units of work for `replicates` sets of n samples."""
    return -(-replicates // _sets_of_a_unit(n))


def _sets_of_a_unit(n: int) -> int:
    return max(1, min(UNIT_SETS, UNIT_POINTS // n))


def _series(
    methods: Sequence[Scheme], integrands: Sequence[KnownIntegrand], n: int, count: int, key: tuple[int, ...]
) -> Series:
    """The experiment of one design and size, in blocks of its `count` replicates."""
    name = f"{integrands[0].d}d-{methods[0].design}-{n}"
    shape = (3, 2, len(methods), len(integrands))
    return Series(name, units(n, count), shape, _block, (methods, integrands, n, count, key))


def _block(
    methods: Sequence[Scheme], integrands: Sequence[KnownIntegrand], n: int, count: int, key: tuple[int, ...], k: int
) -> Array:
    """Moments of the errors in block k, by methods and integrands."""
    rng = np.random.default_rng([*key, k] if k > 0 else key)
    largest = _sets_of_a_unit(n)
    batches = _batches(min(largest, count - k * largest), max(1, _BATCH_POINTS // n))
    errors = [_errors(methods, integrands, n, sets, rng) for sets in batches]
    return Moments.of(np.concatenate(errors, axis=-1)).packed()


def _errors(
    methods: Sequence[Scheme], integrands: Sequence[KnownIntegrand], n: int, sets: int, rng: np.random.Generator
) -> Array:
    """Errors (methods, integrands, sets) of the estimates of independent sets."""
    samples = sample(methods[0].design, n, integrands[0].d, sets=sets, rng=rng)
    values = np.stack([f.values(samples.points) for f in integrands])
    estimates = np.stack([np.einsum("sn,fsn->fs", m.weights(samples), values) for m in methods])
    exact = np.array([f.integral for f in integrands])
    return estimates - exact[:, None]


def _batches(count: int, largest: int) -> Iterator[int]:
    while count > 0:
        yield min(count, largest)
        count -= largest


def measurement(f: KnownIntegrand, method: Scheme, n: int, moments: Moments, index: tuple[int, ...]) -> Measurement:
    """Mean squared error and bias from the entry `index` of moments."""
    bias, mse = (float(mean[index]) for mean in moments.mean)
    bias_error, mse_error = (float(error[index]) for error in moments.standard_error)
    return Measurement(f.name, method, n, moments.count, mse, mse_error, bias, bias_error)
