"""The rules to choose from: those that exist for a sampler and a dimension."""

from __future__ import annotations

from .._support.arrays import Array
from ..designs.design import DESIGNS
from ..designs.sampling import SetKind
from ..rules.registry import RULES
from ..study.convergence import Scheme
from .edits import EditedSet

#: Choice of weights that no rule makes: 1/N each.
EQUAL = "equal"

#: Every choice of weights, by the name that ``voroquad.weights`` knows it by.
WEIGHTS = {
    EQUAL: "equal weights 1/N",
    "none": "Voronoi cells",
    "bias-function": "Voronoi cells ÷ G",
    "exchange": "exchange",
    "leave-one-out": "leave-one-out",
}

#: Highest order for sets without strata: above, weights of a thousand samples take seconds, too long for a drag
HIGHEST_ORDER = 3

_TITLES = {"regular": "regular grid", "sobol": "Sobol'", "halton": "Halton", "zero-two": "(0,2)-sequence"}
#: Every sampler, by its name in ``voroquad.sample``, with the name to show.
SAMPLERS = {design: _TITLES.get(design, design) for design in DESIGNS}


def offered(design: str, d: int) -> dict[str, list[int]]:
    """The weights that a set of that design can have, each with those of its orders that are fast enough for a drag."""
    kind = SetKind(design, 1, d)
    orders = {
        weights: sorted(
            {
                method.degree
                for rules in RULES
                if rules.debias == weights
                for method in rules.methods
                if method.degree is not None
                and (DESIGNS[design].gridded or method.degree <= HIGHEST_ORDER)
                and rules.covers(kind, method)
            }
        )
        for weights in WEIGHTS
    }
    return {EQUAL: [0]} | {weights: found for weights, found in orders.items() if found}


def method(design: str, weights: str, order: int) -> Scheme:
    """A choice as a method of the study."""
    name = f"{SAMPLERS[design]}, {WEIGHTS[weights]}" + (f", order {order}" if order else "")
    return Scheme(name, design, None if weights == EQUAL else weights, order)


def needs_design(chosen: Scheme) -> bool:
    """Whether the weights are made for points of one design only."""
    return any(rules.designs is not None for rules in RULES if rules.debias == chosen.debias)


def weigh(chosen: Scheme, edited: EditedSet) -> Array:
    """Weights (n,) of the points as they are now.

    Raises
    ------
    ValueError
        The points are no longer such as the rule needs.
    """
    samples = edited.samples(chosen.design if needs_design(chosen) else None)
    return chosen.weights(samples)
