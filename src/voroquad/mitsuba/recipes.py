"""How the plug-in ``reweighted`` makes its tables of sample sets, by its properties."""

from __future__ import annotations

from dataclasses import dataclass

import mitsuba as mi

from .._support.checks import one_of, positive_int
from ..designs.design import DESIGNS, design_of
from ..designs.sampling import SetKind
from ..rules.method import read_order
from ..rules.registry import DEBIAS, find_rule, has_rule
from ..sample_tables import Recipe, SampleTable
from .domains import Domain
from .properties import read_property

#: Name of the design of sets without a table: those that the scene's sampler draws
SCENE = "scene"
#: Most samples of a table, about, and most sets
TABLE_SIZE, MOST_SETS = 2**18, 2**10
#: Fewest sets: each half of a checkerboard of pixels has sets of its own, and two of them to choose from
FEWEST_SETS = 4
#: A table has one set for this number of uses of a set in an image, so that making it takes little of the time to
#: render
USES = 4


@dataclass(frozen=True)
class TableSettings:
    """How to make tables, except for what depends on the image: size and number of their sets, and the seed.

    Attributes
    ----------
    design : str
        That the sets are drawn by, or `SCENE`.
    d : int
        Dimension.
    order, debias
        The rule of the weights, see `voroquad.weights`.
    periodic : bool
        Are the weights those of cells on a circle?
    weighted : bool
        Do the samples have weights?
    sets : int
        Number of sets; 0: by the image.
    seed : int or None
        Of the table; None: that of the image.
    """

    design: str
    d: int
    order: int
    debias: str
    periodic: bool
    weighted: bool
    sets: int
    seed: int | None

    def recipe(self, n: int, uses: int, seed: int) -> Recipe:
        """How to make the table of sets of n samples for an image of this seed that uses so many sets."""
        sets = self.sets or max(FEWEST_SETS, min(MOST_SETS, TABLE_SIZE // n, uses // USES))
        return Recipe(
            self.design, n, self.d, sets, self.order, self.debias, seed if self.seed is None else self.seed,
            periodic=self.periodic, weighted=self.weighted,
        )  # fmt: skip


def read_settings(props: mi.Properties, domain: Domain, *, weighted: bool) -> TableSettings:
    """The settings that the properties ``sampler``, ``order``, ``debias``, ``sets`` and ``table_seed`` tell.

    Raises
    ------
    ValueError
        Unknown names, numbers out of range, a rule that does not exist for the design and the domain.
    """
    design = one_of("sampler", read_property(props, "sampler", "stratified"), (*DESIGNS, SCENE))
    debias = one_of("debias", read_property(props, "debias", "auto"), DEBIAS)
    order = read_property(props, "order", default_order(design, domain.dimension, debias))
    seed = read_property(props, "table_seed", 0) if "table_seed" in props else None
    read_order(order, names=())
    if seed is not None and seed < 0:
        raise ValueError(f"table_seed must be at least 0, got {seed}")
    if design != SCENE:
        DESIGNS[design].check_dimension(domain.dimension)
    periodic = domain.periodic and order == 0 and debias in ("none", "auto")
    if periodic:
        debias = "none"  # cells on a circle have no border, and no bias
    elif weighted:
        debias = _rule(design, domain.dimension, order, debias)
    return TableSettings(design, domain.dimension, order, debias, periodic, weighted, count(props, "sets"), seed)


def default_order(design: str, d: int, debias: str) -> int:
    """The order of the weights where none is named: the lowest that has an exactly unbiased rule.

    Order 0 gains most where the integrand has edges, as images have. Its unbiased rules need the bias function, which
    is known in closed form for d = 1, to 10⁻⁵ for d = 2, and less well and at a price above; order 1 needs none. The
    points of other designs than uniform and stratified depend on each other: see `voroquad.weights`.
    """
    known = design_of(design)
    if debias not in ("auto", "leave-one-out") or not known.stratified:
        return 0
    return 0 if known.independent and d <= 2 else 1


def _rule(design: str, d: int, order: int, debias: str) -> str:
    """The ``debias`` that "auto" stands for; ValueError if no rule has this order and ``debias``.

    Whether a rule exists does not depend on n: so it is said before anything is rendered.
    """
    if design == SCENE:
        if (order, debias) == (0, "none"):
            return debias
        raise ValueError(
            f"no unbiased weights are known for sampler='scene', got order={order}, debias={debias!r}; take "
            "order=0 with debias='none' (cells, which are biased at borders), weighted=false, or a design such as "
            "'stratified'"
        )
    kind, methods = SetKind(design, 1, d), read_order(order)
    if debias == "auto" and not has_rule(kind, methods, debias):
        raise ValueError(
            f"no unbiased weights are known for single sets of sampler={design!r} with order={order}; take "
            "debias='none' with order=0 (cells, which are biased at borders), weighted=false, or sampler='stratified'"
        )
    return find_rule(kind, methods, debias).debias


def table_file(props: mi.Properties, domain: Domain) -> SampleTable | None:
    """The table of the property ``table``, or None without it."""
    if "table" not in props:
        return None
    settled = [key for key in ("sampler", "order", "debias", "samples", "sets", "table_seed") if key in props]
    if settled:
        raise ValueError(f"table={props['table']!r} determines {', '.join(settled)}; leave them out")
    if not props["table"]:
        raise ValueError("table names no file; give one that 'voroquad table' made, or leave it out")
    try:
        table = SampleTable.load(props["table"])
    except FileNotFoundError:
        raise ValueError(f"there is no table={props['table']!r}; make it with 'voroquad table'") from None
    if table.d != domain.dimension:
        raise ValueError(
            f"table={props['table']!r} has d = {table.d}, but domain {domain.name!r} has d = {domain.dimension}"
        )
    return table


def count(props: mi.Properties, name: str) -> int:
    """A property that is a number of things; 0 asks for an automatic choice."""
    return positive_int(name, number) if (number := read_property(props, name, 0)) else 0


def names(name: str, text: str, known: tuple[str, ...]) -> list[str]:
    """The names of a property that lists some, separated by commas."""
    return [one_of(name, part.strip(), known) for part in text.split(",") if part.strip()]
