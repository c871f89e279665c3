"""The mean of several independent estimates, and its standard error from their spread."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from .estimates import Estimate
from .units import deviation


def across(found: list[Estimate], shared: int = 0) -> Estimate:
    """Of one estimate, itself; `shared` evaluations are common to all."""
    if len(found) == 1:
        return found[0]
    means = np.stack([e.mean for e in found])
    rounding = np.mean([e.rounding for e in found], axis=0)
    error = deviation(means, axis=0) / math.sqrt(len(found))
    warnings = {w.kind: w for e in found for w in e.warnings}
    n = sum(e.n - shared for e in found) + shared
    mean = means.mean(axis=0)
    error, deviations = np.hypot(error, rounding), (means - mean).T
    rules = found[0].rules if len({e.rules for e in found}) == 1 else ()
    terms = tuple(replace(t, weights=t.weights / len(found)) for e in found for t in e.terms)
    given = tuple(warnings.values())
    return Estimate(mean, error, rounding, n, len(found) - 1, given, deviations, rules, terms=terms)
