"""What a step along an axis adds to the error of replicates.

Of n points that are evenly spread along an axis, each n-th part of it holds one. A step of height J along the axis then
errs by J (1 − θ)/n or −J θ/n, by the side of it that the point next to it lies on, where θ is the part of its stratum
before it. All of a few replicates may err alike, and then their spread is that of other effects, or nothing:
docs/theory.md, section 5.
"""

from __future__ import annotations

import numpy as np

from .._support.arrays import Array

#: Fewest and most points of a replicate that tell steps: the first of a net are a net.
FEWEST, MOST = 16, 512

#: Fewest points of a block, and fewest blocks along an axis: in longer ones a smooth function looks like a step.
SHORTEST, FEWEST_BLOCKS = 4, 64

#: Highest power of a coordinate in the trend, and the points for a term that it has, with products of two or without.
DEGREE, POINTS_PER_TERM = 4, 6

#: How many times its squared standard error a squared step is at least.
CERTAIN = 25.0

#: Part of a squared contrast that half as long blocks have of a step at least; of a kink they have a quarter.
LEFT_OF_HALF = 0.7

#: The contrast of seven successive blocks that a step in the fourth changes by its height, and a line not at all.
CONTRAST = np.array([0.5, 0.0, -1.5, 0.0, 1.5, 0.0, -0.5])

#: The mean of θ (1 − θ), the variance of a step of height 1 within its stratum.
OF_STEP = 1 / 6


def of_steps(points: Array, values: Array, n: int | None = None) -> Array:
    """The variance of the mean over replicates that steps along the axes make: (fields,).

    It is that of the highest step along each axis. 0 where points are not evenly spread.

    Parameters
    ----------
    points : ndarray, (sets, m, d)
        Independent replicates, or the first points of each.
    values : ndarray, (sets, fields, m)
        Of integrands, or what predictions leave of them.
    n : int, optional
        Points of a whole replicate, m by default.

    Examples
    --------
    >>> import numpy as np, voroquad as vq
    >>> from voroquad.rules.steps import of_steps
    >>> x = vq.sample("sobol", 1024, 5, sets=4, rng=1).points
    >>> values = np.stack([2.0 * (x[..., 3] < 0.3), np.exp(x.sum(axis=-1))], axis=1)
    >>> np.sqrt(of_steps(x, values) * 6 * 4 * 1024**2).round(1)
    array([2., 0.])
    """
    sets, m, d = points.shape
    total, size = np.zeros(values.shape[1]), min(1 << m.bit_length() - 1, MOST)
    if size < FEWEST:
        return total
    flat = values[:, :, :size].swapaxes(0, 1).reshape(len(total), -1)
    flat = _without_trend(points[:, :size].reshape(-1, d), flat)
    parts = np.repeat(np.arange(size), sets)
    for a in range(d):
        along = points[:, :size, a].ravel()
        order = np.argsort(along, kind="stable")
        if (np.floor(size * along[order]) == parts).all():
            total += _highest(flat[:, order])
    return OF_STEP * total / (sets * (n or m) ** 2)


def _without_trend(points: Array, values: Array) -> Array:
    """What a polynomial fitted to values (fields, n) at points (n, d) leaves of them: it hides steps, but has none."""
    n, d = points.shape
    room = n // POINTS_PER_TERM - 1  # the constant is one
    t = 2 * points.T - 1
    terms = [np.ones((1, n)), *(t**k for k in range(1, min(DEGREE, room // d) + 1))]
    if DEGREE * d + d * (d - 1) // 2 <= room:
        i, j = np.tril_indices(d, -1)
        terms.append(t[i] * t[j])
    basis, _ = np.linalg.qr(np.concatenate(terms).T)
    left: Array = values - (values @ basis) @ basis.T
    return left


def _highest(values: Array) -> Array:
    """The square of the highest step that is certain: (fields,), of values (fields, n) along an axis.

    The contrast of blocks half as long is that of a step again, and far less of what is smooth or has a kink.
    """
    highest, length = np.zeros(len(values)), SHORTEST
    _, half = _contrasts(values, length // 2)
    while length * FEWEST_BLOCKS <= values.shape[1]:
        blocks, squares = _contrasts(values, length)
        variances = blocks.var(axis=2, ddof=1)
        of_all = variances.mean(axis=1, keepdims=True) * np.square(CONTRAST).sum()  # few may be alike by chance
        noise = _weighted(variances, np.square(CONTRAST)) + of_all
        certain = (squares > CERTAIN / length * noise) & (squares * LEFT_OF_HALF < half.max(axis=1, keepdims=True))
        highest = np.maximum(highest, np.where(certain, squares, 0.0).max(axis=1))
        length, half = 2 * length, squares
    return highest


def _contrasts(values: Array, length: int) -> tuple[Array, Array]:
    """Blocks (fields, blocks, length) of values (fields, n), and their squared contrasts."""
    blocks = values[:, : values.shape[1] // length * length].reshape(len(values), -1, length)
    return blocks, np.square(_weighted(blocks.mean(axis=2), CONTRAST))


def _weighted(rows: Array, weights: Array) -> Array:
    """Σ_k w_k r_(i+k) of rows (fields, m): (fields, m − k + 1)."""
    m = rows.shape[1] - len(weights) + 1
    found: Array = np.sum([w * rows[:, k : k + m] for k, w in enumerate(weights.tolist()) if w], axis=0)
    return found
