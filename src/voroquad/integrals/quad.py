"""Numerical integration: one call, an unbiased value and its error."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from .._support.checks import one_of, positive_int, thread_count
from ..designs.design import DESIGNS, design_of
from ..designs.engines import EngineFactory
from ..designs.sampling import Rng, as_generator, largest_size, sample
from ..rules import cross_fit
from ..rules.registry import DEBIAS, weights
from ..rules.strata_fits import check_order, default_order, error_scale, fit_strata
from .integrand import Integrand, warn
from .refinement import Estimate, refine, tolerance

Array = NDArray[np.float64]

#: Standard error of a sum Σ_i w_i f_i by rounding, over Σ_i |w_i f_i|.
ROUNDING = 3 * float(np.finfo(float).eps)

#: Replicates that one estimate is split into where a rule needs several sets.
REPLICATES = 4


class ConfidenceInterval(NamedTuple):
    """Ends of an interval; arrays for vector-valued integrands."""

    low: Any
    high: Any


@dataclass(frozen=True)
class QuadResult:
    """What :func:`quad` returns. ``print`` shows it as a value with its uncertainty, 2.66613(4).

    Attributes
    ----------
    integral : float or array
        The estimate, in the shape of func's values.
    standard_error : float or array
        Its standard error.
    n_evaluations : int
        Number of points func was evaluated at.
    degrees_of_freedom : float
        Of the Student-t distribution that :meth:`confidence_interval` takes.
    """

    integral: Any
    standard_error: Any
    n_evaluations: int
    degrees_of_freedom: float = field(default=math.inf, repr=False)

    def confidence_interval(self, level: float = 0.95) -> ConfidenceInterval:
        """The interval that holds the integral in a fraction `level` of repetitions.

        Raises ValueError for a level outside (0, 1).
        """
        if not 0 < level < 1:
            raise ValueError(f"level must be between 0 and 1, got {level!r}; 0.95 is the usual one")
        half = float(stats.t.ppf((1 + level) / 2, self.degrees_of_freedom)) * self.standard_error
        return ConfidenceInterval(self.integral - half, self.integral + half)

    def __str__(self) -> str:
        value, error = np.asarray(self.integral), np.asarray(self.standard_error)
        texts = [with_uncertainty(v, e) for v, e in zip(value.flat, error.flat, strict=True)]
        if value.ndim == 0:
            return texts[0]
        return np.array2string(np.array(texts).reshape(value.shape), formatter={"all": str})


def with_uncertainty(value: float, error: float) -> str:
    """A number as scientists write it: the last digits' uncertainty in brackets.

    Examples
    --------
    >>> from voroquad.integrals.quad import with_uncertainty
    >>> with_uncertainty(2.666131, 0.000042), with_uncertainty(-12.3, 0.14), with_uncertainty(5231.0, 120.0)
    ('2.66613(4)', '-12.30(14)', '5230(120)')
    """
    largest = max(abs(value), error)
    if not math.isfinite(largest + error) or 0 < largest < 1e-300:
        return f"{value:.6g}({error:.2g})"
    if error <= 0:
        return f"{value:.15g}"
    if not 1e-4 <= largest < 1e15:  # in scientific notation, both to the same power
        power = math.floor(math.log10(largest))
        return f"{with_uncertainty(value / 10.0**power, error / 10.0**power)}e{power:+03d}"
    # One digit of the error, two where the first is 1
    mantissa, exponent = f"{error:.1e}".split("e")
    digits = 1 - int(exponent) if mantissa.startswith("1") else -int(f"{error:.0e}".split("e")[1])
    if digits <= 0:
        return f"{round(value, digits):.0f}({round(error, digits):.0f})"
    return f"{value:.{digits}f}({round(error * 10**digits):d})"


def quad(
    func: Callable[[Any], Any],
    a: Any,
    b: Any,
    *,
    n_points: int = 1024,
    n_estimates: int = 1,
    sampler: str | EngineFactory = "auto",
    order: int | str = "auto",
    debias: str = "auto",
    rng: Rng = None,
    rtol: float | None = None,
    atol: float | None = None,
    max_evaluations: int = 1_000_000,
    workers: int | Callable[..., Any] = 1,
    threads: int | None = None,
) -> QuadResult:
    """Integrate a function over a box.

    Parameters
    ----------
    func : callable
        ``func(x)`` takes points x of shape (d, n) and returns values (n,) or, for several components
        at once, (..., n). The conventions are those of `scipy.integrate.qmc_quad`.
    a, b : float or array_like, (d,)
        Lower and upper limits. They may be infinite. Where b < a the sign changes, as usual.
    n_points : int
        Largest number of evaluations of an estimate. A stratified set has the largest near-cubic
        grid of at most that many strata; other samplers split them into four replicates of the largest size
        that they have where n_estimates is 1.
    n_estimates : int
        Number of independent sets; the result is their mean, its error comes from their spread. Of stratified
        sets each has an estimate of its own. Sets of other samplers, so above d = 4, are the replicates of one
        cross-fit, in place of the four: each is corrected by what the others predict. With two the error has a
        single degree of freedom, and the 95 % interval is 12.7 standard errors to either side.
    sampler : str or callable
        A random one of :func:`voroquad.sample`: a name, or what makes an engine from ``(d, rng=)``, such as
        ``qmc.Sobol`` or ``functools.partial(qmc.Sobol, bits=50)``, but no engine, which has one
        set. "auto" is "multi-jittered" for d ≤ 4 and "sobol" above.
    order : int, "kriging" or "auto"
        Order of the rule. "auto" is a fixed function of the dimension and the number of points:
        :func:`voroquad.rules.strata_fits.default_order` for stratified and multi-jittered sets,
        :func:`voroquad.rules.cross_fit.default_order` for others.
    debias : str
        As in :func:`voroquad.weights`.
    rng : int, numpy.random.Generator or None
        Seed.
    rtol, atol : float, optional
        Tolerance mode: sets of growing size, from n_points on, until half the 95 % interval is at most
        max(atol, rtol \\|I\\|); an argument left out is 0. The result comes from one more set of the last
        size, independent of those that settled the size, so it stays unbiased.
    max_evaluations : int
        Of all sets together, in tolerance mode.
    workers : int or callable
        Number of processes that evaluate func (-1: one per processor), or a map-like callable such as
        ``multiprocessing.Pool(4).map``. The result does not depend on it.
    threads : int, optional
        Number of threads of the rule itself. The result does not depend on it.

    Returns
    -------
    QuadResult
        With ``integral``, ``standard_error``, ``confidence_interval(level)``, ``n_evaluations``.

    Raises
    ------
    ValueError
        Limits that are no numbers; n_points < 1; a rule that does not exist; a sampler that is not random;
        values of a wrong shape.

    Warns
    -----
    IntegrationWarning
        func is not finite somewhere, and the integral is NaN; a single stratum makes up the error, so that the
        integrand is not resolved; there are too few points for an error; a tolerance is not met.

    Notes
    -----
    By default the box is cut into N equal strata S_i, each with one random point x_i, and

        Î = Σ_i [ ∫_{S_i} P_i + \\|S_i\\| (f(x_i) − P_i(x_i)) ],

    where P_i is predicted from samples that x_i does not depend on: a polynomial fitted to those around
    S_i or, by default in more than one dimension, kriging. This is unbiased for every integrand; for smooth
    ones the mean squared error of order p falls as N^(−1−2(p+1)/d), and polynomials up to p are exact. The
    error is read off the corrections of one set, (Σ_i (\\|S_i\\| (f(x_i) − P_i(x_i)))²)^½ times a factor for
    the order and dimension that ``benchmarks/calibrate_errors.py`` found.

    Examples
    --------
    >>> import numpy as np, voroquad as vq
    >>> r = vq.quad(lambda x: np.exp(x[0] * x[1]), [0, 0], [1, 2], rng=7)
    >>> bool(abs(r.integral - 3.6838715105404) < 1e-7)  # Σ 2^(k+1) / ((k+1)² k!)
    True
    >>> r.n_evaluations
    1024
    """
    n_points, n_estimates = positive_int("n_points", n_points), positive_int("n_estimates", n_estimates)
    threads = thread_count(threads)
    one_of("debias", debias, DEBIAS)
    wanted = None if rtol is None and atol is None else tolerance(rtol or 0, atol or 0)
    order = int(order) if isinstance(order, np.integer) else order
    generator = as_generator(rng)
    with _workers(workers) as (spread, parts):
        integrand = Integrand(func, a, b, spread, parts)
        if isinstance(sampler, str) and sampler == "auto":
            sampler = "multi-jittered" if integrand.d <= 4 else "sobol"
        if order != "auto":
            check_order(order, integrand.d)
        stratified = isinstance(sampler, str) and design_of(sampler).stratified and debias in ("auto", "leave-one-out")

        def estimate(n: int) -> Estimate:
            if stratified:
                return _stratified(integrand, n, n_estimates, sampler, order, generator, threads)
            return _replicates(integrand, n, n_estimates, sampler, order, debias, generator, threads)

        if wanted is None:
            found = estimate(n_points)
        else:
            most = positive_int("max_evaluations", max_evaluations)
            if most < n_estimates:
                raise ValueError(f"max_evaluations must be at least n_estimates = {n_estimates}, got {most}")
            found = refine(lambda n: estimate(n // n_estimates), wanted, n_points * n_estimates, most, integrand.d)
    return QuadResult(integrand.result(found.mean), integrand.result(found.error), found.n, found.degrees_of_freedom)


@contextmanager
def _workers(workers: int | Callable[..., Any]) -> Iterator[tuple[Callable[..., Any], int]]:
    """A map, and the number of parts to split the points into."""
    processors = os.cpu_count() or 1
    if callable(workers):
        yield workers, processors
    elif workers == 1:
        yield map, 1
    else:
        number = processors if workers == -1 else positive_int("workers", workers)
        with ProcessPoolExecutor(number) as pool:
            yield pool.map, number


def _stratified(
    integrand: Integrand,
    n_points: int,
    sets: int,
    sampler: str | EngineFactory,
    order: int | str,
    rng: np.random.Generator,
    threads: int,
) -> Estimate:
    """Leave-one-out on `sets` sets of one sample per stratum."""
    samples = sample(sampler, largest_size(sampler, n_points, integrand.d), integrand.d, sets=sets, rng=rng)
    assert samples.strata is not None
    p = default_order(samples.strata) if order == "auto" else order
    values, power = _values(integrand, samples.points)
    w, residuals = fit_strata(samples, p, threads, values)
    means = np.einsum("sn,sfn->sf", w, values)
    if sets > 1:
        return _across_sets(means, samples.n).times_two_to(power)
    _warn_if_unresolved(integrand, samples.points[0], values[0], residuals[0])
    corrections = error_scale(p, samples.strata) * np.sqrt(np.square(residuals[0]).sum(axis=-1)) / samples.n
    rounding = ROUNDING * (np.abs(w[0]) * np.abs(values[0])).sum(axis=-1)
    error = np.hypot(corrections, rounding)
    return Estimate(means[0], error, samples.n, math.inf).times_two_to(power)


def _replicates(
    integrand: Integrand,
    n_points: int,
    sets: int,
    sampler: str | EngineFactory,
    order: int | str,
    debias: str,
    rng: np.random.Generator,
    threads: int,
) -> Estimate:
    """Any rule of :func:`voroquad.weights` on independent sets; one estimate is split into four.

    With nothing asked for: cross-fit, or the plain mean of a single replicate.
    """
    if sets == 1 and n_points >= 2 * REPLICATES:
        sets, n_points = REPLICATES, n_points // REPLICATES
    n_points = largest_size(sampler, n_points, integrand.d)
    samples = sample(sampler, n_points, integrand.d, sets=sets, rng=rng)
    if not design_of(samples.design).randomised:
        raise ValueError(
            f"sampler: the error is read off random sets of uniform points, and {samples.design!r} has none; "
            f"choose one of {', '.join(name for name, design in DESIGNS.items() if design.randomised)}"
        )
    values, power = _values(integrand, samples.points)
    fits = sets > 1 and debias in ("auto", "cross-fit")
    scale = 1.0
    p = order if order != "auto" else "kriging" if fits else 0
    if fits and p:
        shares = cross_fit.fit_replicates(samples.points, p, threads)
        means = np.einsum("rsn,sfn->rf", shares, values)
        scale = cross_fit.ERROR_SCALE
    else:
        plain = order == "auto" and debias == "auto"
        w = (
            np.full((sets, n_points), 1 / n_points)
            if plain
            else weights(samples, order=p, debias=debias, threads=threads)
        )
        means = np.einsum("sn,sfn->sf", w, values)
    return _across_sets(means, n_points, scale).times_two_to(power)


def _values(integrand: Integrand, points: Array) -> tuple[Array, NDArray[np.intc]]:
    """Values (sets, fields, n) at points (sets, n, d), by one call, in units of 2^power, (fields,).

    The largest of a component lies between ½ and 1: no square of what a rule makes of it over- or underflows,
    and since rules are linear and units powers of two, not a bit of the result depends on them.
    """
    sets, n, d = points.shape
    values = integrand(points.reshape(-1, d))
    _, power = np.frexp(np.abs(values).max(axis=1, initial=0, where=np.isfinite(values)))
    values = np.ldexp(values, -power[:, None])
    return np.ascontiguousarray(values.reshape(-1, sets, n).swapaxes(0, 1)), power


def _across_sets(means: Array, n: int, scale: float = 1.0) -> Estimate:
    """Mean and `scale` times the standard error of independent estimates (sets, fields)."""
    sets = len(means)
    if sets == 1:
        warn(f"no error can be told from a single set of n = {n} points; take n_points ≥ {2 * REPLICATES}")
        return Estimate(means[0], np.full(means.shape[1], np.nan), n, 1)
    error = scale * means.std(axis=0, ddof=1) / math.sqrt(sets)
    return Estimate(means.mean(axis=0), error, sets * n, sets - 1)


def _warn_if_unresolved(integrand: Integrand, u: Array, values: Array, residuals: Array) -> None:
    """Warn where one stratum makes up the error of a component and its value came as a surprise.

    Values and residuals are (fields, n), in units of which a field's largest value has ½ to 1. A residual that is
    small beside its value, or below a thousandth, is no surprise: what is predicted worst of a smooth integrand is a
    corner of the box, and that may well make up the error.
    """
    squares = np.square(residuals)
    total = squares.sum(axis=1)
    share = np.divide(squares, total[:, None], out=np.zeros_like(squares), where=total[:, None] > 0)
    share[np.abs(residuals) < np.maximum(np.abs(values) / 2, 1e-3)] = 0
    _, worst = np.unravel_index(np.argmax(share), share.shape)
    if share.max() > 0.5 and residuals.shape[1] >= 16:
        x, _ = integrand.pull_back(u[worst][:, None])
        warn(
            f"one stratum, at x = {x[:, 0].tolist()}, makes up {share.max():.0%} of the error: the integrand is "
            "not resolved there and the error bar is uncertain; use more points or split the box"
        )
