"""Rules on a line: for each stratum a polynomial, whose order is chosen by how well fits predict the stratum's
neighbours.

For stratum i, a polynomial of each order is fitted to the samples of a block of strata around it without x_i. How well
it predicts each of its nearest neighbours when that one is left out, too, needs no other fit: it is the residual over
one minus the leverage. The order of least squared error predicts stratum i, and x_i corrects the prediction. Neither
choice nor prediction depends on x_i, so the estimate is unbiased: docs/theory.md, (10) and (30).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .._support.arrays import Array, Indices
from .polynomials import legendre, legendre_means

#: The half-width of the block by order. Tighter fits have rare, huge weights.
HALF_WIDTHS = {0: 1, 1: 2, 2: 4, 4: 6, 6: 9, 8: 14}

#: Fewest strata: with fewer there is nothing to choose from.
FEWEST = 5

#: Neighbours on either side that judge a fit.
JUDGES = 4

#: Factor of the squared error of the highest order, which is the best on smooth integrands even if another one has less
#: error by chance.
OF_HIGHEST = 0.25

#: The order whose residuals tell how much the chosen ones have adapted.
REFERENCE = 4

#: Strata that are fitted together.
TOGETHER = 4096

#: Strata, at most, whose blocks are remembered from one set to the next.
MOST_KNOWN = 4096


@dataclass(frozen=True)
class LineChoice:
    """An estimate by polynomials of chosen orders, for each set, field and stratum."""

    weights: Array  # (sets, fields, n)
    residuals: Array  # (sets, fields, n), f_i − P_i(x_i)
    orders: Indices  # (sets, fields, n)
    around: (
        Array  # (sets, fields, n, 3), f_j − P_i(x_j) at j = c − 1, c, c + 1 with c = i or the inner stratum next to it
    )
    reference: Array  # (sets, fields, n), the residuals of order REFERENCE or the highest below


@dataclass(frozen=True)
class _Fit:
    """Polynomials of one order for some strata, (m,), of one set."""

    scores: Array  # (fields, m)
    residuals: Array  # (fields, m)
    around: Array  # (fields, m, 3)
    block: Indices  # (m, others), the samples that are fitted
    response: Array  # (m, others), what they count in ∫ P_i − P_i(x_i), in units of the stratum


def choose_on_line(points: Array, values: Array) -> LineChoice:
    """Leave-one-out on the line, by an order for each stratum and field.

    Parameters
    ----------
    points : ndarray, (sets, n)
        One sample in each of n ≥ :data:`FEWEST` equal strata of [0, 1), in their order.
    values : ndarray, (sets, fields, n)
        Of integrands, at the samples.
    """
    sets, fields, n = values.shape
    orders = [p for p, m in HALF_WIDTHS.items() if 2 * m + 1 <= n]
    reference = max(p for p in orders if p <= REFERENCE)
    found = LineChoice(
        np.ones(values.shape), np.empty(values.shape), np.empty(values.shape, dtype=np.intp),
        np.empty((*values.shape, 3)), np.empty(values.shape),
    )  # fmt: skip
    for s in range(sets):
        for strata in _batches(n):
            fits = [_fit(p, points[s], values[s], strata) for p in orders]
            scores = np.stack([fit.scores for fit in fits])
            scores[-1] *= OF_HIGHEST
            best = np.argmin(np.where(np.isnan(scores), np.inf, scores), axis=0)
            found.orders[s][:, strata] = np.array(orders)[best]
            found.reference[s][:, strata] = fits[orders.index(reference)].residuals
            for k, fit in enumerate(fits):
                taken = best == k
                found.residuals[s][:, strata][taken] = fit.residuals[taken]
                found.around[s][:, strata][taken] = fit.around[taken]
                for i in range(fields):
                    np.add.at(found.weights[s, i], fit.block[taken[i]], fit.response[taken[i]])
    np.divide(found.weights, n, out=found.weights)
    return found


def _batches(n: int) -> Iterator[slice]:
    """Strata, so many at a time that their fits take little memory."""
    return (slice(first, min(first + TOGETHER, n)) for first in range(0, n, TOGETHER))


@dataclass(frozen=True)
class _Blocks:
    """The blocks of some strata i (m,) of n, for an order: what does not depend on where samples lie in them.

    Attributes
    ----------
    first : ndarray, (m, 1)
        The first stratum of each block.
    half : int
        Its half-width.
    block : ndarray, (m, others)
        All strata of the block but i.
    judges : ndarray, (m, others)
        Which of them judge a fit.
    means : ndarray, (m, terms, 1)
        Means of the polynomials over the strata.
    at : ndarray, (m, 3)
        Where the strata nearest to i are among those of the block, followed by i.
    """

    n: int
    first: Indices
    half: int
    block: Indices
    judges: NDArray[np.bool_]
    means: Array
    at: Indices

    @classmethod
    def of(cls, order: int, n: int, start: int, stop: int) -> _Blocks:
        """Those of strata from start to stop; those of few strata are remembered."""
        return _known_blocks(order, n, start, stop) if n <= MOST_KNOWN else cls.found(order, n, start, stop)

    @classmethod
    def found(cls, order: int, n: int, start: int, stop: int) -> _Blocks:
        """The same."""
        m, i = HALF_WIDTHS[order], np.arange(start, stop)
        first = np.clip(i - m, 0, n - 2 * m - 1)
        block = first[:, None] + np.arange(2 * m)
        block += block >= i[:, None]
        low, high = (_place(n * (end[:, None] / n), first[:, None], m) for end in (i, i + 1))
        centre = np.clip(i, 1, n - 2)[:, None] + np.arange(-1, 2)
        at = (np.concatenate([block, i[:, None]], axis=-1)[:, :, None] == centre[:, None, :]).argmax(axis=1)
        means = legendre_means(low[:, 0], high[:, 0], order)[..., None]
        return cls(n, first[:, None], m, block, abs(block - i[:, None]) <= JUDGES, means, at)

    def place(self, x: Array) -> Array:
        """Coordinates on the blocks, from −1 to 1, of x (m, ...) in the unit interval."""
        return _place(self.n * x, self.first, self.half)


def _place(t: Array, first: Indices, half: int) -> Array:
    return (t - first - half - 0.5) / (half + 0.5)


@lru_cache(maxsize=24)
def _known_blocks(order: int, n: int, start: int, stop: int) -> _Blocks:
    return _Blocks.found(order, n, start, stop)


def _fit(order: int, points: Array, values: Array, strata: slice) -> _Fit:
    """Fit polynomials of an order for some strata of one set: points (n,), values (fields, n)."""
    n, i = len(points), np.arange(strata.start, strata.stop)
    blocks = _Blocks.of(order, n, strata.start, strata.stop)
    place, block, at = blocks.place, blocks.block, blocks.at
    q, r = np.linalg.qr(legendre(place(points[block]), order))
    f = values[:, block]
    coefficients = np.einsum("imt,fim->fit", q, f)
    own = np.linalg.solve(r.mT, legendre(place(points[i, None]), order).mT)[..., 0]
    mean = np.linalg.solve(r.mT, blocks.means)[..., 0]
    missed = f - np.einsum("imt,fit->fim", q, coefficients)
    residuals = values[:, i] - np.einsum("it,fit->fi", own, coefficients)
    left_out = missed / (1 - np.square(q).sum(axis=-1))
    scores = (np.square(left_out) * blocks.judges).sum(axis=-1) / blocks.judges.sum(axis=-1)
    whole = np.concatenate([missed, residuals[..., None]], axis=-1)
    around = np.take_along_axis(whole, np.broadcast_to(at, (len(values), *at.shape)), axis=-1)
    return _Fit(scores, residuals, around, block, np.einsum("it,imt->im", mean - own, q))
