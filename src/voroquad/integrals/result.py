"""Results of :func:`voroquad.quad`, and how they are printed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.special import stdtrit

from .._support.arrays import Array
from .._support.html import table
from .._support.numbers import with_uncertainty
from .adaptation import Adaptation
from .components import FEWEST_ERRORS, Components, Linked
from .diagnostics import ADVICE, IntegrationWarning, diagnosis, issue
from .estimates import Estimate
from .evaluation import Function
from .gradients import sums
from .library import Library, to_numpy
from .plots import draw_rules, draw_trials
from .structures import mapped

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class ConfidenceInterval(NamedTuple):
    """Ends of an interval, in the shape or structure of func's values; of complex ones both parts."""

    low: Any
    high: Any


class Trial(NamedTuple):
    """The estimate of one set: its evaluations, and value and standard error of the components, (fields,).

    Real and imaginary part of a complex number are two components.
    """

    n_evaluations: int
    integral: Array
    standard_error: Array


def check_level(level: Any) -> float:
    """The level of an interval, if it is one."""
    if not isinstance(level, int | float | np.number) or not 0 < level < 1:
        raise ValueError(f"level must be between 0 and 1, got {level!r}; 0.95 is the usual one")
    return float(level)


@dataclass(frozen=True)
class QuadResult:
    """Result of :func:`quad`. It prints as a value with its uncertainty, such as 2.66613(4).

    It unpacks into value and error, ``integral, error = vq.quad(...)``, like results of `scipy.integrate`.

    Attributes
    ----------
    integral : float, complex, array, or dict or tuple of these
        The estimate, in the shape or structure of func's values. Where these are of PyTorch or JAX and have gradients,
        so has it.
    standard_error : as integral
        Its standard error. That of a complex estimate is complex: its parts are the errors of the real and the
        imaginary part, as in `scipy.integrate.quad`.
    n_evaluations : int
        Number of points func was evaluated at.
    degrees_of_freedom : float
        Degrees of freedom of Student's t distribution in :meth:`confidence_interval`. If there are several components,
        the fewest of any component.
    rule : str, array of str, or dict or tuple of these
        The models that predicted the integrand, in the structure of func's values; empty if they are not known. Each
        model is followed by the number of strata, colours or replicates that chose it. If the real and the imaginary
        part of a component have different models, a bar separates them.
    warnings : tuple of IntegrationWarning
        The warnings of the call, each with its ``kind`` and ``details``.
    trials : tuple of Trial
        The sets of tolerance mode in their order, each with ``n_evaluations``, ``integral`` and ``standard_error`` of
        its components. The last one gives the result. Without a tolerance it is the only one.
    adaptation : Adaptation or None
        The result of the pilot if ``adapt`` was given: ``adapted``, ``nodes`` (d, 25), the corners ``low`` and ``high``
        (leaves, d) of the boxes, ``concentration`` and ``n_pilot``.

    Examples
    --------
    >>> import voroquad as vq
    >>> integral, error = vq.quad(lambda x: x[0] ** 2, 0, 1, rng=7)
    >>> round(integral, 12), error < 1e-12
    (0.333333333333, True)
    """

    integral: Any
    standard_error: Any
    n_evaluations: int
    degrees_of_freedom: float = field(default=math.inf, repr=False)
    warnings: tuple[IntegrationWarning, ...] = field(default=(), repr=False)
    rule: Any = field(default="", repr=False, compare=False)
    adaptation: Adaptation | None = field(default=None, repr=False, compare=False)
    trials: tuple[Trial, ...] = field(default=(), repr=False, compare=False)
    _components: Components | None = field(default=None, repr=False, compare=False)
    _library: Library = field(default=Library(np.empty(0)), repr=False, compare=False)

    @classmethod
    def of(cls, estimate: Estimate, function: Function) -> QuadResult:
        """The result that an estimate of a function's integrals makes, in the structure of the function's values."""
        assert function.form is not None
        integral, error = (function.form.assemble(x, function.library.number) for x in (estimate.mean, estimate.error))
        if estimate.terms:
            plain = [function.library.number(leaf) for leaf in function.form.leaves(estimate.mean)]
            integral = function.form.build(sums(estimate.terms, function.tape, function.form, plain))
        components = Components.of(estimate, function.form)
        without_error = ~np.isnan(estimate.mean) & ~np.isfinite(estimate.error)
        if without_error.any() and _reliable(function.diagnoses.all()):
            function.diagnoses.add(diagnosis("no-finite-error"))
        warnings = function.diagnoses.all()
        rule = function.form.texts(estimate.rules) if estimate.rules else ""
        freedom = estimate.degrees_of_freedom
        trials = tuple(Trial(e.n, e.mean, e.error) for e in estimate.trials or (estimate,))
        return cls(integral, error, estimate.n, freedom, warnings, rule, None, trials, components, function.library)

    @property
    def covariance(self) -> Any:
        r"""Covariance of the estimates of the components, from the samples that they share.

        For an integral of shape s its shape is (\*s, \*s), and it is a float for a single integral. For a dict or tuple
        it is a matrix over the components of all arrays, one after the other. For complex components it is E δ_k
        conj(δ_l). Its diagonal has the squares of the standard errors. With few degrees of freedom it is as uncertain
        as these, and it is singular if there are more components than degrees of freedom.
        """
        return self._library.number(self._linked().covariance())

    def ratio(self, i: Any, j: Any) -> QuadResult:
        """Component i of the integral over component j, with its standard error.

        Parameters
        ----------
        i, j : int, tuple, or key
            Indices of an array, as in ``integral[i]``. For a dict or tuple a key or a position, or a tuple of one and
            further indices, such as ``("moments", 0)``. Arrays are divided elementwise.

        Returns
        -------
        QuadResult

        Raises
        ------
        ValueError
            There is no such component.

        Warns
        -----
        IntegrationWarning
            The denominator is 0 within four of its standard errors.

        Notes
        -----
        The error is that of the delta method: for q = a/b it is the error of the combination (a − q b)/b, in which
        common errors cancel. The bias of a ratio is about q (Var b / b² − Cov(a, b) / (a b)), of the order of the
        squared error.

        Examples
        --------
        The mean of x for the density proportional to x² e^(−x):

        >>> import numpy as np, voroquad as vq
        >>> r = vq.quad(lambda x: x[0] ** 2 * np.exp(-x[0]) * np.stack([x[0], 1 + 0 * x[0]]), 0, np.inf, rng=7)
        >>> q = r.ratio(0, 1)
        >>> bool(abs(q.integral - 3) < 5 * q.standard_error < 1e-6)
        True
        """
        linked = self._linked()
        below = linked.part("j", j)
        ratio = self._made(linked.part("i", i).over(below))
        if not below.vague:
            return ratio
        warning = diagnosis("vague-denominator", within_errors=FEWEST_ERRORS)
        issue(warning)
        return replace(ratio, warnings=(*ratio.warnings, warning))

    def linear(self, c: Any) -> QuadResult:
        """The sum of all components times coefficients c, with its standard error.

        Parameters
        ----------
        c : array_like, or dict or tuple of such
            Coefficients in the shape or structure of the integral. Further axes may precede that shape, with a sum for
            each entry.

        Returns
        -------
        QuadResult

        Raises
        ------
        ValueError
            c has another shape or structure.

        Examples
        --------
        The variance of a sum, which is not the sum of the variances:

        >>> import numpy as np, voroquad as vq
        >>> r = vq.quad(lambda x: np.stack([x[0] > 0.3, x[0] <= 0.3]), 0, 1, n_points=64, rng=7)
        >>> total = r.linear([1, 1])
        >>> round(total.integral, 12), bool(total.standard_error < 1e-12 < r.standard_error[0])
        (1.0, True)
        """
        given = mapped(lambda leaf: np.asarray(to_numpy(leaf)), c) if isinstance(c, dict | tuple) else to_numpy(c)
        return self._made(self._linked().linear(given))

    def _linked(self) -> Components:
        if self._components is None:
            raise ValueError('the covariances of this result are not known; use method="auto"')
        return self._components

    def _made(self, linked: Linked) -> QuadResult:
        """What was made of the components, as a result."""
        value, error = (self._library.number(x) for x in (linked.value, linked.error))
        return QuadResult(value, error, self.n_evaluations, self.degrees_of_freedom, self.warnings)

    @property
    def success(self) -> bool:
        """Whether value and error appear reliable and the tolerance, if any, is met."""
        return _reliable(self.warnings)

    def confidence_interval(self, level: float = 0.95) -> ConfidenceInterval:
        """The interval that contains the integral in a fraction `level` of repetitions.

        Raises ValueError for a level outside (0, 1).
        """
        level = check_level(level)
        factor = float(stdtrit(self.degrees_of_freedom, (1 + level) / 2))
        low = mapped(lambda value, error: value - factor * error, self.integral, self.standard_error)
        high = mapped(lambda value, error: value + factor * error, self.integral, self.standard_error)
        return ConfidenceInterval(low, high)

    def plot(self, *, ax: Axes | None = None) -> Axes:
        """Draw with Matplotlib how the error fell: the standard errors of all sets against their numbers of
        evaluations.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw; a new figure by default.

        Returns
        -------
        matplotlib.axes.Axes
            With logarithmic scales. Crosses show the differences between earlier sets and the result.

        Raises
        ------
        ValueError
            The result comes from :meth:`ratio` or :meth:`linear`.
        ImportError
            Matplotlib is not installed; the extra ``study`` brings it.
        """
        if not self.trials:
            raise ValueError("this result was computed from other results and has no sets to plot; plot those")
        means, errors = (np.array([trial[k] for trial in self.trials]) for k in (1, 2))
        return draw_trials([trial.n_evaluations for trial in self.trials], means, errors, means[-1], ax)

    def plot_rule(self, *, ax: Axes | None = None) -> Axes:
        """Draw with Matplotlib which models predicted the integrand, as shares of the strata or colours.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw; a new figure by default.

        Returns
        -------
        matplotlib.axes.Axes
            A bar for each component.

        Raises
        ------
        ValueError
            The rule of the result is not known (:attr:`rule` is empty).
        ImportError
            Matplotlib is not installed; the extra ``study`` brings it.
        """
        if isinstance(self.rule, str) and not self.rule:
            raise ValueError('the rule of this result is not known, so it cannot be plotted; use method="auto"')
        return draw_rules(_texts(self.rule), ax)

    def _repr_html_(self) -> str:
        low, high = self.confidence_interval()
        rows = [
            ("integral", self),
            ("95 % interval", f"{low} to {high}"),
            ("evaluations", f"{self.n_evaluations:,}"),
            ("predicted by", "\n".join(dict.fromkeys(_texts(self.rule)))),
            ("warnings", "\n".join(map(str, self.warnings)) or "none"),
        ]
        return table("QuadResult", [row for row in rows if row[1] != ""])

    def __iter__(self) -> Iterator[Any]:
        return iter((self.integral, self.standard_error))

    def __str__(self) -> str:
        return str(mapped(_Text.of, self.integral, self.standard_error))


def _reliable(warnings: tuple[IntegrationWarning, ...]) -> bool:
    return all(warning.kind in ADVICE for warning in warnings)


def _texts(rule: Any) -> list[str]:
    """The texts of a rule, whatever structure they stand in."""
    parts = rule.values() if isinstance(rule, dict) else rule if isinstance(rule, tuple) else None
    return list(np.ravel(np.asarray(rule, dtype=object))) if parts is None else [t for p in parts for t in _texts(p)]


class _Text(str):
    """A text that shows itself without quotes, within dicts and tuples too."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)

    @classmethod
    def of(cls, integral: Any, standard_error: Any) -> _Text:
        """Values with their uncertainties, in the shape of the array."""
        value, error = np.asarray(to_numpy(integral)), np.asarray(to_numpy(standard_error))
        texts = [_with_uncertainty(v, e) for v, e in zip(value.flat, error.flat, strict=True)]
        if value.ndim == 0:
            return cls(texts[0])
        return cls(np.array2string(np.array(texts).reshape(value.shape), formatter={"all": str}))


def _with_uncertainty(value: Any, error: Any) -> str:
    """As :func:`with_uncertainty`; a complex number as 1.50(2)+0.3(1)j."""
    if not np.iscomplexobj(value):
        return with_uncertainty(value, error)
    real, imaginary = with_uncertainty(value.real, error.real), with_uncertainty(value.imag, error.imag)
    return f"{real}{'' if imaginary.startswith('-') else '+'}{imaginary}j"
