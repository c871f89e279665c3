"""Regions that consist of pieces. Each piece has its own samples, and the estimate is the sum over the pieces."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .._support.arrays import Array, Indices
from .components import scaled_deviations
from .diagnostics import IntegrationWarning, diagnosis
from .estimates import Estimate
from .regions import Region, for_samples
from .units import norm, powers

#: Pieces with fewer samples are joined, since there is neither a good rule nor a good error for so few.
FEWEST = 16

#: A warning of a piece is one of the whole if the piece makes up at least this part of the squared error.
MOSTLY = 0.5


@dataclass(frozen=True)
class Part:
    """A piece and its share of the samples; all shares sum to 1."""

    region: Region
    share: float


class Chain:
    """Pieces of one dimension as a single region: the first coordinate chooses, in proportion to the shares.

    Notes
    -----
    Within the interval of piece k, [s_k, s_k + p_k) with p_k its share of theirs, u_0 becomes (u_0 − s_k)/p_k and the
    volume element is divided by p_k.
    """

    empty = False

    def __init__(self, parts: Sequence[Part]):
        self.regions = [part.region for part in parts]
        shares = np.array([part.share for part in parts])
        self._shares = shares / shares.sum()
        self._ends = np.concatenate([[0.0], np.cumsum(self._shares)])
        self._ends[-1] = 1.0

    def for_samples(self, n: int) -> Chain:
        """By the maps that the pieces have for their parts of n samples."""
        pieces = zip(self.regions, self._shares.tolist(), strict=True)
        return Chain([Part(for_samples(region, round(share * n)), share) for region, share in pieces])

    @property
    def d(self) -> int:
        """Dimension of the unit box."""
        return self.regions[0].d

    def pull_back(self, u: Array) -> tuple[Array, Array]:
        """Points x (k, n) and the volume element (n,) at u (d, n)."""
        chosen = np.searchsorted(self._ends[1:-1], u[0], side="right")
        found: list[tuple[Indices, Array, Array]] = []
        for k in np.unique(chosen):
            at = np.flatnonzero(chosen == k)
            start, length = self._ends[k], self._ends[k + 1] - self._ends[k]
            inner = u[:, at]
            inner[0] = np.clip((inner[0] - start) / length, 0, 1 - 2.0**-53)
            x, element = self.regions[k].pull_back(inner)
            found.append((at, x, element / length))
        order = np.argsort(np.concatenate([at for at, _, _ in found]))
        x, element = (np.concatenate(values, axis=-1)[..., order] for values in list(zip(*found, strict=True))[1:])
        return x, element


@dataclass(frozen=True)
class Sum:
    """Estimates the sum of integrals over parts, from independent samples of each.

    Attributes
    ----------
    parts : sequence of Part
        All of one dimension.
    estimator : callable
        Takes a region and returns what estimates the integral over it from at most so many samples.
    """

    parts: Sequence[Part]
    estimator: Callable[[Region], Callable[[int], Estimate]]

    def __call__(self, n: int) -> Estimate:
        """An estimate from n samples at most, those of each part in proportion to its share."""
        joined = join(self.parts, n)
        if len(joined) == 1:
            return self.estimator(joined[0].region)(n)
        counts = proportional([part.share for part in joined], n)
        return total([self.estimator(part.region)(count) for part, count in zip(joined, counts, strict=True)])


def join(parts: Sequence[Part], n: int) -> list[Part]:
    """The parts, neighbours joined where they would have fewer than :data:`FEWEST` of n samples."""
    found: list[list[Part]] = [[]]
    for part in parts:
        if sum(p.share for p in found[-1]) * n >= FEWEST:
            found.append([])
        found[-1].append(part)
    if len(found) > 1 and sum(p.share for p in found[-1]) * n < FEWEST:
        last = found.pop()
        found[-1] += last
    return [group[0] if len(group) == 1 else Part(Chain(group), sum(p.share for p in group)) for group in found]


def proportional(shares: Sequence[float], n: int) -> list[int]:
    """Whole numbers with the sum n, each within 1 of its part of n: the largest remainders are rounded up."""
    exact = n * np.asarray(shares) / math.fsum(shares)
    counts = np.floor(exact).astype(int)
    counts[np.argsort(counts - exact, kind="stable")[: n - int(counts.sum())]] += 1
    return [int(c) for c in counts]


def total(estimates: Sequence[Estimate]) -> Estimate:
    """The sum of independent estimates.

    Notes
    -----
    Variances add. The degrees of freedom are those of Welch and Satterthwaite, (Σ e_k²)²/Σ(e_k⁴/ν_k), the fewest of all
    components.
    """
    mean = np.sum([e.mean for e in estimates], axis=0)
    errors = np.stack([e.error for e in estimates])
    power = powers(errors, axis=0)
    squares = np.square(np.ldexp(errors, -power))
    whole = squares.sum(axis=0)
    parts = np.divide(squares, whole, out=np.zeros_like(squares), where=whole > 0)
    freedom = np.array([1 / e.degrees_of_freedom for e in estimates])  # 0 where it is infinite
    with np.errstate(divide="ignore"):
        degrees = float(np.min(1 / (freedom @ np.square(parts))))
    deviations = [scaled_deviations(e) for e in estimates]
    known = [d for d in deviations if d is not None]
    rounding = norm(np.stack([e.rounding for e in estimates]), axis=0)
    return Estimate(
        mean,
        np.ldexp(np.sqrt(whole), power[0]),
        rounding,
        sum(e.n for e in estimates),
        degrees,
        tuple(_warnings(estimates, parts)),
        np.concatenate(known, axis=1) if len(known) == len(deviations) else None,
        _rules(estimates),
        terms=tuple(term for e in estimates for term in e.terms),
    )


def _rules(estimates: Sequence[Estimate]) -> tuple[str, ...]:
    """What predicted each component in the pieces, in their order, each rule once; nothing if a piece does not tell."""
    if not all(e.rules for e in estimates):
        return ()
    return tuple(", ".join(dict.fromkeys(names)) for names in zip(*(e.rules for e in estimates), strict=True))


def _warnings(estimates: Sequence[Estimate], parts: Array) -> list[IntegrationWarning]:
    """Components that are 0 in all pieces, and what there is to say of the pieces that make up most of the error."""
    found = {
        warning.kind: warning
        for estimate, part in zip(estimates, parts, strict=True)
        if not part.max() <= MOSTLY  # or it is not a number
        for warning in estimate.warnings
        if warning.kind != "zero"
    }
    zeros = [{c for w in e.warnings if w.kind == "zero" for c in w.details["components"]} for e in estimates]
    everywhere = set.intersection(*zeros)
    if everywhere:
        found["zero"] = diagnosis("zero", components=sorted(everywhere), of=len(estimates[0].mean))
    return list(found.values())
