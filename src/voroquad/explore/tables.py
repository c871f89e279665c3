"""The numbers on the page, as HTML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

from .._support.arrays import Array
from .._support.numbers import scientific
from .experiment import Experiment, Replicates
from .integrands import Problem
from .style import RULE_COLORS


def estimate_table(problem: Problem, w: Array, f: Array) -> str:
    """The estimate of weights (n,) and values (n,) beside the truth."""
    truth, value = problem.integrand.integral, float(w @ f)
    doubt = f" ± {number(problem.uncertainty, 1)}" if problem.uncertainty > 1e-12 else ""
    rows = {
        "truth": [number(truth, 10) + doubt],
        "error": [number(value - truth, 3)],
        "error of equal weights": [number(f.mean() - truth, 3)],
        "Σ w": [number(w.sum(), 6)],
        "N w": [f"{number(len(w) * w.min(), 3)} to {number(len(w) * w.max(), 3)}"],
    }
    return f'<p class="number" data-estimate="{value!r}">Î = {number(value, 8)}</p>' + _table(rows)


def statistics_table(experiment: Experiment, slopes: Sequence[float | None]) -> str:
    """Bias, standard deviation and mean squared error of each histogram."""
    head = "".join(
        f'<th scope="col"><span class="key" style="background:{color}"></span>{name}'
        f"<small>{escape(replicates.method.name)}</small></th>"
        for name, color, replicates in zip("AB", RULE_COLORS, experiment.histograms, strict=True)
    )
    columns = [_column(r, slope) for r, slope in zip(experiment.histograms, slopes, strict=True)]
    return _table({row: [column[row] for column in columns] for row in columns[0]}, head)


def number(value: float, digits: int) -> str:
    """A number for people to read: 0.0123, −4.5·10⁻⁷.

    Examples
    --------
    >>> from voroquad.explore.tables import number
    >>> number(-0.0123456, 3), number(4.56e-7, 2), number(float("nan"), 3)
    ('−0.0123', '4.6·10⁻⁷', '–')
    """
    if not np.isfinite(value):
        return "–"
    text = f"{value:.{digits}g}"
    if value != 0 and not 1e-3 <= abs(value) < 1e6:
        text = scientific(value, digits)
    return text.replace("-", "−")


def _column(replicates: Replicates, slope: float | None) -> dict[str, str]:
    m, errors = replicates.measured(), replicates.errors
    return {
        f"sets of {replicates.n}": f"{len(errors):,}",
        "bias": f"{number(m.bias, 3)} ± {number(m.bias_error, 1)}" if m else "",
        "standard deviation": number(errors.std(ddof=1), 4) if m else "",
        "mean squared error": f"{number(m.mse, 3)} ± {number(m.mse_error, 1)}" if m else "",
        "slope against N": "" if slope is None else number(slope, 3),
    }


def _table(rows: Mapping[str, Sequence[str]], head: str = "") -> str:
    body = "".join(
        f'<tr><th scope="row">{name}</th>' + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"
        for name, cells in rows.items()
    )
    return f"<table>{f'<thead><tr><td></td>{head}</tr></thead>' if head else ''}<tbody>{body}</tbody></table>"
