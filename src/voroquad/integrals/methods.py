"""The argument `method` of :func:`voroquad.quad`: the rule that it names, and the arguments that may accompany it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .._support.checks import one_of
from ..designs.engines import EngineFactory
from ..rules.method import HIGHEST_DIMENSION, KRIGING, ORDER_ZERO, Method, highest_order, local, read_order
from . import pilot, replicates
from .adaptation import MOST_OF_LOOK, Adaptation, AdaptiveEstimator, Learner, look_size
from .adaptive_grid import AdaptiveGrid, GridAtNeed
from .estimates import Estimate, Estimator
from .integrand import Integrand
from .leaves import LeafEstimator
from .nets import NetEstimator
from .partition import Partition
from .regions import Region
from .spread import across

#: "auto" is the rule that order, sampler and debias name; if none is named, the default.
METHODS = ("auto", "kriging", "local", "pilot", "plain", "polynomials")

#: Methods that draw their own points: the highest dimension and the fewest evaluations.
OWN_POINTS = {
    "pilot": (pilot.HIGHEST_DIMENSION, pilot.FEWEST),
    "polynomials": (replicates.HIGHEST_DIMENSION, replicates.FEWEST),
}

#: Points of an estimate from which the default is the pilot rule, in up to three dimensions, or polynomials fitted to
#: replicates, above, by dimension: benchmarks/results/methods.csv. In the plane the values choose a model of up to
#: 2048 points, and the pilot rule is ahead of kriging and of local polynomials from there on. In three, kriging is
#: ahead on four of the eight families with 2048 points, on two with 4096 and on one with 8192. In six it still has a
#: little less error with 16384 points than polynomials, but costs far more.
MANY_POINTS = {1: 2049, 2: 2049, 3: 8000, 4: 8192} | dict.fromkeys(range(5, replicates.HIGHEST_DIMENSION + 1), 16_384)

#: Points of an estimate from which ``adapt="auto"`` takes a first look at the integrand, by dimension, where the
#: default is not the pilot rule: of fewer a look costs smooth functions too much, or a pilot sees too little
#: (benchmarks/smooth_cost.py).
LOOKS_FROM = {3: 3000, 4: 1000, 5: 2000, 6: 2000, 7: 4000, 8: 4000} | dict.fromkeys(range(9, 21), 8000)

#: Fewest samples of a look.
FEWEST_OF_LOOK = 32

#: What "local" takes where no order is asked for, by dimension, else cubics; on a line it is left to the points.
LOCAL_METHODS: dict[int, tuple[Method, ...]] = {1: (), 2: (local(8),)}


def estimator(
    integrand: Integrand,
    n_points: int,
    method: str,
    sampler: str | EngineFactory,
    order: int | str,
    debias: str,
    sets: int,
    rng: np.random.Generator,
    threads: int,
) -> Callable[[int], Estimate]:
    """What makes estimates from at most so many evaluations, by the method.

    Raises ValueError where the method does not exist, in the integrand's dimension, with so few points, or with that
    sampler, order or debias.
    """
    one_of("method", method, METHODS)
    read_order(order, integrand.d)
    if method in OWN_POINTS:
        _check_own_points(method, integrand.d, n_points, sampler, order, debias)
        if method == "pilot":
            return pilot.PilotEstimator(integrand, sets, rng, threads)
        return replicates.ReplicateEstimator(integrand, sets, rng, threads)
    nothing_asked = method == order == debias == "auto" and isinstance(sampler, str) and sampler == "auto"
    if sampler == "auto":
        sampler = "multi-jittered" if integrand.d <= 4 else "sobol"
    few = Estimator(integrand, sampler, _methods(method, order, integrand.d), debias, sets, rng, threads)
    if not nothing_asked or integrand.d not in MANY_POINTS:
        return few
    of_many = pilot.PilotEstimator if integrand.d <= pilot.HIGHEST_DIMENSION else replicates.ReplicateEstimator
    return Default(few, of_many(integrand, sets, rng, threads), MANY_POINTS[integrand.d])


@dataclass(frozen=True)
class Default:
    """The rule for few points, and that for `many_points` and more."""

    few: Callable[[int], Estimate]
    many: Callable[[int], Estimate]
    many_points: int

    def __call__(self, n: int) -> Estimate:
        """An estimate from at most n evaluations."""
        return self.many(n) if n >= self.many_points else self.few(n)


def adaptive(
    learner: Learner,
    plain: Callable[[Region], Callable[[int], Estimate]],
    by_default: bool,
    sets: int,
    threads: int,
    report: Callable[[Adaptation], None],
) -> Callable[[int], Estimate]:
    """What adapts to the integrand and makes estimates from at most so many evaluations for each set.

    `plain` makes estimates of a region without adaptation. Behind a map it does so only where a rule was asked for;
    there the defaults are others.
    """

    def final(region: Region, partition: Partition) -> Callable[[int], Estimate]:
        if not by_default or region is learner.region:
            return plain(region)
        integrand = learner.integrand(region)
        if len(partition) == 1:
            return NetEstimator(integrand, sets, learner.rng)
        leaves = LeafEstimator(integrand, partition, learner.rng, threads)
        return lambda n: across([leaves(n) for _ in range(sets)])

    d = learner.region.d
    rounds = AdaptiveEstimator(learner, plain(learner.region), final, lambda n: _look(n, d), sets, report)
    if not by_default or d > pilot.HIGHEST_DIMENSION:
        return rounds
    return AdaptiveGrid(learner, sets, threads, report)


def at_need(
    learner: Learner,
    plain: Callable[[Region], Callable[[int], Estimate]],
    sets: int,
    threads: int,
    report: Callable[[Adaptation], None],
) -> Callable[[int], Estimate]:
    """What adapts to the integrand where a first look calls for it, and is the default elsewhere.

    With several sets it looks only where that costs nothing, at the grid of the pilot rule: a set of Sobol' points or
    of a grid of strata may be far worse if it has a few points less.
    """
    d = learner.region.d
    default = plain(learner.region)
    adapted = adaptive(learner, plain, True, sets, threads, report)

    def estimate(n: int) -> Estimate:
        if isinstance(adapted, AdaptiveGrid) and n >= MANY_POINTS[d]:
            return adapted(n, with_gradients=default.few if isinstance(default, Default) else None)
        if sets > 1 or n < LOOKS_FROM.get(d, math.inf) or _look(n, d) < FEWEST_OF_LOOK:
            return default(n)
        return GridAtNeed(adapted, default)(n) if isinstance(adapted, AdaptiveGrid) else adapted(n)

    return estimate


def _look(n: int, d: int) -> int:
    """Samples of a first look: of many in four dimensions and more, none that replicates would miss.

    Examples
    --------
    >>> from voroquad.integrals.methods import _look
    >>> _look(16_384, 6), _look(16_500, 6), _look(20_000, 6)
    (0, 116, 256)
    >>> _look(8192, 4), _look(9000, 4)
    (0, 256)
    """
    if d <= pilot.HIGHEST_DIMENSION:
        return n
    look = look_size(n, d)
    many = MANY_POINTS.get(d, math.inf)
    if n < many:
        return look
    sizes = replicates.Sizes.of(n, d)
    look = int(min(look, MOST_OF_LOOK, n - sizes.whole, n - many))
    return look if replicates.Sizes.of(n - look, d) == sizes else 0


def _check_own_points(
    method: str, d: int, n_points: int, sampler: str | EngineFactory, order: int | str, debias: str
) -> None:
    highest, fewest = OWN_POINTS[method]
    if d > highest:
        raise ValueError(
            f"method={method!r} integrates in d = 1 to {highest} dimensions, got d = {d}; leave method out"
        )
    for name, value in (("sampler", sampler), ("order", order), ("debias", debias)):
        if value != "auto":
            raise ValueError(
                f"{name}={value!r} does not go with method={method!r}, which has its own; leave {name} out"
            )
    if n_points < fewest:
        raise ValueError(f"n_points must be at least {fewest} for method={method!r}, got {n_points}")


def _methods(method: str, order: int | str, d: int) -> tuple[Method, ...]:
    """The reconstructions that `method` stands for; an order that is asked for as well must be one of them."""
    asked = read_order(order, d)
    if method == "auto":
        return asked
    if method == "local":
        if not highest_order(d):
            raise ValueError(f"method='local' integrates in d = 1 to {HIGHEST_DIMENSION} dimensions, got d = {d}")
        own = LOCAL_METHODS.get(d, (local(3),))
        fits = bool(asked) and asked[0].name == "local"
    else:
        own = (KRIGING,) if method == "kriging" else ORDER_ZERO
        fits = asked == own
    if asked and not fits:
        raise ValueError(f"order={order!r} does not go with method={method!r}; leave one of them out")
    return asked or own
