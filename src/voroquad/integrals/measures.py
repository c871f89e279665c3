"""Measures other than the uniform one of the unit box: products of distributions, and uniform ones of several boxes."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from .._support.arrays import Array
from .._support.checks import positive_int, real_numbers, refuse_masks, unit_points
from ..designs.engines import EngineFactory
from ..designs.sampling import Rng, SampleSet, sample
from ..rules.registry import weights as unit_weights
from .pieces import Part
from .regions import WeighedBox


class Distribution(Protocol):
    """A continuous distribution on the line, such as a frozen one of `scipy.stats`.

    Its inverse CDF is called ``ppf``, or ``icdf`` as in `scipy.stats.make_distribution`.
    """

    def pdf(self, x: Any, /) -> Any:
        """Density."""


class ProductMeasure:
    """Product of distributions on the line, reached from the unit box by their inverse CDFs.

    Samples are drawn and weighted in the unit box ("primary sample space") and then mapped by x = T(u) with T_a =
    F_a⁻¹. Every rule keeps its properties, since
    ∫ f dμ = ∫ f(T(u)) du  and  ∫ f(x) dx = ∫ f(T(u)) / p(T(u)) du  over the support of p.
    For points that exist already, see :meth:`weights`.

    Parameters
    ----------
    *distributions : object with ``pdf``, and ``ppf`` or ``icdf``
        One per coordinate: frozen distributions of `scipy.stats`, such as ``scipy.stats.norm(1, 2)``, or the
        new kind, such as ``scipy.stats.Normal(mu=1, sigma=2)``; also `scipy.stats.rv_histogram` for a
        tabulated density.

    Raises
    ------
    ValueError
        No distribution, one without these methods, several in one, or parameters for which there is none.

    Examples
    --------
    Importance sampling of ∫ x² e^(−x) dx = 2 on [0, ∞) from the exponential distribution with mean 2:

    >>> import numpy as np, scipy.stats, voroquad as vq
    >>> s = vq.sample("stratified", n=1024, d=1, rng=7)
    >>> w = vq.weights(s, debias="exchange")
    >>> m = vq.ProductMeasure(scipy.stats.expon(scale=2))
    >>> x = m.transform(s.points)
    >>> f = x[:, 0] ** 2 * np.exp(-x[:, 0])
    >>> round(float(w @ (f / m.density(x))), 3)
    2.0
    """

    def __init__(self, *distributions: Distribution):
        if not distributions:
            raise ValueError("distributions: give one per coordinate, for example scipy.stats.norm()")
        for a, distribution in enumerate(distributions):
            if not (hasattr(distribution, "pdf") and (hasattr(distribution, "ppf") or hasattr(distribution, "icdf"))):
                raise ValueError(
                    f"distributions[{a}] = {distribution!r} lacks ppf (or icdf) and pdf; "
                    "give a frozen distribution, for example scipy.stats.norm()"
                )
            median = np.asarray(_inverse(distribution)(np.array([0.5])))
            if median.shape != (1,) or not np.isfinite(median).all():
                raise ValueError(
                    f"distributions[{a}] must be one distribution with valid parameters, but its median is "
                    f"{median.tolist()}"
                )
        self.distributions: tuple[Any, ...] = distributions

    @property
    def d(self) -> int:
        """Dimension."""
        return len(self.distributions)

    def transform(self, u: ArrayLike) -> Array:
        """T(u) (..., d) of points u (..., d) of the unit box [0, 1)^d. A coordinate 0 is replaced by 2^−64, so that an
        unbounded support does not give infinity. Raises ValueError where a point is NaN or outside."""
        u = self._checked("u", u)
        unit_points(u if u.ndim in (2, 3) else u.reshape(-1, self.d), name="u")
        return self._inverse_cdf(np.maximum(u, 2.0**-64))

    def density(self, x: ArrayLike) -> Array:
        """p(x) (...) of points x (..., d)."""
        x = self._checked("x", x)
        return np.prod([t.pdf(x[..., a]) for a, t in enumerate(self.distributions)], axis=0)

    def weights(self, x: ArrayLike, *, threads: int | None = None) -> Array:
        """Weights (n,) or (sets, n) of given points x, (n, d) or (sets, n, d), of any origin.

        They are for the estimate Σ_i w_i f(x_i) of ∫ f dμ. The rule has order 0: the weight of a point is the measure
        μ(V_i) of its Voronoi cell. The cells are those of the points u = F(x) of the unit box, where μ is the volume.
        The weights
        are not negative and sum to 1.

        The density of the points need not be known. If it is positive wherever μ's is, the estimate is
        *consistent*: cells shrink and the error falls with n. It is *biased*: near the border of the unit box cells are
        too small or too large on average, and a correction would need the unknown density. A point far out in a tail of
        μ represents all of the tail beyond it, so `f` should not grow there: leave out points where μ has almost no
        mass.

        Parameters
        ----------
        x : array_like, (n, d) or (sets, n, d); (n,) for d = 1
            Points of μ's support. The distributions must have ``cdf``.
        threads : int, optional
            Number of threads; all processors by default. The result does not depend on it.

        Raises
        ------
        ValueError
            A point is NaN or outside the support; a distribution without ``cdf``.

        Examples
        --------
        The mean of X² for a normal X, from points that happen to be spread over [−6, 6], most on the right:

        >>> import numpy as np, scipy.stats, voroquad as vq
        >>> x = 12 * np.sqrt(np.random.default_rng(7).random(500)) - 6
        >>> w = vq.ProductMeasure(scipy.stats.norm()).weights(x)
        >>> round(float(w @ x**2), 2)
        1.0
        """
        x = _points_of("x", x, self.d)
        for a, t in enumerate(self.distributions):
            if not hasattr(t, "cdf"):
                raise ValueError(f"distributions[{a}] = {t!r} lacks cdf, which weights of given points need")
        low, high = self._inverse_cdf(np.repeat([[0.0], [1.0]], self.d, axis=1))
        outside = ~((x >= low) & (x <= high)).all(axis=-1)
        if outside.any():
            first = _first(outside)
            support = f"from {low.tolist()} to {high.tolist()}"
            raise ValueError(f"x[{_shown(first)}] = {x[first].tolist()} is not in the support, {support}; drop it")
        u = np.stack([t.cdf(x[..., a]) for a, t in enumerate(self.distributions)], axis=-1)
        return _unit_weights(np.clip(u, 0, 1), threads=threads)

    def pull_back(self, u: Array) -> tuple[Array, Array]:
        """Points T(u) (d, n) at u (d, n) of the unit box, and their volume element under this measure: 1."""
        return self.transform(u.T).T, np.ones(u.shape[1])

    @property
    def empty(self) -> bool:
        """Whether it has no mass: False."""
        return False

    def __dask_tokenize__(self) -> tuple[str, int, bytes]:
        """What determines the points, alike in every process: quantiles. Attributes of distributions may be caches."""
        u = np.repeat(np.linspace(0, 1, 18)[1:-1, None], self.d, axis=1)
        return type(self).__qualname__, self.d, self._inverse_cdf(u).tobytes()

    def _inverse_cdf(self, u: Array) -> Array:
        return np.stack([_inverse(t)(u[..., a]) for a, t in enumerate(self.distributions)], axis=-1)

    def _checked(self, name: str, points: ArrayLike) -> Array:
        array = real_numbers(name, points)
        if array.ndim == 0 or array.shape[-1] != self.d:
            raise ValueError(f"{name} must have shape (..., {self.d}), got {array.shape}")
        return array


def _inverse(distribution: Any) -> Callable[[Any], Any]:
    """Its inverse distribution function."""
    inverse: Callable[[Any], Any] = distribution.ppf if hasattr(distribution, "ppf") else distribution.icdf
    return inverse


@dataclass(frozen=True, eq=False)
class PiecewiseSamples:
    """Samples of several boxes: like a :class:`voroquad.SampleSet`, but of any place.

    Parameters
    ----------
    points : ndarray, (n, d) or (sets, n, d)
        Positions, piece after piece.
    pieces : tuple of SampleSet
        Each piece's samples, in the unit box.
    """

    points: Array
    pieces: tuple[SampleSet, ...]

    @property
    def design(self) -> str:
        """Name of the sampler that drew each piece."""
        return self.pieces[0].design

    @property
    def n(self) -> int:
        """Number of points of one set."""
        return int(self.points.shape[-2])

    @property
    def d(self) -> int:
        """Dimension."""
        return int(self.points.shape[-1])


class PiecewiseUniform:
    """Uniform samples in each of several boxes, any number of them in each.

    Each piece has its own sample set, which is weighted on the piece and scaled by its measure. The estimate is the sum
    over the pieces, and it is unbiased if the estimate of each piece is.

    Parameters
    ----------
    edges : array_like, (k + 1,), or a sequence of d such
        Ends of the pieces of an interval, finite and ascending; or, as in `numpy.histogramdd`, the ends along each axis
        of a k_1 × … × k_d grid of pieces. For other boxes see :meth:`from_boxes`.
    counts : array_like of int, (k,) or (k_1, …, k_d)
        Number of samples in each piece, at least 1.
    measures : array_like, same shape, optional
        Measure of each piece, spread evenly over it: the estimate is of Σ_k (measure_k / volume_k) ∫_k f. By
        default its length, area or volume: the estimate is of ∫ f.

    Raises
    ------
    ValueError
        Edges do not ascend; a count is missing, not an integer or below 1; a measure is negative or not finite.

    Notes
    -----
    The estimate is Σ_k m_k Σ_{i in k} w_i f(x_i), where m_k is the measure of piece k and w are the weights that
    :func:`voroquad.weights` gives its samples after a map to the unit box. With all weights 1/N_k this is stratified
    sampling with N_k samples in stratum k.

    References
    ----------
    J. J. Guo and E. Eisemann, "Geometric Sample Reweighting for Monte Carlo Integration", Computer Graphics Forum
    40(7), 109–119, 2021.

    Examples
    --------
    More samples where √x is curved:

    >>> import numpy as np, voroquad as vq
    >>> m = vq.PiecewiseUniform(edges=[0, 0.1, 1], counts=[300, 200])
    >>> s = m.sample("uniform", rng=7)
    >>> w = m.weights(s, debias="exchange")
    >>> round(float(w @ np.sqrt(s.points[:, 0])), 4), round(float(w.sum()), 12)
    (0.6667, 1.0)

    In the plane, most of them in one of four rectangles:

    >>> m = vq.PiecewiseUniform([[0, 0.2, 1], [0, 0.5, 1]], counts=[[900, 100], [100, 100]])
    >>> s = m.sample("stratified", rng=7)
    >>> w = m.weights(s, order=1, debias="leave-one-out")
    >>> round(float(w @ np.exp(-10 * s.points.sum(axis=1))), 4)
    0.01
    """

    def __init__(
        self, edges: ArrayLike | list[Any] | tuple[Any, ...], counts: ArrayLike, measures: ArrayLike | None = None
    ):
        axes = _axes(edges)
        # The corners of the pieces in C order, as counts.ravel() has them
        lower = np.array(list(itertools.product(*(axis[:-1] for axis in axes))))
        upper = np.array(list(itertools.product(*(axis[1:] for axis in axes))))
        self._place(lower, upper, tuple(len(axis) - 1 for axis in axes), counts, measures)

    @classmethod
    def from_boxes(
        cls, lower: ArrayLike, upper: ArrayLike, counts: ArrayLike, measures: ArrayLike | None = None
    ) -> PiecewiseUniform:
        """Pieces that are the boxes from `lower` (k, d) to `upper` (k, d), with `counts` (k,) and `measures` (k,).

        The domain is their union. Raises ValueError if boxes overlap.

        Examples
        --------
        An L of two boxes:

        >>> import voroquad as vq
        >>> m = vq.PiecewiseUniform.from_boxes([[0, 0], [1, 0]], [[1, 2], [3, 1]], counts=[30, 20])
        >>> w = m.weights(m.sample("uniform", rng=7))
        >>> round(float(w.sum()), 12)
        4.0
        """
        low, high = real_numbers("lower", lower), real_numbers("upper", upper)
        if low.ndim != 2 or low.size == 0 or low.shape != high.shape:
            raise ValueError(f"lower and upper must both have shape (k, d), got {low.shape} and {high.shape}")
        flat = ~((low < high) & np.isfinite(low) & np.isfinite(high)).all(axis=-1)
        if flat.any():
            k = int(np.argmax(flat))
            raise ValueError(f"lower[{k}] = {low[k].tolist()} must be finite and below upper[{k}] = {high[k].tolist()}")
        for k in range(1, len(low)):
            common = (np.maximum(low[:k], low[k]) < np.minimum(high[:k], high[k])).all(axis=-1)
            if common.any():
                raise ValueError(f"boxes {int(np.argmax(common))} and {k} overlap; cut one along the other's faces")
        self = cls.__new__(cls)
        self._place(low, high, (len(low),), counts, measures)
        return self

    def _place(
        self,
        lower: Array,
        upper: Array,
        shape: tuple[int, ...],
        counts: ArrayLike,
        measures: ArrayLike | None,
    ) -> None:
        refuse_masks("counts", counts)
        numbers = np.asarray(counts, dtype=object)
        if numbers.shape != shape:
            pieces = " × ".join(map(str, shape))
            raise ValueError(f"counts must hold one number per piece ({pieces}), got {counts!r}")
        self.counts = [positive_int(f"counts[{_shown(k)}]", numbers[k]) for k in np.ndindex(*shape)]
        self.lower, self.upper = lower, upper
        self.measures = np.prod(upper - lower, axis=-1) if measures is None else _masses(measures, shape)

    @property
    def n(self) -> int:
        """Number of samples of a set."""
        return sum(self.counts)

    @property
    def d(self) -> int:
        """Dimension."""
        return int(self.lower.shape[1])

    def density(self, x: ArrayLike) -> Array:
        """p(x) = N_k / (N · volume_k) in piece k, 0 outside; the density that plain Monte Carlo divides by.

        Positions x are (..., d), or (n,) for d = 1. A piece does not include its upper faces.
        """
        x = real_numbers("x", x)
        x = x[:, None] if x.ndim == self.d == 1 else x
        if x.ndim == 0 or x.shape[-1] != self.d:
            raise ValueError(f"x must have shape (..., {self.d}), got {x.shape}")
        values = np.zeros(x.shape[:-1])
        for low, high, count in zip(self.lower, self.upper, self.counts, strict=True):
            values[((x >= low) & (x < high)).all(axis=-1)] = count / (self.n * np.prod(high - low))
        return values

    def sample(
        self, sampler: str | EngineFactory = "uniform", *, sets: int | None = None, rng: Rng = None
    ) -> PiecewiseSamples:
        """Draw one set, or `sets` of them, piece after piece, each by the sampler `sampler` of :func:`voroquad.sample`.

        Returns the samples, whose ``points`` are the positions (n, d) or (sets, n, d), with ``design``,
        ``n`` and ``d`` as a :class:`voroquad.SampleSet` has.
        """
        generators = np.random.default_rng(rng).spawn(len(self.counts))
        pieces = tuple(
            sample(sampler, count, self.d, sets=sets, rng=r) for count, r in zip(self.counts, generators, strict=True)
        )
        positions = [
            np.clip(low + (high - low) * piece.points, low, np.nextafter(high, low))
            for low, high, piece in zip(self.lower, self.upper, pieces, strict=True)
        ]
        return PiecewiseSamples(np.concatenate(positions, axis=-2), pieces)

    def weights(
        self,
        samples: PiecewiseSamples | ArrayLike,
        *,
        order: int | str = 0,
        debias: str = "none",
        design: str | None = None,
        threads: int | None = None,
    ) -> Array:
        """Weights (n,) or (sets, n) of samples. If the weights of the rule sum to 1, these sum to the total measure.

        Parameters
        ----------
        samples : PiecewiseSamples or array_like, (n, d) or (sets, n, d); (n,) for d = 1
            What :meth:`sample` returned, or bare positions, piece after piece.
        order, debias, design, threads
            As for :func:`voroquad.weights`.

        Raises
        ------
        ValueError
            A position is not in its piece; what :func:`voroquad.weights` refuses in a piece.
        """
        if isinstance(samples, PiecewiseSamples):
            self._split(samples.points)  # since they are samples of this measure
            pieces: Sequence[SampleSet | Array] = samples.pieces
        else:
            pieces = self._split(samples)
        return np.concatenate(
            [
                measure * _unit_weights(piece, order=order, debias=debias, design=design, threads=threads)
                for measure, piece in zip(self.measures, pieces, strict=True)
            ],
            axis=-1,
        )

    def parts(self) -> list[Part]:
        """Its pieces as :func:`voroquad.quad` integrates over them, each with its share of the samples."""
        boxes = zip(self.lower, self.upper, self.measures, self.counts, strict=True)
        return [Part(WeighedBox(low, high, mass), count / self.n) for low, high, mass, count in boxes]

    def _split(self, points: ArrayLike) -> list[Array]:
        """Each piece's points, moved to the unit box."""
        x = _points_of("samples", points, self.d)
        if x.shape[-2] != self.n:
            raise ValueError(
                f"samples must have shape ({self.n}, {self.d}) or (sets, {self.n}, {self.d}), got {x.shape}"
            )
        lower, upper = (np.repeat(ends, self.counts, axis=0) for ends in (self.lower, self.upper))
        astray = ~((x >= lower) & (x <= upper)).all(axis=-1)
        if astray.any():
            first = _first(astray)
            piece = int(np.repeat(np.arange(len(self.counts)), self.counts)[first[-1]])
            raise ValueError(
                f"samples[{_shown(first)}] = {x[first].tolist()} must lie in piece {piece}, from "
                f"{self.lower[piece].tolist()} to {self.upper[piece].tolist()}; positions go piece after piece"
            )
        u = np.minimum((x - lower) / (upper - lower), np.nextafter(1.0, 0.0))
        return np.split(u, np.cumsum(self.counts)[:-1], axis=-2)


def _unit_weights(points: SampleSet | Array, **options: Any) -> Array:
    """Weights of points of the unit box. Their dimension is known, so a single point is not ambiguous."""
    if isinstance(points, np.ndarray) and points.ndim == 2:
        return unit_weights(points[None], **options)[0]
    return unit_weights(points, **options)


def _axes(edges: Any) -> list[Array]:
    """The edges of the pieces along each axis."""
    named = {"edges": edges}
    if isinstance(edges, Sequence | np.ndarray) and len(edges) and np.ndim(edges[0]):
        named = {f"edges[{a}]": axis for a, axis in enumerate(edges)}
    axes = []
    for name, given in named.items():
        axis = real_numbers(name, given)
        if axis.ndim != 1 or len(axis) < 2 or not np.isfinite(axis).all():
            raise ValueError(f"{name} must be two or more finite numbers, got {given!r}")
        if (np.diff(axis) <= 0).any():
            raise ValueError(f"{name} must ascend, got {axis.tolist()}")
        axes.append(axis)
    return axes


def _masses(measures: ArrayLike, shape: tuple[int, ...]) -> Array:
    """The measure (k,) of each piece."""
    masses = real_numbers("measures", measures)
    if masses.shape != shape:
        raise ValueError(f"measures must hold one number per piece, shape {shape}, got {masses.shape}")
    wrong = ~((masses >= 0) & np.isfinite(masses))
    if wrong.any():
        first = _first(wrong)
        raise ValueError(f"measures[{_shown(first)}] must be finite and at least 0, got {masses[first]}")
    return masses.ravel()


def _points_of(name: str, points: ArrayLike, d: int) -> Array:
    """Points (n, d) or (sets, n, d); for d = 1 (n,) counts as (n, 1)."""
    x = real_numbers(name, points)
    x = x[:, None] if x.ndim == d == 1 else x
    if x.ndim not in (2, 3) or x.shape[-1] != d or x.size == 0:
        raise ValueError(f"{name} must have shape (n, {d}) or (sets, n, {d}) with n ≥ 1, got {x.shape}")
    return x


def _first(wrong: ArrayLike) -> tuple[int, ...]:
    """Index of the first that is True."""
    return tuple(int(i) for i in np.argwhere(wrong)[0])


def _shown(index: tuple[int, ...]) -> int | tuple[int, ...]:
    """The index as errors show it."""
    return index[0] if len(index) == 1 else index
