"""Estimates of an integral and their standard errors: of one set of strata, or from the spread of several sets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .._support.arrays import Array
from ..designs.design import DESIGNS, design_of
from ..designs.engines import EngineFactory
from ..designs.sampling import SampleSet, largest_size, sample
from ..rules.fit import ChosenFit, CrossFit, Fit, ResidualFit
from ..rules.method import Method
from ..rules.registry import Rule, integration_rule, tells_own_error
from .batch_sums import BatchSums
from .diagnostics import IntegrationWarning, diagnosis
from .gradients import WeightedCalls
from .integrand import Integrand
from .tails import heavy_tail
from .units import powers

#: Replicates that one estimate is split into where a rule needs several sets.
REPLICATES = 4

#: Fewest samples, or this part of all samples if that is less, that must contribute to an estimate to be reliable.
FEWEST_SAMPLES, FEWEST_PART = 10, 0.25

#: Warnings that the samples do not resolve the integrand; a warning of a single stratum would add nothing to them.
UNRESOLVED = ("few-samples", "heavy-tail")

#: Ratio of a residual to the largest value from which on it is surprising, and fewest strata for such a warning.
SURPRISE, FEWEST_STRATA = 0.1, 16


@dataclass(frozen=True)
class Estimate:
    """Mean and standard error of each of the integrand's components, (fields,).

    ``rounding`` is the part of the error that no number of points reduces. ``deviations`` (fields, m) tell how the
    errors of components are linked: the correlation of k and l is Σ_m D_km D_lm over the roots of the sums of squares.
    ``rules`` (fields,) say what predicted each. ``trials`` are the estimates that led to the size of this one.
    ``terms`` are the weights of func's values, where these have gradients.
    """

    mean: Array
    error: Array
    rounding: Array
    n: int
    degrees_of_freedom: float
    warnings: tuple[IntegrationWarning, ...] = ()
    deviations: Array | None = None
    rules: tuple[str, ...] = ()
    trials: tuple[Estimate, ...] = ()
    terms: tuple[WeightedCalls, ...] = ()

    @property
    def resolved(self) -> bool:
        """Whether the samples resolve the integral. Components that are 0 beside others count as resolved."""
        return not any(
            warning.kind == "few-samples"
            or (warning.kind == "zero" and len(warning.details["components"]) == len(self.mean))
            for warning in self.warnings
        )


@dataclass(frozen=True)
class Values:
    """Values of a function (sets, fields, n), in units of 2^power, (fields,).

    The largest of a component lies between ½ and 1, so no square in a rule over- or underflows. Rules are linear and
    units are powers of two, so no bit of the result depends on the units.
    """

    scaled: Array
    power: NDArray[np.intc]

    @classmethod
    def of(cls, integrand: Integrand, points: Array) -> Values:
        """Those at points (sets, n, d), each of which is uniform in the box."""
        sets, n, d = points.shape
        done: list[Array] = []
        integrand.watch.follow(PlainMean(done).estimate)
        values = integrand.in_random_order(points.reshape(-1, d), done)
        power = powers(values, axis=1)
        values = np.ldexp(values, -power)
        return cls(np.ascontiguousarray(values.reshape(-1, sets, n).swapaxes(0, 1)), power[:, 0])

    @property
    def n(self) -> int:
        """Evaluations in all."""
        return self.scaled.shape[0] * self.scaled.shape[2]


@dataclass(frozen=True)
class Estimator:
    """Draws fresh samples of an integrand and estimates its integral by a rule."""

    integrand: Integrand
    sampler: str | EngineFactory
    methods: tuple[Method, ...]
    debias: str
    sets: int
    rng: np.random.Generator
    threads: int

    def __call__(self, n: int) -> Estimate:
        """An estimate from sets of at most n points."""
        return replace(self, integrand=self.integrand.for_samples(n))._of_samples(self._draw(n))

    def _of_samples(self, drawn: SampleSet) -> Estimate:
        rule = integration_rule(drawn.kind, self.methods, self.debias)
        begin = len(self.integrand.function.tape)
        values = Values.of(self.integrand, drawn.points)
        fit = rule.fit(drawn, self.threads, values.scaled)
        means, rounding = fit.estimates(values.scaled, self.integrand.epsilon)
        error, degrees_of_freedom = fit.standard_error(means)
        warning = self._warning(fit, drawn, values)
        terms = self._terms(begin, drawn.points, fit) if self.integrand.function.tape else ()
        return self._estimate(
            means.mean(axis=0), error, rounding.mean(axis=0), degrees_of_freedom, values, warning,
            fit.deviations(means), _told(rule, fit, means.shape[1]), terms,
        )  # fmt: skip

    def _terms(self, begin: int, points: Array, fit: Fit) -> tuple[WeightedCalls, ...]:
        """The weights of the values of points (sets, n, d), in the order of their evaluation."""
        u = points.reshape(-1, points.shape[-1])
        by_field = fit.weights if fit.weights.ndim == 3 else fit.weights[:, None]
        weights = by_field.swapaxes(0, 1).reshape(by_field.shape[1], -1) / len(points)
        order = self.integrand.order(u)
        if order is not None:
            u, weights = u[order], weights[:, order]
        return self.integrand.weighted_calls(begin, u, weights)

    def _warning(self, fit: Fit, drawn: SampleSet, values: Values) -> IntegrationWarning | None:
        """What a single set gives reason to warn of.

        The bar of chosen models knows how few strata it rests on, as beside a step, and holds there.
        """
        if len(drawn.batch) > 1 or isinstance(fit, ChosenFit):
            return None
        if isinstance(fit, ResidualFit):
            return surprising_stratum(self.integrand, drawn.points[0], values.scaled[0], fit.residuals[0])
        return diagnosis("no-error", points=values.n)

    def check(self, n: int) -> None:
        """Raise ValueError where an estimate would, for the sampler or the rule; nothing is evaluated."""
        drawn = replace(self, rng=np.random.default_rng(0))._draw(n)
        integration_rule(drawn.kind, self.methods, self.debias)

    def _draw(self, n: int) -> SampleSet:
        """Sets of at most n points; four replicates of a quarter of them if a single set gives no error."""
        sets, d = self.sets, self.integrand.d
        own_error = isinstance(self.sampler, str) and tells_own_error(self.sampler, self.debias)
        if sets == 1 and n >= 2 * REPLICATES and not own_error:
            sets, n = REPLICATES, n // REPLICATES
        drawn = sample(self.sampler, largest_size(self.sampler, n, d), d, sets=sets, rng=self.rng)
        if not design_of(drawn.design).randomised:
            raise ValueError(
                "sampler: the error needs independent sets of points that are uniform in the box, and those of "
                f"{drawn.design!r} are not; choose one of "
                f"{', '.join(name for name, design in DESIGNS.items() if design.randomised)}, "
                "or an engine that scrambles its points and does not optimise them"
            )
        return drawn

    def _estimate(
        self,
        mean: Array,
        error: Array,
        rounding: Array,
        degrees_of_freedom: float,
        values: Values,
        warning: IntegrationWarning | None,
        deviations: Array | None,
        rules: tuple[str, ...],
        terms: tuple[WeightedCalls, ...],
    ) -> Estimate:
        """With rounding in the error, the units of func, and what the values themselves give reason to warn of."""
        warnings = [] if self.integrand.empty else of_values(values.scaled)
        if warning and not (warning.kind == "one-stratum" and any(w.kind in UNRESOLVED for w in warnings)):
            warnings.append(warning)
        mean, error, rounding = (np.ldexp(x, values.power) for x in (mean, np.hypot(error, rounding), rounding))
        return Estimate(
            mean, error, rounding, values.n, degrees_of_freedom, tuple(warnings), deviations, rules, terms=terms
        )


class PlainMean:
    """The mean of values (fields, m) of batches at points in random order; each batch is summed once.

    Parameters
    ----------
    parts : list of ndarray
        Grows as batches come.
    """

    def __init__(self, parts: list[Array]):
        self._parts = parts
        self._known: tuple[int, BatchSums | None] = 0, None  # how many are summed, and their sums

    def estimate(self) -> Estimate | None:
        """That of the batches so far; None of fewer than two points."""
        summed, sums = self._known
        for part in self._parts[summed:]:
            new = BatchSums.of(part)
            sums = new if sums is None else sums + new
        self._known = len(self._parts), sums  # at once, since Ctrl-C may come at any time
        if sums is None or sums.n < 2:
            return None
        n, error = sums.n, np.sqrt(sums.scatter / (sums.n - 1)) / math.sqrt(sums.n)
        warnings = tuple(unresolved(sums.absolute, sums.square, sums.square == 0, n, []))
        mean, error = (np.ldexp(x, sums.power) for x in (sums.mean, error))
        return Estimate(mean, error, np.zeros_like(error), n, n - 1, warnings)


def _told(rule: Rule, fit: Fit, fields: int) -> tuple[str, ...]:
    """What predicted each field."""
    if isinstance(fit, ChosenFit):
        return fit.chosen
    across = f" across {len(fit.weights)} sets" if isinstance(fit, CrossFit) else ""
    return (f"{rule.method}{across}",) * fields


def of_values(values: Array) -> list[IntegrationWarning]:
    """Warnings of components that the samples do not resolve, from values (sets, fields, n)."""
    sizes = np.abs(values.swapaxes(0, 1).reshape(values.shape[1], -1))
    squares = np.square(sizes).sum(axis=1)
    return unresolved(sizes.sum(axis=1), squares, squares == 0, sizes.shape[1], [[of_field] for of_field in sizes])


def unresolved(
    totals: Array, squares: Array, zero: NDArray[np.bool_], n: int, tails: Sequence[Sequence[Array]]
) -> list[IntegrationWarning]:
    """The same from Σ|f| and Σf² (fields,) of n samples, each times its weight, and which components are 0.

    An estimate rests on about (Σ|f|)² / Σ f² samples: n where all values are alike, 1 where one is far larger
    than the others. `tails` are values of each component as :func:`heavy_tail` takes them; it is empty if the tail is
    not looked at.
    """
    known = np.isfinite(squares) & (squares > 0)
    support = np.divide(totals**2, squares, out=np.full(len(totals), np.inf), where=known)
    fewest = min(FEWEST_SAMPLES, FEWEST_PART * n)
    found = []
    if zero.any():
        found.append(diagnosis("zero", components=np.flatnonzero(zero).tolist(), of=len(totals)))
    few = np.flatnonzero(support < fewest).tolist()
    if few:
        found.append(diagnosis("few-samples", samples=round(float(support.min()), 1), of=n, components=few))
    if heavy := heavy_tail({field: parts for field, parts in enumerate(tails) if field not in few}):
        found.append(heavy)
    return found


def surprising_stratum(integrand: Integrand, u: Array, values: Array, residuals: Array) -> IntegrationWarning | None:
    """A warning if one stratum dominates the error of a component and its value is far from its prediction.

    Values and residuals are (fields, n), in units of which a field's largest value has ½ to 1. A residual that is
    small beside its value, or beside the largest value, is no surprise: what is predicted worst of a smooth integrand
    is a corner of the box, and that may well make up the error.
    """
    squares = np.square(residuals)
    total = squares.sum(axis=1)
    share = np.divide(squares, total[:, None], out=np.zeros_like(squares), where=total[:, None] > 0)
    share[np.abs(residuals) < np.maximum(np.abs(values) / 2, SURPRISE)] = 0
    _, worst = np.unravel_index(np.argmax(share), share.shape)
    if share.max() <= 0.5 or residuals.shape[1] < FEWEST_STRATA:
        return None
    x, _ = integrand.pull_back(u[worst][:, None])
    return diagnosis("one-stratum", x=x[:, 0].tolist(), share=round(float(share.max()), 3))
