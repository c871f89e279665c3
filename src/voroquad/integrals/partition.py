"""Boxes that tile the unit box, small where an integrand varies: a k-d tree grown on samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._support.arrays import Array, Indices

#: A split is kept if it leaves at most this part of Σ V σ of the boxes that it splits.
KEPT = 0.75

#: A tree is kept if it leaves less than this part of σ: nets of the whole box gain as much without one.
WORTH = 0.4

#: Most halvings of a box.
DEPTH = 14

#: Samples that a box has on either side of a split at least: this many, or twice the dimension.
FEWEST = 6

#: Samples of the box that a leaf was cut from, by which its own deviation is blended with that of the box: few samples
#: that are all alike may have missed something.
OF_PARENT = 2.0

#: Axes are preferred in order, where nothing else decides, by this part of the score.
TIE = 1e-3

#: The power of V σ by which boxes get samples. Within a box the error of m samples falls about as m^−1.
POWER = 2 / 3


@dataclass(frozen=True)
class Partition:
    """A k-d tree of boxes of the unit box, each halved along one axis; those that are not are the leaves.

    Attributes
    ----------
    axis : ndarray, (nodes,)
        Along which a node is halved; −1 for leaves.
    child : ndarray, (nodes,)
        The node of the lower half, before that of the upper; of leaves their number.
    low, high : ndarray, (leaves, d)
        Corners of the leaves.
    deviation : ndarray, (leaves,)
        Standard deviation of the integrand in each, several components combined.
    """

    axis: Indices
    child: Indices
    low: Array
    high: Array
    deviation: Array

    @classmethod
    def whole(cls, d: int) -> Partition:
        """The unit box itself."""
        return cls(np.array([-1]), np.array([0]), np.zeros((1, d)), np.ones((1, d)), np.ones(1))

    def __len__(self) -> int:
        return len(self.low)

    @property
    def volumes(self) -> Array:
        """Of the leaves, (leaves,)."""
        return np.prod(self.high - self.low, axis=1)

    def leaf_of(self, y: Array) -> Indices:
        """The leaf (n,) of each point (d, n)."""
        node, t, points = np.zeros(y.shape[1], dtype=np.intp), y.copy(), np.arange(y.shape[1])
        while True:
            axis = self.axis[node]
            inner = np.flatnonzero(axis >= 0)
            if not len(inner):
                return self.child[node]
            a, at = axis[inner], points[inner]
            doubled = 2 * t[a, at]
            upper = doubled >= 1
            t[a, at] = doubled - upper
            node[inner] = self.child[node[inner]] + upper

    def shares(self, even: float) -> Array:
        """Parts of the samples (leaves,): `even` of them by volume, the others by (V σ)^⅔."""
        volumes = self.volumes
        wanted = (volumes * self.deviation) ** POWER
        return volumes if not wanted.any() else even * volumes + (1 - even) * wanted / wanted.sum()


def grow(y: Array, values: Array, weights: Array) -> Partition:
    """The tree of samples y (d, n) with values (fields, n), of which each stands for a volume, its weight (n,).

    Notes
    -----
    Every box that has enough samples is halved, along the axis that leaves the least mean σ of the halves, each halved
    once more along the axis that is best for it: a ridge along a diagonal shows no gain in one split. Then splits that
    gain too little are taken back, from the leaves up.
    """
    levels = _grown(y, _moments(values, weights), max(FEWEST, 2 * len(y)))
    left = _prune(levels)
    return _assembled(levels, len(y)) if left < WORTH else Partition.whole(len(y))


@dataclass
class _Level:
    """Nodes of one depth: σ, samples and V of each, the axis of its split or −1, the number of its lower half below."""

    deviation: Array
    count: Array
    volume: float
    axis: Indices
    child: Indices


def _moments(values: Array, weights: Array) -> Array:
    """1, w, and w f and w f² of each field in units of its mean size: (2 + 2 fields, n)."""
    values = np.nan_to_num(values)
    size = (np.abs(values) * weights).sum(axis=1, keepdims=True) / weights.sum()
    scaled = np.divide(values, size, out=np.zeros_like(values), where=size > 0)
    return np.concatenate([np.ones((1, len(weights))), weights[None], weights * scaled, weights * np.square(scaled)])


def _grown(y: Array, moments: Array, fewest: int) -> list[_Level]:
    """All levels before pruning."""
    n = y.shape[1]
    levels: list[_Level] = []
    node, nodes, t = np.zeros(n, dtype=np.intp), 1, y.copy()
    for depth in range(DEPTH + 1):
        deviation, count = _deviations(_sums(node, nodes, moments))
        axis = np.full(nodes, -1)
        if depth < DEPTH:
            axis = np.where(deviation > 0, _best_axis(t, node, nodes, moments, fewest), -1)
        split = axis >= 0
        child = np.where(split, 2 * (np.cumsum(split) - 1), -1)
        levels.append(_Level(deviation, count, 0.5**depth, axis, child))
        if not split.any():
            return levels
        keep = split[node]
        node, t, moments = node[keep], t[:, keep], moments[:, keep]
        along, at = axis[node], np.arange(len(node))
        doubled = 2 * t[along, at]
        upper = doubled >= 1
        t[along, at] = doubled - upper
        node, nodes = child[node] + upper, 2 * int(np.count_nonzero(split))
    return levels


def _best_axis(t: Array, node: Indices, nodes: int, moments: Array, fewest: int) -> Indices:
    """The axis (nodes,) to halve each node along, −1 where no halves have enough samples; t (d, n) is within nodes."""
    d = len(t)
    half = np.minimum((2 * t).astype(np.intp), 1)
    quarter = np.minimum((4 * t).astype(np.intp), 3) % 2
    scores = np.full((d, nodes), np.inf)
    for a in range(d):
        side = 2 * node + half[a]
        deviation, count = _deviations(_sums(side, 2 * nodes, moments))
        least = deviation.copy()
        for b in range(d):
            below = 2 * side + (quarter[a] if b == a else half[b])
            again, counts = (x.reshape(-1, 2) for x in _deviations(_sums(below, 4 * nodes, moments)))
            enough = (counts >= fewest).all(axis=1) & (counts.sum(axis=1) >= 2 * fewest)
            least = np.where(enough, np.minimum(least, again.mean(axis=1)), least)
        allowed = (count.reshape(-1, 2) >= fewest).all(axis=1)
        scores[a] = np.where(allowed, least.reshape(-1, 2).mean(axis=1) * (1 + TIE * a / d), np.inf)
    return np.where(np.isfinite(scores.min(axis=0)), scores.argmin(axis=0), -1)


def _sums(index: Indices, size: int, moments: Array) -> Array:
    """Sums of the moments (rows, n) by index, (rows, size)."""
    return np.stack([np.bincount(index, row, size) for row in moments])


def _deviations(sums: Array) -> tuple[Array, Array]:
    """σ and the number of samples of groups from sums of their moments (rows, groups)."""
    count, weight = sums[0], np.where(sums[1] > 0, sums[1], np.inf)
    fields = (len(sums) - 2) // 2
    variance = np.maximum(sums[2 + fields :] / weight - (sums[2 : 2 + fields] / weight) ** 2, 0).sum(axis=0)
    return np.sqrt(variance * (count / np.maximum(count - 1, 1))), count


def _prune(levels: list[_Level]) -> float:
    """Take back the splits that gain too little; the part of σ of the whole box that Σ V σ of the leaves is."""
    below = np.empty(0)
    for level in reversed(levels):
        total = level.volume * level.deviation
        (split,) = np.nonzero(level.axis >= 0)
        children = below[level.child[split]] + below[level.child[split] + 1]
        kept = children < KEPT * total[split]
        total[split[kept]] = children[kept]
        level.axis[split[~kept]] = -1
        below = total
    whole = levels[0].deviation[0]
    return float(below[0] / whole) if whole > 0 else 1.0


def _assembled(levels: list[_Level], d: int) -> Partition:
    """The tree of the splits that are left, level by level."""
    axes, children, lows, highs, deviations = [], [], [], [], []
    present, low, high = np.zeros(1, dtype=np.intp), np.zeros((1, d)), np.ones((1, d))
    above = levels[0].deviation
    nodes = leaves = 0
    for level in levels:
        axis = level.axis[present]
        leaf, inner = axis < 0, axis >= 0
        above = _blended(level.deviation[present], level.count[present], above)
        child = np.empty(len(axis), dtype=np.intp)
        child[leaf] = leaves + np.arange(np.count_nonzero(leaf))
        nodes += len(axis)
        child[inner] = nodes + 2 * np.arange(np.count_nonzero(inner))
        leaves += int(np.count_nonzero(leaf))
        axes.append(axis)
        children.append(child)
        lows.append(low[leaf])
        highs.append(high[leaf])
        deviations.append(above[leaf])
        if not inner.any():
            break
        above = np.repeat(above[inner], 2)
        present, low, high = _halves(level.child[present[inner]], axis[inner], low[inner], high[inner])
    join = np.concatenate
    return Partition(join(axes), join(children), join(lows), join(highs), join(deviations))


def _blended(deviation: Array, count: Array, above: Array) -> Array:
    """σ of boxes from their own samples and from the σ of the boxes that they were cut from."""
    blended: Array = np.sqrt((count * deviation**2 + OF_PARENT * above**2) / (count + OF_PARENT))
    return blended


def _halves(child: Indices, axis: Indices, low: Array, high: Array) -> tuple[Indices, Array, Array]:
    """Lower and upper halves by turns: their nodes below, and their corners."""
    at = np.arange(len(axis))
    middle = (low[at, axis] + high[at, axis]) / 2
    low, high = np.repeat(low, 2, axis=0), np.repeat(high, 2, axis=0)
    high[2 * at, axis] = middle
    low[2 * at + 1, axis] = middle
    return np.stack([child, child + 1], axis=1).ravel(), low, high
