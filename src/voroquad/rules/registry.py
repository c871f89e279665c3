"""The table of rules, and the weights and fits that they give."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._support.arrays import Array
from .._support.checks import one_of, point_array, refuse_transposed, thread_count
from ..designs.design import DESIGNS, ENGINE_DESIGNS, design_of
from ..designs.grids import stratum_index
from ..designs.sampling import SampleSet, SetKind, as_sample_set
from ..geometry.bounds import Bounds, Periodic
from ..geometry.cells import cells
from ..geometry.probes import probed_measures
from . import exchange
from .boundary_control import boundary_control
from .chosen_fits import chooses, fit_by_choice
from .cross_fit import fit_replicates
from .defaults import default_methods
from .fit import Fit
from .kriging_rules import MOST, krige_independent
from .method import CHOICE, KRIGING, LOCAL_DEGREES, MEAN, ORDER_ZERO, VORONOI, Method, local, read_order
from .nearest_fits import fit_uniform
from .other_domains import Place, probed_in_box, weights_in
from .strata_fits import fit_strata

DEBIAS = ("none", "bias-function", "exchange", "leave-one-out", "cross-fit", "auto")


def weights(
    samples: SampleSet | ArrayLike,
    *,
    order: int | str = 0,
    debias: str = "none",
    design: str | None = None,
    bounds: ArrayLike | None = None,
    periodic: Periodic = False,
    domain: Any = None,
    cell: ArrayLike | None = None,
    threads: int | None = None,
) -> Array:
    """Quadrature weights of samples in the unit box, or in another domain.

    Parameters
    ----------
    samples : SampleSet or array_like, (n,), (n, d) or (sets, n, d)
        A result of :func:`voroquad.sample`, or bare points of [0, 1)^d ([0, 1]^d without a design) or of the box
        `bounds`. A bare array of fewer points than dimensions is refused, since it may be transposed, (d, n); pass
        ``points[None]`` if it is not.
    order : int, "kriging" or "auto"
        0: a sample stands for its Voronoi cell. p ≥ 1: polynomials of total degree p are integrated
        exactly; where a set has too few strata for p, the highest degree that it supports. "kriging": the best linear
        prediction of a random function that is the sum of a polynomial, whose degree grows with n from 0 to 9, and a
        Gaussian process. "auto": a choice that depends only on the design, the dimension and the number of samples.
    debias : {"none", "bias-function", "exchange", "leave-one-out", "cross-fit", "auto"}
        ``"none"``: the measures of the Voronoi cells; consistent, but biased near the border.
        ``"bias-function"``: the measures over the bias function G; unbiased, Σ w ≠ 1.
        ``"exchange"``: unbiased with Σ w = 1 and no loss of rate.
        ``"leave-one-out"``: unbiased with Σ w = 1. Order 0: the measures minus an estimate of their bias at the border
        from the nearest other samples; weights may be negative. Higher
        orders: each sample corrects a polynomial fitted to the others around it.
        ``"cross-fit"``: unbiased; each of several independent sets corrects a reconstruction from the
        others. The estimate is the mean over the sets. Its weights sum to 1, but those of a single set need not.
        ``"auto"``: an exactly unbiased choice for the design.
    design : str, optional
        The name of the sampler by which bare points were drawn. It is needed for all rules except ``"none"``. With
        `bounds`, it refers to the points (x − low) / (high − low).
    bounds : array_like, (d, 2) or (2,), optional
        Lower and upper end of each side of the box of bare points, in their units; a single pair applies to all axes.
        By default the unit box [0, 1]^d.
    periodic : bool or sequence of bool, (d,)
        Whether opposite faces of the box are the same place, for all axes or for each, as in :func:`voroquad.cells`.
    domain, cell : optional
        Another domain of bare points: a convex polygon or polytope, a polygon with holes, a :class:`voroquad.Ball`,
        ``"ball"`` or ``"cylinder"``; or lattice vectors (d, d) that repeat the points; all as in
        :func:`voroquad.cells`.
    threads : int, optional
        Number of threads; all processors by default. The result does not depend on it.

    Returns
    -------
    ndarray, (n,) or (sets, n)
        The weights w of the estimate Σ_i w_i f(x_i) of ∫ f over the domain. If the weights of a rule sum to 1 in the
        unit box, they sum to the volume of another box or domain.

    Raises
    ------
    ValueError
        A point is outside the domain; the array may be transposed; `bounds` do not match d; another domain is given
        with a `SampleSet`, whose points are in the unit box; there is no rule for the combination of order, debias,
        design, d and domain (the message lists those that exist).
    ImportError
        Shapely is not installed, and `domain` needs it.

    Notes
    -----
    The integrand is reconstructed from its samples and the reconstruction is integrated: if f̂(y) = Σ_j φ_j(y) f_j,
    then w_j = ∫ φ_j. Weights depend only on positions, so they are computed once per set and serve every integrand. For
    order 0, f̂(y) is the value of the nearest sample, hence w_j = \\|V_j\\|, the measure of its Voronoi cell (see
    :func:`voroquad.cells`). Above three dimensions it is estimated with 256 quasi-random probes per sample, to 6 % for
    an average cell.

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
    ``leave-one-out``   1 to 3   4 to 8  uniform                        yes       yes
    ``leave-one-out``   0        4 to 8  uniform                        yes       yes
    ``leave-one-out``   kriging  any     stratified, multi-jittered     yes       yes
    ``leave-one-out``   kriging  any     uniform, n ≤ 2048              yes       yes
    ``cross-fit``       1 to 8   1 to 3  randomised, two sets or more   yes       mean
    ``cross-fit``       1 to 3   4 to 8  randomised, two sets or more   yes       mean
    ``cross-fit``       kriging  any     randomised, two sets or more   yes       mean
    ==================  =======  ======  =============================  ========  ======

    In another box, ``debias="none"`` uses the Voronoi cells of that box, with distances in the units of the points. All
    other rules scale each axis to [0, 1], which does not affect unbiasedness, and multiply the weights by the volume.

    With `periodic`, `domain` or `cell` there is order 0: the measures of the cells. A lattice, or a box whose axes are
    all periodic, has no border. There the measures of uniform points are unbiased as they are: ``debias="auto"``
    returns them for the design ``"uniform"``, and for d = 1 also for ``"stratified"``. In other domains, and where only
    some axes are periodic, they are biased near the border.

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
    >>> vq.weights([[0.5, 0.25], [0.5, 1.0]], domain=[(0, 0), (2, 0), (0, 2)]).round(6)
    array([1.054688, 0.945312])
    >>> vq.weights(vq.sample("uniform", n=8, d=2, rng=1), periodic=True, debias="auto").sum().round(12)
    np.float64(1.0)
    """
    place = Place(bounds, periodic, domain, cell)
    if not place.is_box:
        one_of("debias", debias, DEBIAS)
        return weights_in(samples, place, order, debias, design, thread_count(threads))
    if bounds is not None:
        return _weights_in_box(samples, bounds, order, debias, design, thread_count(threads))
    samples = as_sample_set(samples, design)
    return choose_rule(samples.kind, order, debias).weigh(samples, thread_count(threads))


def _weights_in_box(
    points: SampleSet | ArrayLike, bounds: ArrayLike, order: int | str, debias: str, design: str | None, threads: int
) -> Array:
    if isinstance(points, SampleSet):
        raise ValueError(
            f"bounds is for bare points, and those of a {points!r} are of the unit box; map them, "
            f"x = low + (high - low) * samples.points, and pass x with design={points.design!r}"
        )
    d = point_array(points).shape[-1]
    refuse_transposed(points, name="samples")
    box = Bounds(d, bounds)
    samples = as_sample_set(box.to_unit(points), design)
    rule = choose_rule(samples.kind, order, debias)
    if rule.in_box is not None:
        return rule.in_box(points, box, threads)
    return box.volume * rule.weigh(samples, threads)


#: Fits sets of samples by a method on some threads; the values are (sets, fields, n), those of integrands.
Fitter = Callable[[SampleSet, Method, int, Array | None], Fit]
#: Weights of points in a box, for rules that use distances, which scaling the axes would change.
InBox = Callable[[ArrayLike, Bounds, int], Array]


@dataclass(frozen=True)
class Rule:
    """A way to weight samples: a method to reconstruct the integrand, and a way to remove its bias."""

    debias: str
    method: Method
    fitter: Fitter
    in_box: InBox | None = None

    def fit(self, samples: SampleSet, threads: int, values: Array | None = None) -> Fit:
        """Weights of sample sets and, with values (sets, fields, n) of integrands, the data for their errors."""
        return self.fitter(samples, self.method, threads, values)

    def weigh(self, samples: SampleSet, threads: int) -> Array:
        """Weights (n,) or (sets, n)."""
        return self.fit(samples, threads).weights.reshape(samples.points.shape[:-1])


@dataclass(frozen=True)
class Family:
    """Rules that differ in their method only, and the sample sets they are for."""

    debias: str
    methods: tuple[Method, ...]
    dimensions: range
    designs: tuple[str, ...] | None  # None: any
    fitter: Fitter
    fewest_sets: int = 1
    most: float = math.inf  # samples of a set
    in_box: InBox | None = None

    def covers(self, kind: SetKind, method: Method) -> bool:
        """Whether the rule of this method has a meaning for sets of this kind."""
        return (
            method in self.methods
            and kind.d in self.dimensions
            and kind.n <= self.most
            and (self.designs is None or kind.design in self.designs)
            and kind.sets >= self.fewest_sets
        )

    def rule(self, method: Method) -> Rule:
        """The rule of a method."""
        return Rule(self.debias, method, self.fitter, self.in_box)

    @property
    def unbiased(self) -> bool:
        """Whether the mean of its rules is the integral of every integrand."""
        return self.debias != "none"

    def __str__(self) -> str:
        designs = "any design" if self.designs is None else "design " + " or ".join(self.designs)
        sets = "" if self.fewest_sets == 1 else f", points (sets, n, d) with {self.fewest_sets} sets or more"
        most = "" if self.most == math.inf else f", n ≤ {self.most}"
        orders = f"order {span([m.order for m in self.methods])}, d = {span(self.dimensions)}{most}"
        biased = "" if self.unbiased else " (biased near the border)"
        return f"debias={self.debias!r}{biased} with {orders}, {designs}{sets}"


def span(entries: Sequence[int | str]) -> str:
    """Entries in short: "2", "1 to 8", "1 and more"."""
    if isinstance(entries, range) and entries.stop == ANY.stop:
        return f"{entries[0]} and more"
    return repr(entries[0]) if len(entries) == 1 else f"{entries[0]} to {entries[-1]}"


def choose_rule(kind: SetKind, order: int | str, debias: str) -> Rule:
    """The rule that `order` and `debias` name, for sets of a kind; ValueError if there is none."""
    one_of("debias", debias, DEBIAS)
    return find_rule(kind, read_order(order) or default_methods(kind, debias), debias)


def integration_rule(kind: SetKind, methods: tuple[Method, ...], debias: str) -> Rule:
    """The rule of :func:`voroquad.quad`: that of :func:`weights`, except where quad needs the error of a single set.

    Order 0 is the plain mean of each set: the constants that are predicted and those that are subtracted cancel. A
    single set of independent or quasi-random points has the plain mean by default, too.
    """
    if not methods and tells_own_error(kind.design, debias) and chooses(kind):
        return Rule("leave-one-out", CHOICE, fit_by_choice)
    if tells_own_error(kind.design, debias):
        return find_rule(kind, (methods or default_methods(kind, debias))[-1:], "leave-one-out", (PLAIN, *RULES))
    corrected = debias in ("auto", "cross-fit")
    if corrected and kind.sets > 1 and methods != ORDER_ZERO:
        return find_rule(kind, methods or (KRIGING,), "cross-fit")
    plain = not has_rule(kind, methods, debias) if methods == ORDER_ZERO else not methods and debias == "auto"
    if corrected and plain:
        return Rule("cross-fit", MEAN, _equal)
    return find_rule(kind, methods or ORDER_ZERO, debias)


def tells_own_error(design: str, debias: str) -> bool:
    """Whether the rule of :func:`voroquad.quad` gives an error from a single set of a design."""
    return debias in ("auto", "leave-one-out") and design_of(design).stratified


def has_rule(kind: SetKind, methods: Sequence[Method], debias: str) -> bool:
    """Whether there is a rule for sets of a kind."""
    return any(_matching(kind, methods, debias))


def find_rule(kind: SetKind, methods: Sequence[Method], debias: str, families: Sequence[Family] | None = None) -> Rule:
    """The rule for sets of a kind, of the first method that has one; ValueError that lists similar rules if none has.

    Biased rules are listed last, and named as biased.
    """
    families = RULES if families is None else families
    if (rule := next(_matching(kind, methods, debias, families), None)) is not None:
        return rule
    near = [family for family in RULES if family.debias == debias or any(family.covers(kind, m) for m in methods)]
    if debias == "auto":
        near += [family for family in RULES if family.unbiased and any(family.covers(kind, m) for m in family.methods)]
    near = sorted(dict.fromkeys(near or RULES), key=lambda family: not family.unbiased)
    raise ValueError(
        f"no rule for order={methods[0].order!r}, debias={debias!r}, design {kind.design!r}, d = {kind.d}, "
        f"n = {kind.n}; there are: " + "; ".join(map(str, near))
    )


def _matching(
    kind: SetKind, methods: Sequence[Method], debias: str, families: Sequence[Family] | None = None
) -> Iterator[Rule]:
    for method in methods:
        for family in RULES if families is None else families:
            wanted = family.unbiased if debias == "auto" else family.debias == debias
            if wanted and family.covers(kind, method):
                yield family.rule(method)


# ---------------------------------------------------------------------- fits of rules without residuals


def _voronoi(samples: SampleSet, method: Method, threads: int, values: Array | None = None) -> Fit:
    return Fit(cells(samples.batch, threads=threads).measures)


def _probed(samples: SampleSet, method: Method, threads: int, values: Array | None = None) -> Fit:
    return Fit(probed_measures(samples.batch, threads))


def _voronoi_in_box(points: ArrayLike, box: Bounds, threads: int) -> Array:
    return cells(points, bounds=box.sides, threads=threads).measures


def _over_bias_function(samples: SampleSet, method: Method, threads: int, values: Array | None = None) -> Fit:
    measures = _voronoi(samples, method, threads).weights
    return Fit(exchange.by_bias_function(samples.batch, measures, samples.strata))


def _boundary_control(samples: SampleSet, method: Method, threads: int, values: Array | None = None) -> Fit:
    measures = _voronoi(samples, method, threads).weights
    return Fit(boundary_control(samples.batch, measures, samples.strata, threads))


def _exchange_uniform(samples: SampleSet, method: Method, threads: int, values: Array | None = None) -> Fit:
    return Fit(exchange.exchange_uniform(samples.batch, threads))


def _exchange_stratified(samples: SampleSet, method: Method, threads: int, values: Array | None = None) -> Fit:
    return Fit(_in_strata_order(samples, partial(exchange.exchange_stratified, threads=threads)))


def _krige_independent(samples: SampleSet, method: Method, threads: int, values: Array | None = None) -> Fit:
    return Fit(krige_independent(samples.batch, threads))


def _equal(samples: SampleSet, method: Method, threads: int, values: Array | None = None) -> Fit:
    return Fit(np.full(samples.batch.shape[:2], 1 / samples.n))


def _in_strata_order(samples: SampleSet, rule: Callable[[Array], Array]) -> Array:
    """Apply a rule that takes the points in C order of their strata."""
    assert samples.strata is not None
    points = samples.batch
    order = np.argsort(stratum_index(points, samples.strata), axis=-1)
    w = np.empty(points.shape[:-1])
    np.put_along_axis(w, order, rule(np.take_along_axis(points, order[..., None], axis=-2)), axis=-1)
    return w


# ---------------------------------------------------------------------- the table

_ALL = (*DESIGNS.values(), *ENGINE_DESIGNS.values())
RANDOMISED = tuple(design.name for design in _ALL if design.randomised)
STRATIFIED = tuple(design.name for design in _ALL if design.stratified)
INDEPENDENT = tuple(design.name for design in _ALL if design.independent)

#: Every number of dimensions
ANY = range(1, sys.maxsize)


def _local_families(debias: str, designs: tuple[str, ...], fitter: Fitter, fewest_sets: int = 1) -> tuple[Family, ...]:
    """Local polynomials of degree 1 up to the highest of each dimension."""
    return tuple(
        Family(debias, tuple(local(p) for p in range(1, highest + 1)), dimensions, designs, fitter, fewest_sets)
        for dimensions, highest in LOCAL_DEGREES
    )


#: Every rule there is. debias="auto" takes the first unbiased one that covers the set.
RULES = (
    Family("exchange", (VORONOI,), range(1, 2), ("uniform",), _exchange_uniform),
    Family("exchange", (VORONOI,), range(1, 2), ("stratified",), _exchange_stratified),
    Family("leave-one-out", (VORONOI,), range(1, 4), INDEPENDENT, _boundary_control),
    *_local_families("leave-one-out", STRATIFIED, fit_strata),
    *_local_families("leave-one-out", ("uniform",), fit_uniform),
    Family("leave-one-out", (local(0),), range(4, 9), ("uniform",), fit_uniform),
    Family("leave-one-out", (KRIGING,), ANY, STRATIFIED, fit_strata),
    Family("leave-one-out", (KRIGING,), ANY, ("uniform",), _krige_independent, most=MOST),
    *_local_families("cross-fit", RANDOMISED, fit_replicates, fewest_sets=2),
    Family("cross-fit", (KRIGING,), ANY, RANDOMISED, fit_replicates, fewest_sets=2),
    Family("bias-function", (VORONOI,), range(1, 4), INDEPENDENT, _over_bias_function),
    Family("none", (VORONOI,), range(1, 4), None, _voronoi, in_box=_voronoi_in_box),
    Family("none", (VORONOI,), range(4, 9), None, _probed, in_box=probed_in_box),
)

#: Plain stratification: constants, predicted and corrected, are the mean, with an error for :func:`integration_rule`.
PLAIN = Family("leave-one-out", (local(0),), ANY, STRATIFIED, fit_strata)
