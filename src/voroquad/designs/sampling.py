"""Sample sets: where to evaluate the integrand, and what is known of how they were drawn."""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import qmc

from .._support.checks import one_of, positive_int, unit_points
from . import multi_jittered, orthogonal

#: Designs of one point per box of a grid
GRIDDED = ("stratified", "multi-jittered", "regular")

Rng: TypeAlias = int | np.random.Generator | None
#: Makes an engine from (d, rng); the classes of `scipy.stats.qmc` do.
EngineFactory: TypeAlias = Callable[..., qmc.QMCEngine]


@dataclass(frozen=True, eq=False)
class SampleSet:
    """Points of the unit box and the design they were drawn by.

    Parameters
    ----------
    points : ndarray, (n, d) or (sets, n, d)
        Points of [0, 1)^d, one set or a batch of independent ones.
    design : str
        The sampler's name: what rules for weights may assume of the points.
    strata : tuple of int, optional
        Sets of the designs in :data:`GRIDDED`: the number of boxes k_1 … k_d along each axis. Each
        box holds one point; :func:`sample` draws them in C order of the boxes (the last axis fastest).
    """

    points: NDArray[np.float64]
    design: str
    strata: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        points = np.asarray(self.points)
        if points.ndim not in (2, 3):
            raise ValueError(f"points must have shape (n, d) or (sets, n, d), got {points.shape}")
        unit_points(points, closed=True)
        object.__setattr__(self, "points", points)
        if self.design in GRIDDED:
            if self.strata is None or len(self.strata) != self.d or math.prod(self.strata) != self.n:
                raise ValueError(
                    f"design={self.design!r} needs the strata of {self.n} points in d = {self.d}, got "
                    f"strata={self.strata}; let weights(points, design=...) find them"
                )
            _check_one_per_stratum(points, self.strata, self.design)

    @property
    def n(self) -> int:
        """Number of points of one set."""
        return int(self.points.shape[-2])

    @property
    def d(self) -> int:
        """Dimension."""
        return int(self.points.shape[-1])

    def __len__(self) -> int:
        return self.n

    def __repr__(self) -> str:
        batch = f"sets={self.points.shape[0]}, " if self.points.ndim == 3 else ""
        return f"SampleSet({self.design!r}, {batch}n={self.n}, d={self.d})"


def sample(
    sampler: str | qmc.QMCEngine | EngineFactory,
    n: int,
    d: int | None = None,
    *,
    sets: int | None = None,
    rng: Rng = None,
) -> SampleSet:
    """Draw a sample set in the unit box.

    Parameters
    ----------
    sampler : str, QMCEngine or callable
        ``"uniform"``: independent points. ``"stratified"``: one uniform point in each box of a
        near-cubic grid. ``"multi-jittered"``: the same, and evenly spread in each coordinate as far as
        neighbouring boxes stay independent (:mod:`voroquad.designs.multi_jittered`). ``"regular"``: the centres
        of the boxes (no randomness).
        ``"sobol"``: Sobol' points, Owen-scrambled. ``"halton"``: Halton points, scrambled.
        ``"zero-two"``: the (0,2)-sequence (van der Corput and second Sobol' dimension) with
        random digit scrambling, d ≤ 2. ``"orthogonal"``: orthogonal arrays of strength 2, evenly spread in
        each pair of coordinates, n = q² for q a prime or a power of one, d ≤ q + 1
        (:mod:`voroquad.designs.orthogonal`). Or an engine of `scipy.stats.qmc`, which continues where it
        stands, or an engine class or callable ``(d, rng=)`` that makes one per set, such as
        ``functools.partial(qmc.LatinHypercube, strength=2)``.
    n : int
        Number of points of a set.
    d : int, optional
        Dimension, 1 by default; an engine brings its own.
    sets : int, optional
        Draw that many independent sets: points (sets, n, d) in place of (n, d).
    rng : int, numpy.random.Generator or None
        Seed. The same seed gives the same points on any machine and number of threads.

    Returns
    -------
    SampleSet
        With ``points``, ``design``, ``n``, ``d`` and, for gridded designs, ``strata``.

    Raises
    ------
    ValueError
        Unknown sampler; n < 1; an n that has no near-cubic grid (the message names the nearest
        that have); zero-two above d = 2; several sets from one engine, or from engines that are not random.

    See Also
    --------
    voroquad.weights : what each sample counts.

    Examples
    --------
    >>> import voroquad as vq
    >>> vq.sample("stratified", n=4, d=1, rng=7).points.ravel().round(3)
    array([0.156, 0.474, 0.694, 0.806])
    >>> vq.sample("stratified", n=12, d=2, rng=7).strata
    (3, 4)
    """
    n = positive_int("n", n)
    batch = 1 if sets is None else positive_int("sets", sets)
    if isinstance(sampler, qmc.QMCEngine):
        return _from_engine(sampler, n, d, sets)
    d = 1 if d is None else positive_int("d", d)
    generator = as_generator(rng)
    if callable(sampler):
        # The design's name tells rules what they may assume: of SciPy's own classes only
        known = isinstance(sampler, type) and sampler.__module__.startswith("scipy.")
        design = sampler.__name__.lower() if known else "engine"
        points = np.stack([_engine_points(sampler(d, rng=r), n) for r in generator.spawn(batch)])
        if len(np.unique(points.reshape(batch, -1), axis=0)) < batch:
            raise ValueError(
                f"sampler: two of {batch} sets have the same points, so they are not independent; "
                "let the engine use the rng that it is given and scramble its points"
            )
        return _finish(points, design, None, sets)

    one_of("sampler", sampler, DESIGNS)
    strata = grid_shape(n, d) if sampler in GRIDDED else None
    points = DESIGNS[sampler](batch, n, d, generator)
    return _finish(points, sampler, strata, sets)


def as_generator(rng: Rng) -> np.random.Generator:
    """The generator that a seed stands for."""
    if isinstance(rng, int | np.integer) and rng < 0:
        raise ValueError(f"rng: a seed must be at least 0, got {rng}")
    return np.random.default_rng(rng)


def as_sample_set(samples: SampleSet | ArrayLike, design: str | None = None) -> SampleSet:
    """Return `samples` as a `SampleSet`, checking bare points against the design they claim.

    Bare points of a gridded design may come in any order; the set has them as they came.
    """
    if isinstance(samples, SampleSet):
        if design is not None and design != samples.design:
            raise ValueError(f"design={design!r} contradicts the set's own design {samples.design!r}; drop it")
        return samples
    points = unit_points(samples, closed=design is None)
    if design is None:
        return SampleSet(points, "unknown")
    one_of("design", design, DESIGNS)
    if design not in GRIDDED:
        return SampleSet(points, design)
    return SampleSet(points, design, grid_shape(*points.shape[-2:]))


# ---------------------------------------------------------------------- grids of strata


def grid_shape(n: int, d: int) -> tuple[int, ...]:
    """Numbers of boxes along each axis whose product is n, ascending and as equal as n allows.

    A grid is near-cubic when its longest axis has at most twice the boxes of its shortest.
    """
    shape = _near_cubic(n, d)
    if shape is None:
        below = next((m for m in range(n - 1, 0, -1) if _near_cubic(m, d)), None)
        above = next(m for m in itertools.count(n + 1) if _near_cubic(m, d))
        raise ValueError(
            f"n = {n} samples do not fill a near-cubic grid in d = {d}; "
            f"the nearest that do are n = {below} and n = {above}"
        )
    return shape


def _near_cubic(n: int, d: int) -> tuple[int, ...] | None:
    """The most equal factors of n whose largest is at most twice the smallest, or None."""
    if d == 1:
        return (n,)

    def factors(rest: int, axes: int, least: int) -> Iterator[tuple[int, ...]]:
        if axes == 1:
            if rest >= least:
                yield (rest,)
            return
        k = least
        while k**axes <= rest:
            if rest % k == 0:
                for tail in factors(rest // k, axes - 1, k):
                    yield (k, *tail)
            k += 1

    # The smallest factor is at least n^(1/d) / 2, since the product is at most k·(2k)^(d−1)
    smallest = max(1, math.ceil((n / 2 ** (d - 1)) ** (1 / d) - 1e-9))
    near = [shape for shape in factors(n, d, smallest) if shape[-1] <= 2 * shape[0]]
    return min(near, key=lambda shape: shape[-1] / shape[0], default=None)


def largest_grid(n: int, d: int) -> tuple[int, ...]:
    """The grid of the most boxes, at most n, whose numbers along the axes differ by at most two.

    Examples
    --------
    >>> from voroquad.designs.sampling import largest_grid
    >>> largest_grid(1024, 2), largest_grid(1000, 3), largest_grid(15, 4)
    ((32, 32), (10, 10, 10), (1, 2, 2, 2))
    """
    k = math.floor(n ** (1 / d) + 1e-9)
    candidates = []
    for least in (max(1, k - 1), k):
        for twos in range(d + 1):
            for ones in range(d - twos + 1):
                shape = (least,) * (d - ones - twos) + (least + 1,) * ones + (least + 2,) * twos
                if math.prod(shape) <= n and shape[-1] <= 2 * shape[0]:
                    candidates.append(shape)
    best = max(candidates, key=lambda shape: (math.prod(shape), shape[0]))
    return grid_shape(math.prod(best), d)


def largest_size(sampler: str | EngineFactory, n: int, d: int) -> int:
    """The most points, at most n, that a set of a sampler can have.

    Raises ValueError where n is too small for any.

    Examples
    --------
    >>> from voroquad.designs.sampling import largest_size
    >>> [largest_size(name, 250, 2) for name in ("stratified", "orthogonal", "sobol")]
    [240, 169, 250]
    """
    if sampler in GRIDDED:
        return math.prod(largest_grid(n, d))
    if sampler == "orthogonal":
        root = next((q for q in range(math.isqrt(n), d - 2, -1) if orthogonal.prime_power(q)), None)
        if root is None:
            raise ValueError(
                f"an orthogonal array has at least n = {orthogonal.least(d)} samples in d = {d}, and a set may have "
                f"{n} only; raise n_points"
            )
        return root**2
    return n


def stratum_index(points: NDArray[np.float64], strata: tuple[int, ...]) -> NDArray[np.intp]:
    """The C-order index (..., n) of the stratum each point (..., n, d) lies in."""
    k = np.asarray(strata)
    boxes = np.minimum((points * k).astype(np.intp), k - 1)
    return np.ravel_multi_index(tuple(np.moveaxis(boxes, -1, 0)), strata)


def _check_one_per_stratum(points: NDArray[np.float64], strata: tuple[int, ...], design: str) -> None:
    n = points.shape[-2]
    indices = stratum_index(points, strata).reshape(-1, n)
    if (indices == np.arange(n)).all():  # as sample() draws them
        return
    for number, index in enumerate(indices):
        counts = np.bincount(index, minlength=n)
        if (counts != 1).any():
            crowded = int(np.argmax(counts != 1))
            of_set = f" of set {number}" if points.ndim == 3 else ""
            raise ValueError(
                f"design={design!r}: each of the {' × '.join(map(str, strata))} strata must hold one point, but "
                f"stratum {crowded}{of_set} holds {counts[crowded]}; say design='uniform' or leave design out"
            )


# ---------------------------------------------------------------------- the designs

Design: TypeAlias = Callable[[int, int, int, np.random.Generator], NDArray[np.float64]]
_BELOW_ONE = np.nextafter(1.0, 0.0)


def _uniform(sets: int, n: int, d: int, rng: np.random.Generator) -> NDArray[np.float64]:
    return rng.random((sets, n, d))


def _stratified(sets: int, n: int, d: int, rng: np.random.Generator) -> NDArray[np.float64]:
    strata = grid_shape(n, d)
    corners = np.indices(strata).reshape(d, n).T
    points: NDArray[np.float64] = (corners + rng.random((sets, n, d))) / strata
    return _inside(points, corners, strata)


def _multi_jittered(sets: int, n: int, d: int, rng: np.random.Generator) -> NDArray[np.float64]:
    strata = grid_shape(n, d)
    corners = np.indices(strata).reshape(d, n).T
    return _inside((corners + multi_jittered.offsets(strata, sets, rng)) / strata, corners, strata)


def _regular(sets: int, n: int, d: int, rng: np.random.Generator) -> NDArray[np.float64]:
    strata = grid_shape(n, d)
    centres = (np.indices(strata).reshape(d, n).T + 0.5) / strata
    return np.broadcast_to(centres, (sets, n, d)).copy()


def _sobol(sets: int, n: int, d: int, rng: np.random.Generator) -> NDArray[np.float64]:
    return _from_digits(owen_scramble(_sobol_digits(n, d), sets, rng), rng)


def _halton(sets: int, n: int, d: int, rng: np.random.Generator) -> NDArray[np.float64]:
    return np.stack([_engine_points(qmc.Halton(d, scramble=True, rng=r), n) for r in rng.spawn(sets)])


def _zero_two(sets: int, n: int, d: int, rng: np.random.Generator) -> NDArray[np.float64]:
    if d > 2:
        raise ValueError(f"a (0,2)-sequence has at most d = 2 dimensions, got d = {d}; use 'sobol'")
    flips = rng.integers(0, 2**_BITS, size=(sets, 1, d), dtype=np.uint64)
    return _from_digits(_sobol_digits(n, d) ^ flips, rng)


DESIGNS: dict[str, Design] = {
    "uniform": _uniform,
    "stratified": _stratified,
    "multi-jittered": _multi_jittered,
    "regular": _regular,
    "sobol": _sobol,
    "halton": _halton,
    "zero-two": _zero_two,
    "orthogonal": orthogonal.points,
}

_BITS = 32


def _sobol_digits(n: int, d: int) -> NDArray[np.uint64]:
    """The first n Sobol' points (n, d) as 32-bit integers."""
    if n > 2**_BITS:
        raise ValueError(f"Sobol' points are made from {_BITS} digits: n must be at most 2^{_BITS}, got {n}")
    engine = qmc.Sobol(d, scramble=False, bits=_BITS)
    points = _engine_points(engine, n)
    return (points * 2.0**_BITS).astype(np.uint64)


def owen_scramble(digits: NDArray[np.uint64], sets: int, rng: np.random.Generator) -> NDArray[np.uint64]:
    """Nested uniform scramblings (sets, n, d) of 32-bit points (n, d), independent in each set and coordinate.

    Digit k is flipped or not by a fair coin that depends on the k − 1 digits before it (Owen 1995).
    The coin is one bit of a hash of those digits and of a random key per digit, set and coordinate.
    """
    keys = rng.integers(0, 2**64, size=(_BITS, sets, 1, digits.shape[-1]), dtype=np.uint64)
    scrambled = np.repeat(digits[None], sets, axis=0)
    for k in range(_BITS):
        prefix = digits >> np.uint64(_BITS - k)
        coin = _mix(prefix ^ keys[k]) >> np.uint64(63)
        scrambled ^= coin << np.uint64(_BITS - 1 - k)
    return scrambled


def _mix(x: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """A bijection of 64-bit integers with good avalanche (the finaliser of SplitMix64, Steele 2014)."""
    with np.errstate(over="ignore"):
        x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


def _from_digits(digits: NDArray[np.uint64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Points of [0, 1) with the given first 32 binary digits; the digits below are random."""
    points = (digits.astype(np.float64) + rng.random(digits.shape)) * 2.0**-_BITS
    return np.minimum(points, _BELOW_ONE)


def _inside(points: NDArray[np.float64], corners: NDArray[np.intp], strata: tuple[int, ...]) -> NDArray[np.float64]:
    """Move points that rounding has put on or beyond a face of their stratum back into it."""
    while (astray := (points * strata).astype(np.intp) - corners).any():
        points = np.where(astray == 0, points, np.nextafter(points, np.where(astray > 0, 0.0, 1.0)))
    return points


def _engine_points(engine: qmc.QMCEngine, n: int) -> NDArray[np.float64]:
    """The next n points of a SciPy engine, below 1 (scrambled engines may round up to it)."""
    with warnings.catch_warnings():
        # Balance of a Sobol' set that is no power of two: the caller's choice
        warnings.filterwarnings("ignore", message="The balance properties", category=UserWarning)
        points = np.minimum(engine.random(n), _BELOW_ONE)
    if points.shape != (n, engine.d):
        raise ValueError(f"sampler: {type(engine).__name__} made {len(points)} points of the n = {n} asked for")
    return points


def _from_engine(engine: qmc.QMCEngine, n: int, d: int | None, sets: int | None) -> SampleSet:
    name = type(engine).__name__
    if sets is not None:
        raise ValueError(
            "sampler: one engine makes one set (its next points are not independent of the last); where there are "
            f"several, pass the class, sampler=qmc.{name}, or with options functools.partial(qmc.{name}, ...)"
        )
    if d is not None and d != engine.d:
        raise ValueError(f"d = {d} contradicts the engine's own d = {engine.d}; drop d")
    return SampleSet(_engine_points(engine, n), name.lower())


def _finish(points: NDArray[Any], design: str, strata: tuple[int, ...] | None, sets: int | None) -> SampleSet:
    return SampleSet(np.ascontiguousarray(points if sets is not None else points[0]), design, strata)
