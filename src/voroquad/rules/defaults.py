"""The methods that ``order="auto"`` stands for. They depend on the kind of the sets, never on the integrand."""

from __future__ import annotations

from ..designs.design import design_of
from ..designs.grids import grid_shape
from ..designs.sampling import SetKind
from .kriging_rules import MOST
from .method import KRIGING, ORDER_ZERO, Method, local, read_order

#: Default degree on a line and in the plane: the first entry whose least number of strata along an axis is
#: reached. All else is left to kriging.
DEFAULT_DEGREES = {
    1: ((96, 8), (48, 6), (16, 4), (8, 2), (4, 1), (1, 0)),
    2: ((34, 8),),
}


def default_of_strata(strata: tuple[int, ...]) -> Method:
    """The method for one sample in each stratum of a grid.

    It depends on the dimension and on the least number of strata along an axis (:data:`DEFAULT_DEGREES`).

    Examples
    --------
    >>> from voroquad.rules.defaults import default_of_strata
    >>> default_of_strata((40, 40)).order, default_of_strata((32, 32)).order
    (8, 'kriging')
    """
    for least, degree in DEFAULT_DEGREES.get(len(strata), ()):
        if min(strata) >= least:
            return local(degree)
    return KRIGING


def default_methods(kind: SetKind, debias: str) -> tuple[Method, ...]:
    """The methods that ``order="auto"`` means for sets of a kind, the preferred one first.

    Independent samples on a line leave gaps far wider than the mean spacing, across which predictions are poor. So the
    default is order 0 for d = 1, and kriging above.
    """
    design = design_of(kind.design)
    if debias in ("auto", "leave-one-out") and design.gridded:
        return read_order(default_of_strata(grid_shape(kind.n, kind.d)).order) if design.stratified else ORDER_ZERO
    if debias in ("auto", "leave-one-out") and kind.design == "uniform" and kind.d > 1 and kind.n <= MOST:
        return (KRIGING,)
    if debias in ("auto", "cross-fit") and design.randomised and kind.sets > 1:
        return (KRIGING,)
    return ORDER_ZERO
