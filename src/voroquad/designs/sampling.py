"""Sample sets: points at which to evaluate the integrand, and how they were drawn."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._support.arrays import Array
from .._support.checks import one_of, positive_int, real_numbers, refuse_transposed, unit_points
from .._support.html import table
from .design import DESIGNS, SAMPLERS, design_of
from .engines import EngineFactory, design_name, engine_points, on_a_lattice
from .grids import grid_shape, stratum_index
from .plots import draw

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from scipy.stats import qmc

Rng: TypeAlias = int | np.random.Generator | None


@dataclass(frozen=True)
class SetKind:
    """Properties of sample sets that are known before they are drawn. The choice of a rule depends on these only.

    Parameters
    ----------
    design : str
        Name of the design.
    n, d : int
        Number of points of a set, and dimension.
    sets : int
        Number of sets that are weighted together.
    """

    design: str
    n: int
    d: int
    sets: int = 1


@dataclass(frozen=True, eq=False)
class SampleSet:
    """Points of the unit box and the design by which they were drawn.

    Parameters
    ----------
    points : ndarray, (n, d) or (sets, n, d)
        Points of [0, 1)^d, one set or a batch of independent ones.
    design : str
        The name of the sampler. It determines what rules for weights may assume about the points.
    strata : tuple of int, optional
        For gridded designs (:mod:`voroquad.designs.design`), the number of boxes k_1 … k_d along each axis. Each box
        contains one point; :func:`sample` draws them in C order of the boxes (the last axis fastest).
    """

    points: Array
    design: str
    strata: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        points = np.asarray(self.points)
        if points.ndim not in (2, 3):
            raise ValueError(f"points must have shape (n, d) or (sets, n, d), got {points.shape}")
        unit_points(self.points, closed=True)
        object.__setattr__(self, "points", points)
        if design_of(self.design).gridded:
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

    @property
    def batch(self) -> Array:
        """The points (sets, n, d), of one set as a batch of one."""
        return self.points if self.points.ndim == 3 else self.points[None]

    @property
    def kind(self) -> SetKind:
        """The kind of the set, or of the sets of a batch."""
        return SetKind(self.design, self.n, self.d, len(self.batch))

    def __len__(self) -> int:
        return self.n

    def __repr__(self) -> str:
        batch = f"sets={self.points.shape[0]}, " if self.points.ndim == 3 else ""
        return f"SampleSet({self.design!r}, {batch}n={self.n}, d={self.d})"

    def _repr_html_(self) -> str:
        strata = [] if self.strata is None else [("strata", " × ".join(map(str, self.strata)))]
        sets = [] if self.points.ndim == 2 else [("sets", len(self.points))]
        return table("SampleSet", [("design", self.design), *sets, ("samples", self.n), ("dimension", self.d), *strata])

    def plot(self, weights: ArrayLike | None = None, *, ax: Axes | None = None, cmap: Any = "viridis") -> Axes:
        """Draw one set with Matplotlib, with its strata and weights.

        Parameters
        ----------
        weights : array_like, (n,), optional
            As :func:`weights` returns them. They are drawn as heights of lines for d = 1, otherwise as colours. Both
            show the weight times n, whose mean is 1 if the weights sum to 1.
        ax : matplotlib.axes.Axes, optional
            Where to draw; a new figure by default. For d = 3 it must have ``projection="3d"``.
        cmap : str or matplotlib.colors.Colormap
            Colours of the smallest to the largest weight.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        ValueError
            The set is a batch or has more than three dimensions, or the number of weights is not n.
        ImportError
            Matplotlib is not installed; the extra ``study`` brings it.
        """
        if self.points.ndim != 2 or self.d > 3:
            raise ValueError(f"plot needs one set of points (n, d) with d at most 3, got shape {self.points.shape}")
        given = None if weights is None else real_numbers("weights", weights)
        if given is not None and given.shape != (self.n,):
            raise ValueError(f"weights has shape {given.shape}; give one for each of the points, ({self.n},)")
        return draw(self.points, self.strata, given, ax, cmap)


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
        (:mod:`voroquad.designs.orthogonal`). Alternatively an engine of `scipy.stats.qmc`, which continues its
        sequence, or an engine class or callable ``(d, rng=)`` that makes one per set, such as
        ``functools.partial(qmc.LatinHypercube, strength=2)``. Unbiased rules accept points of SciPy's ``Sobol``,
        ``Halton`` and ``LatinHypercube`` if these scramble and do not optimise. For other engines the caller guarantees
        that points are uniform, and that those of different generators are independent.
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
    if not isinstance(sampler, str):
        from scipy.stats import qmc

        if isinstance(sampler, qmc.QMCEngine):
            return _from_engine(sampler, n, d, sets)
    d = 1 if d is None else positive_int("d", d)
    generator = as_generator(rng)
    if callable(sampler):
        engines = [_engine(sampler(d, rng=r)) for r in generator.spawn(batch)]
        points = np.stack([engine_points(engine, n) for engine in engines])
        if len(np.unique(points.reshape(batch, -1), axis=0)) < batch:
            raise ValueError(
                f"sampler: two of {batch} sets have the same points, so they are not independent; "
                "let the engine use the rng that it is given and scramble its points"
            )
        design = design_name(engines[0])
        if design == "engine" and batch > 1 and on_a_lattice(points):
            design = "engine (on a lattice)"
        return _finish(points, design, None, sets)

    one_of("sampler", sampler, DESIGNS)
    drawn = DESIGNS[sampler]
    drawn.check_dimension(d)
    strata = grid_shape(n, d) if drawn.gridded else None
    points = SAMPLERS[drawn](batch, n, d, generator)
    return _finish(points, sampler, strata, sets)


def as_generator(rng: Rng) -> np.random.Generator:
    """The generator that a seed stands for."""
    if isinstance(rng, int | np.integer) and rng < 0:
        raise ValueError(f"rng: a seed must be at least 0, got {rng}")
    try:
        return np.random.default_rng(rng)
    except TypeError:
        raise TypeError(f"rng must be a whole number, a numpy.random.Generator or None, got {rng!r}") from None


def as_sample_set(samples: SampleSet | ArrayLike, design: str | None = None) -> SampleSet:
    """Return `samples` as a `SampleSet`, checking bare points against the design they claim.

    Bare points of a gridded design may come in any order; the set has them as they came.
    """
    if isinstance(samples, SampleSet):
        if design is not None and design != samples.design:
            raise ValueError(f"design={design!r} contradicts the set's own design {samples.design!r}; drop it")
        return samples
    points = unit_points(samples, closed=design is None, remedy="give the box as bounds=[(low, high), ...] or drop it")
    refuse_transposed(samples, name="samples")
    if design is None:
        return SampleSet(points, "unknown")
    one_of("design", design, DESIGNS)
    if not DESIGNS[design].gridded:
        return SampleSet(points, design)
    return SampleSet(points, design, grid_shape(*points.shape[-2:]))


def largest_size(sampler: str | EngineFactory, n: int, d: int) -> int:
    """The largest number of points, at most n, that a set of a sampler can have.

    Raises ValueError where n is too small for any.

    Examples
    --------
    >>> from voroquad.designs.sampling import largest_size
    >>> [largest_size(name, 250, 2) for name in ("stratified", "orthogonal", "sobol")]
    [240, 169, 250]
    """
    return design_of(sampler).largest_size(n, d) if isinstance(sampler, str) else n


def _check_one_per_stratum(points: Array, strata: tuple[int, ...], design: str) -> None:
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


def _engine(made: Any) -> qmc.QMCEngine:
    """What a callable made, if points can be drawn from it."""
    if not (callable(getattr(made, "random", None)) and hasattr(made, "d")):
        raise ValueError(
            f"sampler must make an engine of scipy.stats.qmc from (d, rng=), as qmc.Sobol does, got {made!r}"
        )
    return made


def _from_engine(engine: qmc.QMCEngine, n: int, d: int | None, sets: int | None) -> SampleSet:
    name = type(engine).__name__
    if sets is not None:
        raise ValueError(
            "sampler: one engine makes one set (its next points are not independent of the last); where there are "
            f"several, pass the class, sampler=qmc.{name}, or with options functools.partial(qmc.{name}, ...)"
        )
    if d is not None and d != engine.d:
        raise ValueError(f"d = {d} contradicts the engine's own d = {engine.d}; drop d")
    return SampleSet(engine_points(engine, n), design_name(engine))


def _finish(points: NDArray[Any], design: str, strata: tuple[int, ...] | None, sets: int | None) -> SampleSet:
    return SampleSet(np.ascontiguousarray(points if sets is not None else points[0]), design, strata)
