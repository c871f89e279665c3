"""Rules that integrate with a given number of evaluations: vq.quad and those of other libraries."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.integrate
from scipy.stats import qmc

from .._support.arrays import Array
from ..integrals.diagnostics import IntegrationWarning
from ..integrals.quad import quad
from .integrand import KnownIntegrand

#: Number of randomised sets whose mean a rule takes, as qmc_quad does by default.
REPLICATES = 8

#: Estimates (functions,), and the evaluations of each function that they took.
Estimates = tuple[Array, int]
Estimate = Callable[[Sequence[KnownIntegrand], int, np.random.Generator], Estimates]


@dataclass(frozen=True)
class Integrator:
    """A way to integrate functions over the unit box.

    Parameters
    ----------
    name : str
        In tables and figures.
    estimate : callable
        ``estimate(functions, n, rng)`` integrates functions of one dimension, each with at most n
        evaluations.
    exists : callable
        ``exists(d, n)``: whether there is such a rule in d dimensions with n evaluations.
    random : bool
        Whether another generator gives another estimate.
    module : str
        The package it needs.
    """

    name: str
    estimate: Estimate
    exists: Callable[[int, int], bool] = lambda d, n: True
    random: bool = True
    module: str = "numpy"


def one_by_one(rule: Callable[[KnownIntegrand, int, np.random.Generator], tuple[float, int]]) -> Estimate:
    """The rule for several functions, made of one for a single function."""

    def estimate(functions: Sequence[KnownIntegrand], n: int, rng: np.random.Generator) -> Estimates:
        values, used = zip(*(rule(f, n, rng) for f in functions), strict=True)
        return np.array(values), max(used)

    return estimate


def mean_over(points: Callable[[int, int, np.random.Generator], Array]) -> Estimate:
    """The plain mean over points (m, d), m ≤ n, that points(d, n, rng) makes."""

    def estimate(functions: Sequence[KnownIntegrand], n: int, rng: np.random.Generator) -> Estimates:
        x = points(functions[0].d, n, rng)
        return np.array([f.values(x).mean() for f in functions]), len(x)

    return estimate


def voroquad(functions: Sequence[KnownIntegrand], n: int, rng: np.random.Generator) -> Estimates:
    """vq.quad with its defaults; the functions are the components of one integrand."""
    d = functions[0].d
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IntegrationWarning)  # edges of the integrands are intended
        result = quad(lambda x: np.stack([f(x) for f in functions]), np.zeros(d), np.ones(d), n_points=n, rng=rng)
    return result.integral, result.n_evaluations


# ---------------------------------------------------------------------- SciPy


def qmc_quad(
    f: KnownIntegrand, n: int, rng: np.random.Generator, engine: Callable[..., qmc.QMCEngine]
) -> tuple[float, int]:
    """scipy.integrate.qmc_quad: the mean over eight randomised sets."""
    m = n // REPLICATES
    result = scipy.integrate.qmc_quad(
        f, np.zeros(f.d), np.ones(f.d), n_estimates=REPLICATES, n_points=m, qrng=engine(f.d, rng=rng)
    )
    return float(result.integral), REPLICATES * m


def cubature(f: KnownIntegrand, n: int, rng: np.random.Generator) -> tuple[float, int]:
    """scipy.integrate.cubature, which halves the worst box along each axis, as often as n evaluations allow."""
    calls = 0

    def counted(x: Array) -> Array:
        nonlocal calls
        calls += len(x)
        return f.values(x)

    value, used = np.nan, 0
    for subdivisions in itertools.count():
        calls = 0
        result = scipy.integrate.cubature(
            counted,
            np.zeros(f.d),
            np.ones(f.d),
            rule="gk21" if f.d == 1 else "genz-malik",
            rtol=0,
            atol=np.inf if subdivisions == 0 else 0,  # without a tolerance it subdivides once at least
            max_subdivisions=subdivisions,
        )
        if calls > n:
            break
        value, used = float(result.estimate), calls
        if result.status == "converged" and subdivisions > 0:
            break
    return value, used


def cubature_exists(d: int, n: int) -> bool:
    """Whether n evaluations are enough for the whole box.

    SciPy evaluates the rule, and for its error the rule once more and the one that is embedded in it.
    """
    rule, embedded = (21, 10) if d == 1 else (2**d + 2 * d * d + 2 * d + 1, 2 * d * d + 2 * d + 1)
    return n >= 2 * rule + embedded


# ---------------------------------------------------------------------- vegas and QMCPy


def vegas(f: KnownIntegrand, n: int, rng: np.random.Generator) -> tuple[float, int]:
    """vegas, importance sampling and adaptive stratification: two iterations to adapt, three that count."""
    import vegas as package

    calls = 0

    @package.lbatchintegrand  # type: ignore[untyped-decorator]
    def counted(x: Array) -> Array:
        nonlocal calls
        calls += len(x)
        return f.values(np.asarray(x))

    integrator = package.Integrator([[0.0, 1.0]] * f.d, ran_array_generator=rng.random)
    integrator(counted, nitn=2, neval=n // 5)
    result = integrator(counted, nitn=3, neval=n // 5)
    return float(result.mean), calls


def lattices(d: int, n: int, rng: np.random.Generator) -> Array:
    """QMCPy: randomly shifted lattices, folded by the baker's transform, which makes f periodic."""
    import qmcpy

    lattice = qmcpy.Lattice(d, replications=REPLICATES, seed=int(rng.integers(2**31)))
    folded: Array = 1 - np.abs(2 * lattice(_power_of_two(n // REPLICATES)) - 1)
    return folded.reshape(-1, d)


def interlaced_nets(d: int, n: int, rng: np.random.Generator) -> Array:
    """QMCPy: scrambled Sobol' nets, interlaced to order 2."""
    import qmcpy

    net = qmcpy.DigitalNetB2(d, replications=REPLICATES, seed=int(rng.integers(2**31)), alpha=2)
    points: Array = net(_power_of_two(n // REPLICATES))
    return points.reshape(-1, d)


def _power_of_two(n: int) -> int:
    """The largest that is at most n."""
    return 1 << (n.bit_length() - 1)


def _replicates_exist(d: int, n: int) -> bool:
    return n >= 2 * REPLICATES


OURS = Integrator("vq.quad", voroquad)

#: Rules that vq.quad is compared with. The extra `bench` installs their packages.
PEERS = (
    Integrator("qmc_quad", one_by_one(partial(qmc_quad, engine=qmc.Sobol)), _replicates_exist),
    Integrator("qmc_quad-halton", one_by_one(partial(qmc_quad, engine=qmc.Halton)), _replicates_exist),
    Integrator("cubature", one_by_one(cubature), cubature_exists, random=False),
    Integrator("vegas", one_by_one(vegas), lambda d, n: n >= 50, module="vegas"),
    Integrator("qmcpy-lattice", mean_over(lattices), _replicates_exist, module="qmcpy"),
    Integrator("qmcpy-net", mean_over(interlaced_nets), _replicates_exist, module="qmcpy"),
)
