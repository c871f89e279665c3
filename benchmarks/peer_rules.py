"""Rules of others, at a given number of evaluations. Each entry of PEERS makes, for d and n, a function
(integrand, n, seed) -> (estimate, evaluations), or None where the rule does not exist."""

import functools
import itertools
from collections.abc import Callable

import numpy as np
import scipy.integrate
from scipy.spatial import cKDTree
from scipy.stats import qmc

from voroquad.study.genz import Integrand

Rule = Callable[[Integrand, int, int], tuple[float, int]]


def qmc_quad(f: Integrand, n: int, seed: int, engine: type[qmc.QMCEngine] = qmc.Sobol) -> tuple[float, int]:
    """scipy.integrate.qmc_quad, 8 sets."""
    result = scipy.integrate.qmc_quad(
        f,
        np.zeros(f.d),
        np.ones(f.d),
        n_estimates=8,
        n_points=n // 8,
        qrng=engine(f.d, rng=np.random.default_rng(seed)),
    )
    return float(result.integral), n // 8 * 8


def cubature(f: Integrand, n: int, seed: int) -> tuple[float, int]:
    """scipy.integrate.cubature (Genz–Malik, in one dimension Gauss–Kronrod), subdivided while n lasts."""
    calls = 0

    def counted(x: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += len(x)
        return f(x.T)

    rule = "gk21" if f.d == 1 else "genz-malik"
    value, used = np.nan, 0
    for subdivisions in itertools.count():  # the number of subdivisions that n allows
        calls = 0
        result = scipy.integrate.cubature(
            counted, np.zeros(f.d), np.ones(f.d), rule=rule, rtol=0, atol=0, max_subdivisions=subdivisions
        )
        if calls > n and subdivisions > 0:
            return value, used
        value, used = float(result.estimate), calls
        if result.status == "converged":
            return value, used


def control_neighbours(f: Integrand, n: int, seed: int) -> tuple[float, int]:
    """Leave-one-out with the nearest neighbour, independent points (Leluc, Portier, Segers and Zhuman 2024).

    The integral of the nearest-neighbour interpolant is by n² further points that cost no evaluation.
    """
    x = np.random.default_rng(seed).random((n, f.d))
    values, tree = f(x.T), cKDTree(x)
    _, nearest = tree.query(x, k=2)
    _, pair = tree.query(qmc.Sobol(f.d, rng=np.random.default_rng(seed)).random(2**16), k=2)
    # ∫ f̂^(−i) differs from ∫ f̂ on the cell of x_i only, where the second nearest takes over
    integral = values[pair[:, 0]].mean() + (values[pair[:, 1]] - values[pair[:, 0]]).mean() / n
    return float((values - values[nearest[:, 1]]).mean() + integral), n


def cubic_stratification(order: int, f: Integrand, n: int, seed: int) -> tuple[float, int]:
    """Haber's and Chopin and Gerber's estimator (SIAM J. Numer. Anal. 2024), orders 1 and 2: k^d cubes with
    a uniform point in each, for order 2 averaged with its mirror image in the cube's centre."""
    per_cube = order
    k = int((n / per_cube) ** (1 / f.d) + 1e-9)
    centres = (np.indices((k,) * f.d).reshape(f.d, -1) + 0.5) / k
    offset = (np.random.default_rng(seed).random(centres.shape) - 0.5) / k
    points = [centres + offset] if order == 1 else [centres + offset, centres - offset]
    return float(np.mean([f(x).mean() for x in points])), per_cube * k**f.d


def vegas(f: Integrand, n: int, seed: int) -> tuple[float, int]:
    """vegas: two iterations to adapt and three that count."""
    import vegas as package

    package.ranseed = None
    np.random.seed(seed)  # noqa: NPY002, the generator that vegas uses
    calls = 0

    @package.lbatchintegrand
    def counted(x: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += len(x)
        return f(np.asarray(x).T)

    integrator = package.Integrator([[0.0, 1.0]] * f.d)
    integrator(counted, nitn=2, neval=n // 5)
    result = integrator(counted, nitn=3, neval=n // 5)
    return float(result.mean), calls


def _available(name: str) -> bool:
    from importlib.util import find_spec

    return find_spec(name) is not None


PEERS: dict[str, Callable[[int, int], Rule | None]] = {
    "qmc_quad": lambda d, n: qmc_quad,
    "qmc_quad-halton": lambda d, n: functools.partial(qmc_quad, engine=qmc.Halton),
    "cubature": lambda d, n: cubature if n >= (21 if d == 1 else 2**d + 2 * d * d + 2 * d + 1) else None,
    "control-neighbours": lambda d, n: control_neighbours,
    "cubic-stratification-1": lambda d, n: functools.partial(cubic_stratification, 1),
    "cubic-stratification-2": lambda d, n: functools.partial(cubic_stratification, 2),
    "vegas": lambda d, n: vegas if _available("vegas") else None,
}
