"""The studies that the command line offers, by name."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .._support.checks import one_of
from ..results.manifest import Results
from . import coverage_suite, genz_suite, run


@dataclass(frozen=True)
class Suite:
    """How to run a study, and what ``--json`` prints of it."""

    run: Callable[..., Results]
    summary: Callable[[Results, str | os.PathLike[str]], dict[str, Any]]


SUITES = {
    "talk": Suite(run.run_study, run.summary),
    "genz": Suite(genz_suite.run_genz, genz_suite.summary),
    "coverage": Suite(coverage_suite.run_coverage, coverage_suite.summary),
}


def suite(name: str) -> Suite:
    """The suite of this name."""
    return SUITES[one_of("suite", name, SUITES)]


def run_suite(name: str, out: str | os.PathLike[str], **options: Any) -> Results:
    """Run a suite with the options that are not None.

    Raises ValueError for an option that the suite does not have.
    """
    chosen = suite(name).run
    given = {option: value for option, value in options.items() if value is not None}
    for option in given.keys() - inspect.signature(chosen).parameters.keys():
        having = [other for other, s in SUITES.items() if option in inspect.signature(s.run).parameters]
        raise ValueError(f"the {name} suite has no option {option}; it is of the suite {' and '.join(having)}")
    return chosen(out, **given)
