"""Numerical integration: one call, an unbiased value and its error."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, ParamSpec, TypeVar

import numpy as np

from .._support.checks import one_of, positive_int, thread_count, truth
from ..designs.engines import EngineFactory
from ..designs.sampling import Rng, as_generator
from ..rules.registry import DEBIAS
from .adaptation import Adaptation, Learner, single
from .estimates import Estimate, Estimator
from .evaluation import Function
from .integrand import Integrand
from .kept import KeptEvaluations, KeptTrials
from .measures import PiecewiseUniform, ProductMeasure
from .methods import adaptive, at_need, estimator
from .pieces import Part, Sum
from .places import parts_of
from .progress import Progress, batches, ended, following
from .refinement import Tolerance, refine, tolerance
from .regions import Region
from .result import QuadResult
from .rotation import rotating
from .watch import Watch, WatchOfParts
from .workers import mapping

P = ParamSpec("P")
R = TypeVar("R")

#: What to write in place of arguments that functions of `scipy.integrate` have.
INSTEAD = {
    "qrng": "sampler=qmc.Sobol (the class, or functools.partial of it with its options) and rng= the seed",
    "log": "quad(lambda x: np.exp(g(x) - c), a, b) with a constant c about as large as g, and add c to the logarithm",
    "epsrel": "rtol=",
    "epsabs": "atol=",
    "seed": "rng=",
    "limit": "max_evaluations=",
    "opts": "rtol=, atol= and max_evaluations=",
    "ranges": "a= the lower and b= the upper limits; both may hold callables",
    "complex_func": "nothing: complex values are integrated as they are",
    "neval": "n_points=",
    "nitn": "n_estimates=",
}

#: Arguments of `quad` that determine at which points func is evaluated, and in which batches.
SETTINGS = (
    "func", "args", "kwargs", "a", "b", "measure", "loc", "scale", "n_points", "n_estimates", "adapt", "method",
    "sampler", "order", "debias", "rng", "rtol", "atol", "max_evaluations", "batch",
)  # fmt: skip

#: Those that may differ between calls that share a store, in tolerance mode.
OF_TOLERANCE = ("rtol", "atol", "max_evaluations")


def _answer_others(function: Callable[P, R]) -> Callable[P, R]:
    """Tell what to write in place of an argument that functions of SciPy have and this one has not."""

    @functools.wraps(function)
    def checked(*args: P.args, **named: P.kwargs) -> R:
        for name in named:
            if name in INSTEAD:
                raise TypeError(f"quad has no {name}=; write {INSTEAD[name]}")
        return function(*args, **named)

    return checked


@_answer_others
def quad(
    func: Callable[..., Any],
    a: Any = None,
    b: Any = None,
    *,
    measure: ProductMeasure | PiecewiseUniform | None = None,
    args: tuple[Any, ...] = (),
    kwargs: Mapping[str, Any] | None = None,
    vectorized: bool = True,
    loc: Any = 0.0,
    scale: Any = 1.0,
    n_points: int = 1024,
    n_estimates: int = 1,
    adapt: bool | str = "auto",
    method: str = "auto",
    sampler: str | EngineFactory = "auto",
    order: int | str = "auto",
    debias: str = "auto",
    rng: Rng = None,
    rtol: float | None = None,
    atol: float | None = None,
    max_evaluations: int = 1_000_000,
    batch: int | None = None,
    callback: Callable[[Progress], Any] | None = None,
    progress: bool = False,
    store: str | os.PathLike[str] | None = None,
    workers: int | Callable[..., Any] = 1,
    client: Any = None,
    threads: int | None = None,
) -> QuadResult:
    """Integrate a function over a box or another domain, or against a measure.

    Parameters
    ----------
    func : callable
        ``func(x, *args, **kwargs)`` takes points x of shape (d, n) and returns values (n,) or, for several components
        at once, (..., n), or a dict or a tuple of such arrays. Values may be complex. The result has the shape (...),
        or the same structure. The conventions are those of `scipy.integrate.qmc_quad`.
    a, b : float or array_like, (d,)
        Lower and upper limits. They may be infinite. If b < a the sign changes, as usual. If they are arrays, func gets
        points of their library and dtype, on their device, and the results are such arrays too. In a
        list, the limits of coordinate i may be callables of the coordinates after it, x_{i+1}, …, x_{d−1}, as in
        `scipy.integrate.nquad`; they get and return arrays (n,).
        Alternatively `a` is a domain and `b` is left out: a :class:`~voroquad.Triangle`, :class:`~voroquad.Simplex`,
        :class:`~voroquad.Ball`, :class:`~voroquad.PolarBall`, :class:`~voroquad.SphereSurface`,
        :class:`~voroquad.Polygon` or :class:`~voroquad.Polytope`.
    measure : ProductMeasure or PiecewiseUniform, optional
        The measure μ of ∫ f dμ, instead of limits. For a probability measure this is an expectation. The pieces of a
        PiecewiseUniform share n_points in proportion to their counts. Five or more normal coordinates are rotated such
        that func varies most along the first ones. A pilot of n_points/8 evaluations finds the rotation; if n_estimates
        > 1 it is in addition to n_points.
    args, kwargs : tuple, mapping
        Further arguments of func.
    vectorized : bool
        False if func takes a single point (d,) and returns its value. It is then called once per point.
    loc, scale : float or array_like, (d,)
        Location and scale of func on infinite intervals. Half of the points are below a + scale on [a, ∞), above b −
        scale on (−∞, b], and within ⅔ scale of loc on the whole line.
    n_points : int
        Largest number of evaluations of an estimate. A stratified set has the largest near-cubic grid of at most that
        many strata. Other samplers draw four replicates, each of the largest size that they allow, if n_estimates is 1.
    n_estimates : int
        Number of independent sets. The result is the mean of their estimates, and its error comes from their spread.
        Stratified sets are estimated independently, and so are those of the method "polynomials", the default for many
        points in d ≥ 4. Sets of other samplers, and so all others above d = 4, are the replicates of one cross-fit,
        instead of the four replicates: each corrects a prediction from the others. With two sets the error has a single
        degree of freedom, and the 95 % interval extends 12.7 standard errors to either side.
    adapt : bool or "auto"
        For peaks that are narrower than strata. True learns from a pilot where func is large; the attribute
        `adaptation` of the result shows it. In d ≤ 3 the method is "pilot", with a map of each axis if its grid then
        predicts a smaller error. Above, a pilot of 30 % of the evaluations learns a map of each axis and, if that
        gains, a tree of boxes that have samples of their own. If `method`, `order` or `sampler` is given, only the map
        is learned and that rule is used. True needs 400 evaluations.
        "auto" adapts only if a first look calls for it, and only in place of the default rule, up to d = 20, for one
        region, without a tolerance. The look takes 1.5 % of the evaluations in d = 3, what a grid of strata
        leaves over in d = 4, and 3 %, at most 256, from d = 5 on. It looks from 1000 points on in d = 4, from 2000
        in d = 5 and 6, 3000 in d = 3, 4000 in d = 7 and 8, and 8000 above. Where the method is "pilot", its grid
        is the look and costs nothing; n_estimates > 1 has no other. False never looks.
    method : str
        "auto": the rule that `order`, `sampler` and `debias` name. If they name none, the method for many points is
        "pilot", from 2049 on in d ≤ 2 and from 8000 in d = 3, and "polynomials", from 8192 on in d = 4 and
        from 16384 in 5 ≤ d ≤ 20. With fewer points a model that the values of func choose, or kriging.
        "kriging" and "local": each sample is predicted from those around it, by kriging or by polynomials. The order of
        the polynomials is 8 in the plane and 3 above; on a line it is the highest for which there are enough points.
        `order` may name another.
        "pilot", for many points in d ≤ 3: a grid of a quarter of the points predicts func, and the others go where the
        prediction is poor.
        "polynomials", for many points in up to 20 dimensions: Sobol' replicates, corrected by polynomials that are
        fitted to other replicates.
        "plain": no prediction.
    sampler : str or callable
        A randomised sampler of :func:`voroquad.sample`: a name, or a callable ``(d, rng=)`` that returns an engine,
        such as ``qmc.Sobol`` or ``functools.partial(qmc.Sobol, bits=50)``. An engine instance is not allowed, since it
        yields a single set. "auto" is "multi-jittered" for d ≤ 4 and "sobol" above.
    order : int, "kriging" or "auto"
        Order of the rule. With "auto" the values of func choose the model, for multi-jittered sets of up to 32768
        points on a line and 2048 above. For other sets the order depends only on the dimension and the number of
        points: stratified and larger multi-jittered sets have that of
        :func:`voroquad.rules.defaults.default_of_strata`, all others "kriging". 0 is plain stratification, or the plain
        mean of replicates.
    debias : str
        As in :func:`voroquad.weights`.
    rng : int, numpy.random.Generator or None
        Seed.
    rtol, atol : float, optional
        Tolerance mode: the size of sets grows from n_points on, until half the 95 % interval is at most max(atol, rtol
        \\|I\\|). An argument that is left out is 0. The result is that of one more set of the last size, which is
        independent of those that determined the size, so it is unbiased.
    max_evaluations : int
        Largest number of evaluations of all sets together, in tolerance mode.
    batch : int, optional
        Largest number of points in a call of func. The result does not depend on it. By default func gets many points
        at once, or a 64th of the points of an estimate with `callback`, `progress`, `store`, `client` or
        vectorized=False.
    callback : callable, optional
        ``callback(p)`` gets a :class:`Progress` after each batch, with the evaluations so far and, once there is one,
        the estimate with its error. If it returns True or raises StopIteration, the integration ends with that estimate
        and the warning ``"stopped"``; where there is none yet, the result is NaN. The estimate is unbiased if the
        decision depends on time or evaluations and not on its value.
    progress : bool
        Show a bar on standard error.
    store : str or path, optional
        Folder, as any path of fsspec, where the evaluations of an expensive func are kept batch by batch. The same call
        after a kill finds them there and computes the rest. Calls that differ only in their tolerance share the store:
        the sets of those before are trials. It needs a seed (`rng`) and the extra ``cluster``. A store
        that belongs to another call is refused. A function is identified only by its name, a `functools.partial` also
        by what it binds, and an object only by its class; pass its parameters as `args`.
    workers : int or callable
        Number of processes that evaluate func (-1: one per processor), or a map-like callable such as
        ``multiprocessing.Pool(4).map``. The result does not depend on it. Each call starts its own processes, which
        takes about a second. They import the calling script, so the call must stand under
        ``if __name__ == "__main__":``.
    client : distributed.Client or str, optional
        In place of `workers`: a Dask cluster that evaluates func, batch by batch, or the address of its scheduler. The
        result does not depend on it, and workers may die. It needs the extra ``cluster``.
    threads : int, optional
        Number of threads of the rule itself. The result does not depend on it.

    Returns
    -------
    QuadResult
        With ``integral``, ``standard_error``, ``confidence_interval(level)``, ``n_evaluations``, ``success`` and
        ``warnings``. It unpacks into integral and standard error.

    Raises
    ------
    ValueError
        A limit is not a number; n_points < 1, or too few for `method` or adapt=True; there is no such rule; the points
        of the sampler are not uniform; values have a wrong shape or are masked; func cannot be sent to other processes.
    IntegrationInterrupted
        Ctrl-C, as a KeyboardInterrupt whose ``result`` is the estimate so far, if there is one yet.
    RuntimeError
        A worker process ended early, or func raised an exception that cannot be sent to this process.
    TypeError
        func or callback is not callable; an argument is that of a SciPy function and not of this one (the message says
        what to write instead).
    Exception
        Any exception of func, with a note that tells the points. If func raises TypeError, ValueError or IndexError but
        accepts a single point, it is called point by point instead.

    Warns
    -----
    IntegrationWarning
        The value or its error is not reliable; the attribute ``kind`` of the warning tells why. func is not finite
        somewhere, and the integral is NaN; all values are 0, or the estimate rests on fewer than ten samples, so that
        nothing is resolved; the largest values grow like those of a singularity with infinite variance; a single
        stratum causes most of the error; there are too few points for an error, or it is not finite; a tolerance is not
        met. Some warnings are only advice: give atol if the integral is 0; func is called point by point.

    Notes
    -----
    By default the box is cut into N equal strata S_i, each with one random point x_i, and

        Î = Σ_i [ ∫_{S_i} P_i + \\|S_i\\| (f(x_i) − P_i(x_i)) ],

    where P_i is a prediction from samples that are independent of x_i: on a line a polynomial fitted to those around
    S_i, in more dimensions kriging with one of three models or a polynomial fitted to the whole set. The order or model
    is chosen by the errors of predictions elsewhere, separately for each component of func; the attribute ``rule`` of
    the result tells which.
    The estimate is unbiased for every integrand. The error is computed from the corrections f(x_i) − P_i(x_i), with
    Student's t distribution if few of them cause it.

    Examples
    --------
    >>> import numpy as np, voroquad as vq
    >>> r = vq.quad(lambda x: np.exp(x[0] * x[1]), [0, 0], [1, 2], rng=7)
    >>> bool(abs(r.integral - 3.6838715105404) < 1e-7)  # Σ 2^(k+1) / ((k+1)² k!)
    True
    >>> r.n_evaluations
    1024
    """
    given = {name: value for name, value in locals().items() if name in SETTINGS}
    n_points, n_estimates = positive_int("n_points", n_points), positive_int("n_estimates", n_estimates)
    threads, vectorized, progress = thread_count(threads), truth("vectorized", vectorized), truth("progress", progress)
    one_of("debias", debias, DEBIAS)
    wanted = None if rtol is None and atol is None else tolerance(rtol or 0, atol or 0)
    batch = None if batch is None else positive_int("batch", batch)
    _check_callback(callback)
    most = n_points * n_estimates if wanted is None else _budget(max_evaluations, n_estimates)
    generator = as_generator(rng)
    places, library = parts_of(a, b, measure, loc, scale)
    adaptations: list[Adaptation] = []
    watch: Watch[Estimate] = Watch()
    watch_here = watch if len(places) == 1 else WatchOfParts(watch)
    followed = progress or not vectorized or any(x is not None for x in (callback, store, client))
    kept = None if store is None else _kept_in(store, rng, given | {"rng": generator, "n_points": n_points}, wanted)
    rounds = None if kept is None else KeptTrials(kept, {name: given[name] for name in OF_TOLERANCE}, generator)
    with mapping(workers, (func, args, kwargs), client, kept) as (spread, parts):
        most_at_once = batches(batch, n_points, followed)
        function = Function(func, library, args, kwargs, vectorized, spread, parts, most_at_once, kept)
        rule = _Rule(function, watch_here, n_points, method, sampler, order, debias, generator, threads)
        region = single(places, adapt, wanted is not None)
        if region is None:
            estimate = rule.on(places, n_estimates)
        else:
            estimate = rule.adapted(places, region, n_estimates, adapt != "auto", adaptations.append)
        d = places[0].region.d
        compute = _computing(estimate, wanted, n_points, n_estimates, most, d, function, watch, rounds)
        with following(watch, function, callback, progress, most):
            result = ended(lambda: _with_gradients(compute(), function, d), watch, function)
    return replace(result, adaptation=adaptations[0]) if adaptations else result


def _computing(
    estimate: Callable[[int], Estimate],
    wanted: Tolerance | None,
    n_points: int,
    n_estimates: int,
    most: int,
    d: int,
    function: Function,
    watch: Watch[Estimate],
    rounds: KeptTrials | None,
) -> Callable[[], Estimate]:
    """What computes the estimate, refined until it meets a tolerance if there is one."""
    if wanted is None:
        return lambda: estimate(n_points)
    first = n_points * n_estimates
    estimated = lambda n: estimate(n // n_estimates)  # noqa: E731
    return lambda: refine(estimated, wanted, first, most, d, function.diagnoses, watch, rounds)


def _check_callback(callback: Any) -> None:
    if callback is not None and not callable(callback):
        raise TypeError(f"callback must be callable, as lambda p: p.n_evaluations > 10**6 is, got {callback!r}")


def _kept_in(
    store: str | os.PathLike[str], rng: Rng, settings: dict[str, Any], wanted: Tolerance | None
) -> KeptEvaluations:
    """The evaluations that a store has of a call with these settings, whatever the tolerance if there is one."""
    if not isinstance(store, str | os.PathLike):
        raise ValueError(f"store must be a folder or another path of fsspec, such as 'runs/wing', got {store!r}")
    if rng is None:
        raise ValueError("store needs a seed, or the same call has other points; give rng (--seed), such as 1")
    names = SETTINGS if wanted is None else [name for name in SETTINGS if name not in OF_TOLERANCE]
    return KeptEvaluations.of(store, {name: settings[name] for name in names} | {"refined": wanted is not None})


def _with_gradients(found: Estimate, function: Function, d: int) -> Estimate:
    """The estimate in d dimensions; ValueError if values have gradients and it is not known as their sum."""
    if function.tape and sum(term.end - term.begin for term in found.terms) == 0:
        other = "local" if d <= 4 else "kriging"
        raise ValueError(
            f'values of func have gradients, which this rule does not keep; give method="{other}" and adapt=False'
        )
    return found


@dataclass(frozen=True)
class _Rule:
    """The rule that the arguments of `quad` name, for any region."""

    function: Function
    watch: Watch[Estimate]
    n_points: int
    method: str
    sampler: str | EngineFactory
    order: int | str
    debias: str
    rng: np.random.Generator
    threads: int

    def on(self, places: list[Part], sets: int) -> Callable[[int], Estimate]:
        """What estimates the integral over all pieces; normal coordinates of many dimensions are turned."""
        turned = rotating(places, self.integrand, self._turned, sets, self.rng)
        if turned:
            self._check(self._turned(turned.gaussian, sets))
        return turned or Sum(places, functools.partial(self._over, sets=sets))

    def adapted(
        self, places: list[Part], region: Region, sets: int, always: bool, report: Callable[[Adaptation], None]
    ) -> Callable[[int], Estimate]:
        """What estimates the integral with what a pilot shows; if not always, where a default rule shows it a need."""
        over = functools.partial(self._over, sets=sets)
        pilot = Learner(self.integrand, region, always, self.rng)
        if not always:
            plain = self.on(places, sets)
            looks = self._by_default and isinstance(plain, Sum)
            return at_need(pilot, over, sets, self.threads, report) if looks else plain
        self._check(over(region))
        return adaptive(pilot, over, self._by_default, sets, self.threads, report)

    @property
    def _by_default(self) -> bool:
        return (self.method, self.sampler, self.order, self.debias) == ("auto",) * 4

    def _check(self, rule: Callable[[int], Estimate]) -> None:
        """Raise ValueError, before a pilot calls func, where what was named for the rule does not go together."""
        if isinstance(rule, Estimator) and not self._by_default:
            rule.check(self.n_points)

    def integrand(self, region: Region) -> Integrand:
        """The function on a region."""
        return Integrand(self.function, region, self.watch)

    def _over(self, region: Region, sets: int, method: str | None = None) -> Callable[[int], Estimate]:
        return estimator(
            self.integrand(region), self.n_points, method or self.method,
            self.sampler, self.order, self.debias, sets, self.rng, self.threads,
        )  # fmt: skip

    def _turned(self, region: Region, sets: int) -> Callable[[int], Estimate]:
        """The rule after a rotation: replicates are plain means unless another rule is named."""
        nothing_asked = (self.method, self.order, self.debias) == ("auto",) * 3
        return self._over(region, sets, "plain" if nothing_asked and sets > 1 else None)


def _budget(max_evaluations: int, n_estimates: int) -> int:
    most = positive_int("max_evaluations", max_evaluations)
    if most < n_estimates:
        raise ValueError(f"max_evaluations must be at least n_estimates = {n_estimates}, got {most}")
    return most
