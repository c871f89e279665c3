"""Unbiased rules of others, written here from their papers as comparators; they are no part of the library."""

import itertools
import math
from collections.abc import Iterator, Sequence
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.stats import qmc

import voroquad as vq
from voroquad.study.integrand import KnownIntegrand
from voroquad.study.peers import Estimates, Integrator

Floats = NDArray[np.float64]

# ---------------------------------------------------------------------- control neighbours


def control_neighbours(points: Floats) -> Floats:
    """Weights (n,) of Î = (1/n) Σ_i [ f_i − f̂^(−i)(x_i) + ∫ f̂^(−i) ], f̂ the nearest sample's value.

    R. Leluc, F. Portier, J. Segers and A. Zhuman, "Speeding up Monte Carlo integration: control neighbors for
    optimal convergence", Bernoulli 31(2), 2025. Without x_i its cell goes to the second nearest samples. Cells are
    exact up to three dimensions; the regions of second nearest samples, which enter with 1/n only, and all cells
    above, are counted with 2^16 probes.
    """
    n, d = points.shape
    tree = cKDTree(points)
    _, neighbours = tree.query(points, k=2)
    _, order = tree.query(_probes(d), k=2)
    first, second = (np.bincount(order[:, k], minlength=n) / len(order) for k in (0, 1))
    cells = vq.cells(points).measures if d <= 3 else first
    return 1 / n - np.bincount(neighbours[:, 1], minlength=n) / n + ((n - 1) * cells + second) / n


@cache
def _probes(d: int) -> Floats:
    return qmc.Sobol(d, rng=np.random.default_rng(d)).random(2**16)


def by_control_neighbours(functions: Sequence[KnownIntegrand], n: int, rng: np.random.Generator) -> Estimates:
    """The rule on n independent points."""
    points = rng.random((n, functions[0].d))
    weights = control_neighbours(points)
    return np.array([weights @ f.values(points) for f in functions]), n


# ---------------------------------------------------------------------- cubic stratification


def cubic_stratification(
    order: int, functions: Sequence[KnownIntegrand], n: int, rng: np.random.Generator
) -> Estimates:
    """k^d cubes with a uniform point in each; its mirror image in the centre; a Taylor polynomial as control variate.

    N. Chopin and M. Gerber, "Higher-order Monte Carlo through cubic stratification", SIAM J. Numer. Anal. (2024;
    preprint arXiv:2210.01554), the estimator for functions that do not vanish at the boundary. With c the centres and
    u uniform in a cube, order 1 is the mean of f(c + u), which is Haber's first rule; order 2 that of
    [f(c + u) + f(c − u)] / 2, his second; order r = 4, 6, … subtracts
    Σ_{l = 2, 4, … r−2} Σ_{|α| = l} D^α f(c) (u^α − E u^α) / α!, with derivatives
    by differences of f at the centres that are exact for polynomials of degree < r.
    """
    d = functions[0].d
    k = cubes_per_axis(order, d, n)
    v = rng.random((k**d, d)) - 0.5  # u in units of a cube's side
    centres = np.indices((k,) * d).reshape(d, -1).T + 0.5
    signs = (1, -1) if order > 1 else (1,)
    estimates = np.array([np.mean([f.values((centres + s * v) / k) for s in signs]) for f in functions])
    if order < 4:
        return estimates, len(signs) * k**d
    at_centres = np.stack([f.values(centres / k) for f in functions]).reshape(-1, *(k,) * d)
    for degree in range(2, order, 2):
        for alpha in multi_indices(d, degree):
            derivative = at_centres
            for axis, a in enumerate(alpha):
                if a:
                    matrix = differences(k, a, order - degree)
                    derivative = np.moveaxis(np.tensordot(matrix, derivative, (1, axis + 1)), 0, axis + 1)
            mean = math.prod(0.5**a / (a + 1) if a % 2 == 0 else 0.0 for a in alpha)
            control = (np.prod(v**alpha, axis=1) - mean) / math.prod(map(math.factorial, alpha))
            estimates -= derivative.reshape(len(functions), -1) @ control / k**d
    return estimates, 3 * k**d


def cubes_per_axis(order: int, d: int, n: int) -> int:
    """The most that n evaluations allow: one per cube for order 1, two for order 2, three above."""
    return math.floor((n / min(order, 3)) ** (1 / d) + 1e-9)


def multi_indices(d: int, degree: int) -> Iterator[tuple[int, ...]]:
    """All α ≥ 0 with |α| = degree."""
    return (a for a in itertools.product(range(degree + 1), repeat=d) if sum(a) == degree)


@cache
def differences(k: int, derivative: int, accuracy: int) -> Floats:
    """Matrix (k, k) of a derivative on k equidistant nodes, at unit distance.

    Exact for polynomials of degree below derivative + accuracy: central formulas, with one node less or as many as
    that takes, where they fit, else the nodes at the border.
    """
    matrix = np.zeros((k, k))
    half = (derivative + 1) // 2 + accuracy // 2 - 1
    for node in range(k):
        if half <= node < k - half:
            first, count = node - half, 2 * half + 1
        else:
            count = derivative + accuracy
            first = 0 if node < half else k - count
        offsets = np.arange(first, first + count) - node
        moments = np.vander(offsets.astype(float), increasing=True).T
        wanted = np.zeros(count)
        wanted[derivative] = math.factorial(derivative)
        matrix[node, first : first + count] = np.linalg.solve(moments, wanted)
    return matrix


def cubic_rule(order: int) -> Integrator:
    """Cubic stratification of one order."""

    def exists(d: int, n: int) -> bool:
        return cubes_per_axis(order, d, n) >= (order if order > 2 else 1)  # the widest difference has that many nodes

    return Integrator(f"cubic-{order}", partial(cubic_stratification, order), exists)


CUBIC_ORDERS = (1, 2, 4, 6, 8, 10)
COMPARATORS = (
    Integrator("control-neighbours", by_control_neighbours),
    *(cubic_rule(order) for order in CUBIC_ORDERS),
)
