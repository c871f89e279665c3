"""The mean of several independent estimates, and its standard error from their spread."""

from __future__ import annotations

import math

import numpy as np

from .estimates import Estimate


def across(found: list[Estimate], shared: int = 0) -> Estimate:
    """Of one estimate, itself; `shared` evaluations are common to all."""
    if len(found) == 1:
        return found[0]
    means = np.stack([e.mean for e in found])
    rounding = np.mean([e.rounding for e in found], axis=0)
    error = means.std(axis=0, ddof=1) / math.sqrt(len(found))
    warnings = {w.kind: w for e in found for w in e.warnings}
    n = sum(e.n - shared for e in found) + shared
    mean = means.mean(axis=0)
    return Estimate(
        mean, np.hypot(error, rounding), rounding, n, len(found) - 1, tuple(warnings.values()), (means - mean).T
    )
