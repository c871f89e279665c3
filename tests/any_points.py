"""Sets of points without general position, for Hypothesis."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

KINDS = [
    *["any", "uniform", "lattice", "hexagonal", "flat", "diagonal", "border", "copies", "cluster", "neighbours"],
    *["octaves", "sphere", "sphere and centre", "spokes", "rings", "mirrored", "seam"],
]


@st.composite
def any_set(draw: st.DrawFn, max_size: int = 40) -> np.ndarray:
    """Up to three groups of points, each of a kind that breaks algorithms which hope for general position."""
    d = draw(st.integers(1, 3))
    groups = []
    for _ in range(draw(st.integers(1, 3))):
        kind = draw(st.sampled_from(KINDS))
        if kind == "any":
            x = np.array(draw(st.lists(st.floats(0, 1), min_size=d, max_size=4 * d)))
            x = x[: x.size // d * d].reshape(-1, d)
        else:
            rng = np.random.default_rng(draw(st.integers(0, 2**32)))
            x = group_of(kind, draw(st.integers(1, max_size)), d, rng)
        groups.append(np.clip(x, 0, 1))
    return np.concatenate(groups)


def group_of(kind: str, n: int, d: int, rng: np.random.Generator) -> np.ndarray:
    """n points of a kind, about."""
    x = rng.random((n, d))
    middle = rng.choice([0.0, 0.5, 1.0], d) if rng.integers(2) else rng.random(d)
    size = 10.0 ** -rng.integers(0, 17)
    directions = rng.normal(size=(n, d))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    match kind:
        case "lattice":
            k = rng.integers(1, 17)
            return rng.integers(0, k + 1, (n, d)) / k
        case "hexagonal":
            rows = rng.integers(-8, 8, (n, d)) @ (np.eye(d) + 0.5 * (1 - np.eye(d)))
            return middle + size / 8 * rows * (3**0.5 / 2) ** np.arange(d)
        case "flat":
            x[:, rng.permutation(d)[: rng.integers(1, d + 1)]] = rng.random()
        case "diagonal":
            return np.repeat(x[:, :1], d, axis=1)
        case "border":
            x[np.arange(n), rng.integers(0, d, n)] = rng.integers(0, 2, n)
        case "copies":
            return x[rng.integers(0, max(1, n // 4), n)]
        case "cluster":
            return middle + (x - 0.5) * 10.0 ** -rng.integers(0, 311)
        case "seam":  # a cluster on the torus, about its origin
            x = (x - 0.5) * 10.0 ** -rng.integers(0, 20)
            return np.where(x < 0, np.minimum(1 + x, 1 - 2.0**-53), x)
        case "neighbours":  # floating-point numbers that follow each other
            return middle + rng.integers(-3, 4, (n, d)) * np.spacing(middle)
        case "octaves":  # all distances from a point, as far as they go
            return middle + rng.choice([-1, 1], (n, d)) * 2.0 ** -rng.integers(1, 1075, (n, d)).astype(float)
        case "sphere":
            return 0.5 + size * directions
        case "sphere and centre":  # a cell with a face for every other point
            directions[0] = 0
            return 0.5 + size / 2 * directions
        case "spokes":
            return 0.5 + directions[rng.integers(0, 1 + n // 5, n)] * rng.integers(-4, 5, (n, 1)) / 8
        case "rings":
            return 0.5 + directions * rng.integers(0, 4, (n, 1)) / 8
        case "mirrored":  # whose bisectors are the borders or meet in one point
            x = x[: 1 + n // 3]
            return np.concatenate([x, 1 - x, x[:, ::-1]])
    return x
