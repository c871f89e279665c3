"""What `method` of :func:`voroquad.quad` names, and what goes with it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .._support.checks import one_of
from ..designs.engines import EngineFactory
from ..rules.strata_fits import HIGHEST_ORDER, check_order
from . import pilot
from .estimates import Estimate, Estimator
from .integrand import Integrand

#: "auto" is the rule that order, sampler and debias name.
METHODS = ("auto", "kriging", "local", "pilot", "plain")

#: The order that "local" takes where none is asked for, by dimension; on a line it grows with the number of points.
LOCAL_ORDERS: dict[int, int | str] = {1: "auto", 2: 8}


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
    check_order(order, integrand.d)
    if method == "pilot":
        _check_pilot(integrand.d, n_points, sampler, order, debias)
        return pilot.PilotEstimator(integrand, sets, rng, threads)
    if sampler == "auto":
        sampler = "multi-jittered" if integrand.d <= 4 else "sobol"
    order = _order(method, order, integrand.d)
    return Estimator(integrand, sampler, order, debias, sets, rng, threads)


def _check_pilot(d: int, n_points: int, sampler: str | EngineFactory, order: int | str, debias: str) -> None:
    if d > pilot.HIGHEST_DIMENSION:
        raise ValueError(
            f"method='pilot' integrates in d = 1 to {pilot.HIGHEST_DIMENSION} dimensions, got d = {d}; leave method out"
        )
    for name, value in (("sampler", sampler), ("order", order), ("debias", debias)):
        if value != "auto":
            raise ValueError(f"{name}={value!r} does not go with method='pilot', which has its own; leave {name} out")
    if n_points < pilot.FEWEST:
        raise ValueError(f"n_points must be at least {pilot.FEWEST} for method='pilot', got {n_points}")


def _order(method: str, order: int | str, d: int) -> int | str:
    """The order that a method stands for; one that is asked for as well must be of that method."""
    if method == "auto":
        return order
    own: int | str
    if method == "local":
        own = LOCAL_ORDERS.get(d, HIGHEST_ORDER.get(d, 0) and 3)
        if own == 0:
            raise ValueError(f"method='local' integrates in d = 1 to {max(HIGHEST_ORDER)} dimensions, got d = {d}")
        fits = isinstance(order, int) and order > 0
    else:
        own = "kriging" if method == "kriging" else 0
        fits = order == own
    if order != "auto" and not fits:
        raise ValueError(f"order={order!r} does not go with method={method!r}; leave one of them out")
    return own if order == "auto" else order
