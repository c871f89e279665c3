"""Measures other than the uniform one of the unit box: warped, and piecewise uniform."""

from __future__ import annotations

import itertools
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._checks import positive_int
from .samplers import Rng, sample
from .weights import weights as unit_weights


class Distribution(Protocol):
    """A continuous distribution on the line, such as a frozen one of `scipy.stats`."""

    def ppf(self, q: Any, /) -> Any:
        """Inverse of the cumulative distribution function."""

    def pdf(self, x: Any, /) -> Any:
        """Density."""


class ProductMeasure:
    """Product of distributions on the line, reached from the unit box by their inverse CDFs.

    Samples are drawn and weighed in the unit box ("primary sample space") and warped afterwards,
    x = T(u) with T_a = F_a⁻¹. Every rule keeps its properties, since
    ∫ f dμ = ∫ f(T(u)) du  and  ∫ f(x) dx = ∫ f(T(u)) / p(T(u)) du  over the support of p.

    Parameters
    ----------
    *distributions : object with ``ppf`` and ``pdf``
        One per coordinate: frozen distributions of `scipy.stats`, also `scipy.stats.rv_histogram`
        for a tabulated density.

    Raises
    ------
    ValueError
        No distribution, or one without ``ppf`` and ``pdf``.

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
            if not (hasattr(distribution, "ppf") and hasattr(distribution, "pdf")):
                raise ValueError(
                    f"distributions[{a}] = {distribution!r} lacks ppf and pdf; "
                    "give a frozen distribution, for example scipy.stats.norm()"
                )
        self.distributions = distributions

    @property
    def d(self) -> int:
        """Dimension."""
        return len(self.distributions)

    def transform(self, u: ArrayLike) -> NDArray[np.float64]:
        """T(u) (..., d) of points u (..., d) of the unit box. A coordinate 0 counts as 2^−64, so that
        an unbounded support gives no infinity."""
        u = self._checked("u", u)
        u = np.maximum(u, 2.0**-64)
        return np.stack([t.ppf(u[..., a]) for a, t in enumerate(self.distributions)], axis=-1)

    def density(self, x: ArrayLike) -> NDArray[np.float64]:
        """p(x) (...) of points x (..., d)."""
        x = self._checked("x", x)
        return np.prod([t.pdf(x[..., a]) for a, t in enumerate(self.distributions)], axis=0)

    def _checked(self, name: str, points: ArrayLike) -> NDArray[np.float64]:
        array = np.asarray(points, dtype=np.float64)
        if array.ndim == 0 or array.shape[-1] != self.d:
            raise ValueError(f"{name} must have shape (..., {self.d}), got {array.shape}")
        return array


class PiecewiseUniform:
    """Uniform samples in each piece of an interval, any number of them in each.

    Each piece's samples are a set of their own: weighed on the piece and scaled by its width. So
    the estimate is the sum of one estimate per piece, and unbiased where those are.

    Parameters
    ----------
    edges : array_like, (k + 1,)
        Ends of the pieces, finite and ascending.
    counts : array_like of int, (k,)
        Number of samples in each piece, at least 1.

    Raises
    ------
    ValueError
        Edges that do not ascend, counts that are not k whole numbers of at least 1.

    Examples
    --------
    More samples where √x bends:

    >>> import numpy as np, voroquad as vq
    >>> m = vq.PiecewiseUniform(edges=[0, 0.1, 1], counts=[300, 200])
    >>> x = m.sample("uniform", rng=7)
    >>> w = m.weights(x, design="uniform", debias="exchange")
    >>> round(float(w @ np.sqrt(x)), 4), round(float(w.sum()), 12)
    (0.6667, 1.0)
    """

    def __init__(self, edges: ArrayLike, counts: ArrayLike):
        self.edges = np.asarray(edges, dtype=np.float64)
        if self.edges.ndim != 1 or len(self.edges) < 2 or not np.isfinite(self.edges).all():
            raise ValueError(f"edges must be two or more finite numbers, got {edges!r}")
        if (np.diff(self.edges) <= 0).any():
            raise ValueError(f"edges must ascend, got {self.edges.tolist()}")
        numbers = np.asarray(counts).tolist()
        if not isinstance(numbers, list) or len(numbers) != len(self.edges) - 1:
            raise ValueError(f"counts must hold one number per piece ({len(self.edges) - 1}), got {counts!r}")
        self.counts = [positive_int(f"counts[{k}]", number) for k, number in enumerate(numbers)]

    @property
    def n(self) -> int:
        """Number of samples of a set."""
        return sum(self.counts)

    def density(self, x: ArrayLike) -> NDArray[np.float64]:
        """p(x) = N_k / (N · width_k) in piece k, 0 outside; the density that plain Monte Carlo divides by."""
        x = np.asarray(x, dtype=np.float64)
        piece = np.searchsorted(self.edges, x, side="right") - 1
        inside = (piece >= 0) & (piece < len(self.counts))
        values = np.asarray(self.counts) / (self.n * np.diff(self.edges))
        return np.where(inside, values[np.clip(piece, 0, len(self.counts) - 1)], 0.0)

    def sample(self, sampler: str = "uniform", *, sets: int | None = None, rng: Rng = None) -> NDArray[np.float64]:
        """Draw positions (n,) or (sets, n), piece after piece, each by the sampler `sampler`."""
        generator = np.random.default_rng(rng)
        pieces = []
        for k, (count, r) in enumerate(zip(self.counts, generator.spawn(len(self.counts)), strict=True)):
            u = sample(sampler, count, 1, sets=sets, rng=r).points[..., 0]
            low, high = self.edges[k : k + 2]
            pieces.append(np.clip(low + (high - low) * u, low, np.nextafter(high, low)))
        return np.concatenate(pieces, axis=-1)

    def weights(
        self, x: ArrayLike, *, design: str | None = None, order: int = 0, debias: str = "none"
    ) -> NDArray[np.float64]:
        """Weights (n,) or (sets, n) of positions drawn by :meth:`sample`; they sum to the interval's length.

        Raises ValueError where a position is not in its piece. `design`, `order` and `debias` are
        those of :func:`voroquad.weights`.
        """
        x = np.asarray(x, dtype=np.float64)
        if x.ndim not in (1, 2) or x.shape[-1] != self.n:
            raise ValueError(f"x must have shape ({self.n},) or (sets, {self.n}), got {x.shape}")
        w = np.empty_like(x)
        for k, (start, stop) in enumerate(self._ranges()):
            low, high = self.edges[k : k + 2]
            u = (x[..., start:stop] - low) / (high - low)
            if not ((u >= 0) & (u <= 1)).all():
                raise ValueError(
                    f"x[{start}:{stop}] must lie in piece {k}, [{low}, {high}); positions go piece after piece"
                )
            points = np.minimum(u, np.nextafter(1.0, 0.0))[..., None]
            w[..., start:stop] = (high - low) * unit_weights(points, design=design, order=order, debias=debias)
        return w

    def _ranges(self) -> list[tuple[int, int]]:
        ends = np.cumsum([0, *self.counts]).tolist()
        return list(itertools.pairwise(ends))
