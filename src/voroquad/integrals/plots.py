"""Pictures of results, with Matplotlib."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from .._support.arrays import Array
from .._support.figures import axes_for

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_trials(numbers: Sequence[int], means: Array, errors: Array, wanted: Array, ax: Axes | None) -> Axes:
    """Draw errors of trials (trials, fields) against their evaluations; see :meth:`QuadResult.plot`."""
    ax = axes_for(ax)
    off = np.abs(means - wanted)
    for field, error in enumerate(errors.T):
        name = f" of component {field}" if errors.shape[1] > 1 else ""
        (line,) = ax.plot(numbers, error, "o-", label=f"standard error{name}")
        ax.plot(numbers[:-1], off[:-1, field], "x", color=line.get_color(), label=f"difference from the result{name}")
    ax.set(xscale="log", yscale="log", xlabel="evaluations of a set")
    ax.legend(frameon=False)
    return ax


def draw_rules(texts: Sequence[str], ax: Axes | None) -> Axes:
    """Draw what share of each integrand the models predict; see :meth:`QuadResult.plot_rule`."""
    ax = axes_for(ax)
    shares = [_shares(text) for text in texts]
    names = sorted(dict.fromkeys(name for share in shares for name in share))
    left = np.zeros(len(texts))
    for name in names:
        widths = np.array([share.get(name, 0.0) for share in shares])
        ax.barh(np.arange(len(texts)), widths, left=left, label=name)
        left += widths
    ax.set(xlim=(0, 1), xlabel="share", yticks=range(len(texts)), ylabel="component")
    ax.invert_yaxis()
    ax.legend(frameon=False, bbox_to_anchor=(1, 1), loc="upper left")
    return ax


def _shares(text: str) -> dict[str, float]:
    """Shares of models in a text such as "order 1 in 26 of 64 strata, order 0 in 38" (rules/chosen_fits.py)."""
    found = re.findall(r"([^,|]+?) in (\d+)(?: of \d+ \w+)?(?:, |$| \| )", text)
    if not found:
        return {text: 1.0}
    counts = {name.strip(): int(count) for name, count in found}
    return {name: count / sum(counts.values()) for name, count in counts.items()}
