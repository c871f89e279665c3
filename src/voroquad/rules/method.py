"""Methods by which a rule reconstructs an integrand from its samples, and the meaning of ``order=``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Method:
    """A way to reconstruct an integrand from its values at samples.

    Attributes
    ----------
    name : {"voronoi", "local", "kriging", "mean", "choice"}
        The value of the nearest sample; polynomials fitted to the samples around a place; the best prediction of a
        random function; a constant; what the integrand chooses.
    degree : int or None
        Total degree of the polynomials that it reconstructs exactly; None where that grows with the samples.
    """

    name: str
    degree: int | None

    @property
    def order(self) -> int | str:
        """The ``order`` that names it in :func:`voroquad.weights`."""
        return self.name if self.degree is None else self.degree

    def __str__(self) -> str:
        return f"order {self.degree}" if self.name == "local" else self.name


VORONOI = Method("voronoi", 0)
KRIGING = Method("kriging", None)
MEAN = Method("mean", 0)
CHOICE = Method("choice", None)


def local(degree: int) -> Method:
    """Polynomials of a total degree, each fitted to the samples around a place."""
    return Method("local", degree)


#: Dimensions, and the highest degree of local polynomials in them: above three a fit needs too many samples.
LOCAL_DEGREES = ((range(1, 4), 8), (range(4, 9), 3))

#: Highest dimension of local polynomials.
HIGHEST_DIMENSION = LOCAL_DEGREES[-1][0][-1]

#: Highest order of any rule.
MAX_ORDER = max(highest for _, highest in LOCAL_DEGREES)

#: Orders that are names, not numbers.
ORDER_NAMES = ("kriging", "auto")

#: The methods of order 0, in order of preference.
ORDER_ZERO = (VORONOI, local(0))


def highest_order(d: int) -> int:
    """Highest numbered order of a rule in d dimensions."""
    return next((highest for dimensions, highest in LOCAL_DEGREES if d in dimensions), 0)


def read_order(order: Any, d: int | None = None, names: tuple[str, ...] = ORDER_NAMES) -> tuple[Method, ...]:
    """The methods that ``order=`` names, in order of preference; none for "auto".

    Parameters
    ----------
    order : int or str
        As a caller gave it.
    d : int, optional
        Dimension, which limits the order. By default the limit is that of all dimensions.
    names : tuple of str
        Names that are allowed beside numbers.

    Raises
    ------
    ValueError
        It is no order of any rule in d dimensions.

    Examples
    --------
    >>> from voroquad.rules.method import read_order
    >>> read_order(3)
    (Method(name='local', degree=3),)
    >>> read_order("auto")
    ()
    """
    highest = MAX_ORDER if d is None else highest_order(d)
    if isinstance(order, str) and order in names:
        return (KRIGING,) if order == KRIGING.name else ()
    if not isinstance(order, int | np.integer) or isinstance(order, bool) or not 0 <= order <= highest:
        numbers = f"a whole number from 0 to {highest}" if highest else "0"
        where = "" if d is None else f" for d = {d}"
        *first, last = (numbers + where, *map(repr, names))
        choices = f"{', '.join(first)} or {last}" if first else last
        raise ValueError(f"order must be {choices}, got {order!r}")
    return ORDER_ZERO if order == 0 else (local(int(order)),)
