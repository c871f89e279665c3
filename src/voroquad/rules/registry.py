"""Quadrature weights of a sample set: what each sample stands for."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._support.checks import one_of, point_array, refuse_transposed, thread_count
from ..designs.design import DESIGNS, ENGINE_DESIGNS, design_of
from ..designs.grids import grid_shape, stratum_index
from ..designs.sampling import SampleSet, SetKind, as_sample_set
from ..geometry.bounds import Bounds
from ..geometry.cells import cells
from ..geometry.probes import probed_measures
from . import exchange, strata_fits
from .boundary_control import boundary_control
from .cross_fit import weigh_replicates
from .kriging_rules import MOST
from .nearest_fits import weigh_uniform
from .strata_fits import weigh_independent, weigh_strata

DEBIAS = ("none", "bias-function", "exchange", "leave-one-out", "cross-fit", "auto")
MAX_ORDER = 8


def weights(
    samples: SampleSet | ArrayLike,
    *,
    order: int | str = 0,
    debias: str = "none",
    design: str | None = None,
    bounds: ArrayLike | None = None,
    threads: int | None = None,
) -> NDArray[np.float64]:
    """Quadrature weights of samples in the unit box, or in a box of other sides.

    Parameters
    ----------
    samples : SampleSet or array_like, (n,), (n, d) or (sets, n, d)
        What :func:`voroquad.sample` returned, or bare points of [0, 1)^d (of [0, 1]^d without a
        design), or of the box that `bounds` gives. A bare array of fewer points than dimensions is refused, since it
        may be (d, n); ``points[None]`` says that it is not.
    order : int, "kriging" or "auto"
        0: a sample stands for its Voronoi cell. p ≥ 1: polynomials of total degree p are integrated
        exactly; where a set has too few strata for p, the highest degree that it supports. "kriging":
        the best prediction of a random function, a polynomial of a degree that grows with n from 0 to 9 and
        what deviates from it. "auto": what
        :func:`voroquad.quad` takes.
    debias : {"none", "bias-function", "exchange", "leave-one-out", "cross-fit", "auto"}
        ``"none"``: the measures of the Voronoi cells; consistent, but biased near the border.
        ``"bias-function"``: the measures over the bias function G; unbiased, Σ w ≠ 1.
        ``"exchange"``: unbiased with Σ w = 1 and no loss of rate.
        ``"leave-one-out"``: unbiased with Σ w = 1. Order 0: the measures less what they owe to the
        border, as the values nearest among the other samples tell; weights may be negative. Higher
        orders: each sample corrects a polynomial fitted to the others around it.
        ``"cross-fit"``: unbiased; each of several independent sets corrects a reconstruction from the
        others. The estimate is the mean over the sets; its weights sum to 1, those of one set need not.
        ``"auto"``: an exactly unbiased choice for the design.
    design : str, optional
        How bare points were drawn: a sampler's name. Rules other than ``"none"`` must know. With `bounds`, how
        (x − low) / (high − low) was drawn.
    bounds : array_like, (d, 2) or (2,), optional
        Lower and upper end of each side of the box of bare points, in their unit; a single pair is for all axes. By
        default the unit box [0, 1]^d.
    threads : int, optional
        Number of threads; all processors by default. The result does not depend on it.

    Returns
    -------
    ndarray, (n,) or (sets, n)
        The weights w of the estimate Σ_i w_i f(x_i) of ∫ f over the box. Where they sum to 1 in the unit box, they sum
        to the volume of another box.

    Raises
    ------
    ValueError
        Points outside the box; an array that may be transposed; `bounds` that do not fit d, or that are given with a
        `SampleSet`, whose points are of the unit box; a combination of order, debias, design and d that
        has no rule (the message lists those that have).

    Notes
    -----
    A weight is what one gets by reconstructing the integrand from its samples and integrating the
    reconstruction: with f̂(y) = Σ_j φ_j(y) f_j, w_j = ∫ φ_j. Weights depend on positions only, so
    they are made once per set and serve every integrand. Order 0 takes the nearest sample's value
    for f̂, hence w_j = \\|V_j\\|, the measure of its Voronoi cell (see :func:`voroquad.cells`); above three
    dimensions it is counted with 256 quasi-random probes per sample, an average cell to 6 %.

    ==================  =======  ======  =============================  ========  ======
    debias              order    d       designs                        unbiased  Σ w = 1
    ==================  =======  ======  =============================  ========  ======
    ``none``            0        1 to 3  any                            no        yes
    ``none``            0        4 to 8  any; by probes                 no        yes
    ``bias-function``   0        1 to 3  uniform, stratified            yes       no
    ``exchange``        0        1       uniform, stratified            yes       yes
    ``leave-one-out``   0        1 to 3  uniform, stratified            yes       yes
    ``leave-one-out``   1 to 8   1 to 3  stratified, multi-jittered     yes       yes
    ``leave-one-out``   1 to 3   4 to 8  stratified, multi-jittered     yes       yes
    ``leave-one-out``   1 to 8   1 to 3  uniform                        yes       yes
    ``leave-one-out``   0 to 3   4 to 8  uniform                        yes       yes
    ``leave-one-out``   kriging  1 to 8  stratified, multi-jittered     yes       yes
    ``leave-one-out``   kriging  1 to 8  uniform, n ≤ 2048              yes       yes
    ``cross-fit``       1 to 8   1 to 3  randomised, two sets or more   yes       mean
    ``cross-fit``       1 to 3   4 to 8  randomised, two sets or more   yes       mean
    ``cross-fit``       kriging  1 to 8  randomised, two sets or more   yes       mean
    ==================  =======  ======  =============================  ========  ======

    In another box, ``debias="none"`` takes the Voronoi cells of that box, with distances in the unit of the points. All
    other rules scale each axis to [0, 1], which keeps them unbiased, and multiply the weights by the volume.

    References
    ----------
    J. J. Guo and E. Eisemann, "Geometric Sample Reweighting for Monte Carlo Integration", Computer Graphics Forum
    40(7), 109–119, 2021.

    Examples
    --------
    >>> import numpy as np, voroquad as vq
    >>> s = vq.sample("uniform", n=512, d=1, rng=7)
    >>> f = np.exp(s.points[:, 0])
    >>> w = vq.weights(s, debias="exchange")
    >>> bool(abs(w @ f - (np.e - 1)) < abs(f.mean() - (np.e - 1)) / 1000)
    True
    >>> vq.weights([[1.0, 0.5], [2.0, 0.5]], bounds=[(0, 4), (0, 1)])
    array([1.5, 2.5])
    """
    if bounds is not None:
        return _weights_in_box(samples, bounds, order, debias, design, thread_count(threads))
    samples = as_sample_set(samples, design)
    rule, order = choose_rule(samples.kind, order, debias)
    return rule.compute(samples, order, thread_count(threads))


def _weights_in_box(
    points: SampleSet | ArrayLike, bounds: ArrayLike, order: int | str, debias: str, design: str | None, threads: int
) -> NDArray[np.float64]:
    if isinstance(points, SampleSet):
        raise ValueError(
            f"bounds is for bare points, and those of a {points!r} are of the unit box; map them, "
            f"x = low + (high - low) * samples.points, and pass x with design={points.design!r}"
        )
    d = point_array(points).shape[-1]
    refuse_transposed(points, name="samples")
    box = Bounds(d, bounds)
    samples = as_sample_set(box.to_unit(points), design)
    rule, order = choose_rule(samples.kind, order, debias)
    if rule.in_box is not None:
        return rule.in_box(points, box, threads)
    return box.volume * rule.compute(samples, order, threads)


def choose_rule(kind: SetKind, order: int | str, debias: str) -> tuple[Rule, int | str]:
    """The rule and the order that `order` and `debias` mean for sets of a kind; ValueError if there are none."""
    one_of("debias", debias, DEBIAS)
    if isinstance(order, str):
        one_of("order", order, ("kriging", "auto"))
    elif not isinstance(order, int | np.integer) or isinstance(order, bool) or not 0 <= order <= MAX_ORDER:
        raise ValueError(f"order must be a whole number from 0 to {MAX_ORDER}, 'kriging' or 'auto', got {order!r}")
    else:
        order = int(order)
    if order == "auto":
        order = default_order(kind, debias)
    return find_rule(kind, order, debias), order


def default_order(kind: SetKind, debias: str) -> int | str:
    """The order that ``order="auto"`` means: that of :func:`voroquad.quad` where it has a rule, else 0.

    Independent samples leave gaps, which on a line are so wide beside the mean that predictions across them are wild:
    there it is 0, above kriging.
    """
    design = design_of(kind.design)
    if debias in ("auto", "leave-one-out") and design.gridded:
        return strata_fits.default_order(grid_shape(kind.n, kind.d)) if design.stratified else 0
    if debias in ("auto", "leave-one-out") and kind.design == "uniform" and kind.d > 1 and kind.n <= MOST:
        return "kriging"
    if debias in ("auto", "cross-fit") and design.randomised and kind.sets > 1:
        return "kriging"
    return 0


@dataclass(frozen=True)
class Rule:
    """A way to weigh samples and the sample sets it is for."""

    debias: str
    orders: Sequence[int | str]
    dimensions: range
    designs: tuple[str, ...] | None  # None: any
    compute: Callable[[SampleSet, Any, int], NDArray[np.float64]]
    fewest_sets: int = 1
    most: float = math.inf  # samples of a set
    #: Weights of points of a box, by rules that go by distances, which scaling the axes would change
    in_box: Callable[[Any, Bounds, int], NDArray[np.float64]] | None = None

    def covers(self, kind: SetKind, order: int | str) -> bool:
        """Whether the rule has a meaning for sets of this kind and this order."""
        return (
            order in self.orders
            and kind.d in self.dimensions
            and kind.n <= self.most
            and (self.designs is None or kind.design in self.designs)
            and kind.sets >= self.fewest_sets
        )

    @property
    def unbiased(self) -> bool:
        """Whether its mean is the integral of every integrand."""
        return self.debias != "none"

    def __str__(self) -> str:
        designs = "any design" if self.designs is None else "design " + " or ".join(self.designs)
        sets = "" if self.fewest_sets == 1 else f", points (sets, n, d) with {self.fewest_sets} sets or more"
        most = "" if self.most == math.inf else f", n ≤ {self.most}"
        orders = f"order {_span(self.orders)}, d = {_span(self.dimensions)}{most}"
        biased = "" if self.unbiased else " (biased near the border)"
        return f"debias={self.debias!r}{biased} with {orders}, {designs}{sets}"


def has_rule(kind: SetKind, order: int | str, debias: str) -> bool:
    """Whether there is a rule for sets of a kind."""
    return next(_matching(kind, order, debias), None) is not None


def find_rule(kind: SetKind, order: int | str, debias: str) -> Rule:
    """The rule for sets of a kind; ValueError with those nearest to it if there is none.

    Where an unbiased rule was asked for, biased ones are listed last and called so.
    """
    if (rule := next(_matching(kind, order, debias), None)) is not None:
        return rule
    near = [rule for rule in RULES if rule.debias == debias or rule.covers(kind, order)]
    if debias == "auto":
        near += [rule for rule in RULES if rule.unbiased and any(rule.covers(kind, p) for p in rule.orders)]
    near = sorted(dict.fromkeys(near or RULES), key=lambda rule: not rule.unbiased)
    raise ValueError(
        f"no rule for order={order!r}, debias={debias!r}, design {kind.design!r}, d = {kind.d}, "
        f"n = {kind.n}; there are: " + "; ".join(map(str, near))
    )


def _matching(kind: SetKind, order: int | str, debias: str) -> Iterator[Rule]:
    for rule in RULES:
        if (rule.unbiased if debias == "auto" else rule.debias == debias) and rule.covers(kind, order):
            yield rule


def _voronoi(samples: SampleSet, order: int, threads: int) -> NDArray[np.float64]:
    return cells(samples.points, threads=threads).measures


def _probed(samples: SampleSet, order: int, threads: int) -> NDArray[np.float64]:
    return probed_measures(samples.points, threads)


def _voronoi_in_box(points: ArrayLike, box: Bounds, threads: int) -> NDArray[np.float64]:
    return cells(points, bounds=box.sides, threads=threads).measures


def _probed_in_box(points: ArrayLike, box: Bounds, threads: int) -> NDArray[np.float64]:
    sides, _ = box.in_core
    return box.volume * probed_measures(box.to_core(points), threads, sides)


def _over_bias_function(samples: SampleSet, order: int, threads: int) -> NDArray[np.float64]:
    return exchange.by_bias_function(samples.points, _voronoi(samples, order, threads), samples.strata)


def _boundary_control(samples: SampleSet, order: int, threads: int) -> NDArray[np.float64]:
    return boundary_control(samples.points, _voronoi(samples, order, threads), samples.strata, threads)


def _exchange_uniform(samples: SampleSet, order: int, threads: int) -> NDArray[np.float64]:
    return exchange.exchange_uniform(samples.points)


def _exchange_stratified(samples: SampleSet, order: int, threads: int) -> NDArray[np.float64]:
    return _in_strata_order(samples, exchange.exchange_stratified)


def _in_strata_order(
    samples: SampleSet, rule: Callable[[NDArray[np.float64]], NDArray[np.float64]]
) -> NDArray[np.float64]:
    """Apply a rule that wants the points in C order of their strata."""
    assert samples.strata is not None
    order = np.argsort(stratum_index(samples.points, samples.strata), axis=-1)
    w = np.empty(samples.points.shape[:-1])
    np.put_along_axis(w, order, rule(np.take_along_axis(samples.points, order[..., None], axis=-2)), axis=-1)
    return w


def _span(entries: Sequence[int | str]) -> str:
    return repr(entries[0]) if len(entries) == 1 else f"{entries[0]} to {entries[-1]}"


_ALL = (*DESIGNS.values(), *ENGINE_DESIGNS.values())
RANDOMISED = tuple(design.name for design in _ALL if design.randomised)
STRATIFIED = tuple(design.name for design in _ALL if design.stratified)
INDEPENDENT = tuple(design.name for design in _ALL if design.independent)

KRIGING = ("kriging",)

#: Every rule there is. debias="auto" takes the first unbiased one that covers the set.
RULES = (
    Rule("exchange", range(1), range(1, 2), ("uniform",), _exchange_uniform),
    Rule("exchange", range(1), range(1, 2), ("stratified",), _exchange_stratified),
    Rule("leave-one-out", range(1), range(1, 4), INDEPENDENT, _boundary_control),
    Rule("leave-one-out", range(1, 9), range(1, 4), STRATIFIED, weigh_strata),
    Rule("leave-one-out", range(1, 4), range(4, 9), STRATIFIED, weigh_strata),
    Rule("leave-one-out", range(1, 9), range(1, 4), ("uniform",), weigh_uniform),
    Rule("leave-one-out", range(4), range(4, 9), ("uniform",), weigh_uniform),
    Rule("leave-one-out", KRIGING, range(1, 9), STRATIFIED, weigh_strata),
    Rule("leave-one-out", KRIGING, range(1, 9), ("uniform",), weigh_independent, most=MOST),
    Rule("cross-fit", range(1, 9), range(1, 4), RANDOMISED, weigh_replicates, fewest_sets=2),
    Rule("cross-fit", range(1, 4), range(4, 9), RANDOMISED, weigh_replicates, fewest_sets=2),
    Rule("cross-fit", KRIGING, range(1, 9), RANDOMISED, weigh_replicates, fewest_sets=2),
    Rule("bias-function", range(1), range(1, 4), INDEPENDENT, _over_bias_function),
    Rule("none", range(1), range(1, 4), None, _voronoi, in_box=_voronoi_in_box),
    Rule("none", range(1), range(4, 9), None, _probed, in_box=_probed_in_box),
)
