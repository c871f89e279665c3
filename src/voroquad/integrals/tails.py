"""Whether the largest values of an integrand leave its integral or its variance finite."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from .._support.arrays import Array
from .diagnostics import IntegrationWarning, diagnosis

#: Tail index from which on an estimate is not reliable: its error falls as n^(index − 1), no faster than n^−0.2.
HEAVY = 0.8

#: The largest values that the index is estimated from: √n, and at least this number.
FEWEST_LARGEST = 10

#: Least ratio of the index from the upper quarter of these to that from all. Tails of peaks get lighter: for a Gaussian
#: the ratio is 4^(−2/d), up to 0.63 in six dimensions.
STEADY = 2 / 3

#: Fewest samples for such a warning.
FEWEST_VALUES = 64

#: Largest (Σ|f|)² / (n Σf²) for which the tail is looked at; one as heavy as HEAVY leaves less.
MOST_EVEN = 0.25


def heavy_tail(components: Mapping[int, Sequence[Array]]) -> IntegrationWarning | None:
    """A warning if components have heavy tails, from their values at samples of equal probability.

    Parameters
    ----------
    components : mapping of int to sequence of ndarray
        The values of components, by their numbers, in parts of any lengths, and in units in which no square over- or
        underflows.
    """
    indices = {f: tail_index(largest_sizes(parts)) for f, parts in components.items() if _uneven(parts)}
    heavy = [field for field, index in indices.items() if index > HEAVY]
    if not heavy:
        return None
    return diagnosis("heavy-tail", tail_index=round(max(indices.values()), 2), components=heavy)


def _uneven(parts: Sequence[Array]) -> bool:
    """Whether a few values are far larger than the others; it costs much less than to sort them."""
    n = sum(map(len, parts))
    total, square = (sum(float(f(v).sum()) for v in parts) for f in (np.abs, np.square))
    return n >= FEWEST_VALUES and total**2 < MOST_EVEN * n * square < math.inf


def largest_sizes(parts: Sequence[Array]) -> Array:
    """The m + 1 largest absolute values of n in ascending order, m being √n or FEWEST_LARGEST."""
    most = 1 + max(FEWEST_LARGEST, math.isqrt(sum(map(len, parts))))
    largest = np.empty(0)
    for values in parts:
        largest = np.concatenate([largest, np.abs(values)])
        largest = np.partition(largest, max(0, len(largest) - most))[-most:]
    return np.sort(largest)


def tail_index(largest: Array) -> float:
    r"""The index k of the tail P(\|f\| > t) ~ t^(−1/k), from the largest values in ascending order.

    A singularity \|x − c\|^(−p) in d dimensions has k = p/d. The variance is infinite from k = ½ on, and the integral
    from k = 1 on. The index is the least of three estimates, all of which must agree that a tail is heavy: Hill's
    (1975) from all values and from the upper quarter of them, and the moment estimator of Dekkers, Einmahl and de Haan
    (1989), which is negative for a bounded peak that the samples resolve. If the tail gets lighter towards its end, as
    that of a peak does which few samples meet, it has no index, and −inf is returned.

    Examples
    --------
    >>> import numpy as np
    >>> from voroquad.integrals.tails import tail_index
    >>> x = (np.arange(64) + 0.5) / 4096
    >>> [round(tail_index(np.sort(f)), 2) for f in (1 / x, x**-0.5, np.exp(-1e4 * x**2))]
    [0.97, 0.47, -inf]
    """
    if largest[0] <= 0:
        return -math.inf
    m = len(largest) - 1
    logs = np.log(largest[1:]) - math.log(largest[0])  # ratios may overflow
    hill, second = float(logs.mean()), float(np.square(logs).mean())
    if hill**2 >= second:  # all are alike
        return -math.inf
    moment = hill + 1 - 0.5 / (1 - hill**2 / second)
    quarter = max(4, m // 4)
    of_quarter = float((logs[-quarter:] - logs[-quarter - 1]).mean())
    return min(hill, moment, of_quarter) if of_quarter >= STEADY * hill else -math.inf
