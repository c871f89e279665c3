"""How often the error bar of vq.quad holds, how wide it is and whether it warns, on integrands that are hard for it."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .._support.arrays import Array
from .._support.checks import positive_int
from .._support.files import atomic_directory
from .._support.progress import progress_bar
from .._support.units import ONE_PROCESS, Advance, Pool, Series
from .._support.version import __version__
from ..integrals.diagnostics import ADVICE, IntegrationWarning
from ..integrals.quad import quad
from ..results.manifest import Results, Section, Table
from .command import study_command
from .coverage_integrands import Case, cases
from .drawing import read_rows, write_rows
from .figures_coverage import draw_coverage

#: Least number of evaluations by dimension; sizes are it times powers of four.
LEAST = {1: 64, 2: 64, 3: 256, 4: 256, 5: 512, 6: 512}

LEVEL = 0.95
_REPLICATES_OF_A_UNIT = 20
_ROUNDING = 2.0**-52  # relative to the integral of |f|: a smaller error is none
_OF_WAVES = 2 / np.pi  # the integral of |f| for waves, which change sign


@dataclass(frozen=True)
class CoverageSettings:
    """What must be equal for cells to be comparable."""

    replicates: int
    seed: int


@dataclass(frozen=True)
class CoverageCell:
    """What intervals of an integrand were like, over replicates and components."""

    case: Case
    d: int
    n: int
    held: Array  # (replicates · components,), replicate by replicate, whether the interval held the integral
    half: Array  # half its width
    error: Array
    warned: Array

    def row(self) -> dict[str, object]:
        """The line of the table."""
        half, error = (x.reshape(-1, self.case.integral.size) for x in (self.half, self.error))
        rms = np.sqrt(np.square(error).mean(axis=0))
        least = _ROUNDING * np.maximum(np.ravel(abs(self.case.integral)), _OF_WAVES * (self.case.kind == "wave"))
        missed = self.held == 0
        return {
            "d": self.d,
            "n": self.n,
            "kind": self.case.kind,
            "integrand": self.case.formula,
            "calibrated": "yes" if self.case.calibrated else "no",
            "coverage": float(self.held.mean()),
            "width_over_rms": float((np.median(half, axis=0) / np.maximum(rms, least)).max()),
            "rms_error": float(rms.max()),
            "warned_of_missed": _share(self.warned[missed]),
            "warned_of_held": _share(self.warned[~missed]),
        }


def run_coverage(
    out: str | os.PathLike[str],
    *,
    dimensions: Sequence[int] = (1, 2, 3, 4, 5, 6),
    max_n: int = 1024,
    replicates: int = 200,
    seed: int = 0,
    pool: Pool = ONE_PROCESS,
    show_progress: bool = True,
) -> Results:
    """Measure the 95 % intervals of :func:`voroquad.quad`; leave a table, figures and ``results.json`` in a folder.

    Parameters
    ----------
    out : path
        Folder; its entries change only when everything is measured.
    dimensions : sequence of int
        Each from 1 to 6.
    max_n : int
        Largest number of evaluations: the sizes are 64, 256, 1024 … up to it, from 256 on in three and four and
        512, 2048 … in five and six dimensions.
    replicates : int
        Estimates of each integral, at least 20.
    seed : int
        Seed ≥ 0 of all random numbers.
    pool : Pool
        What computes the units of work, blocks of replicates.
    show_progress : bool
        A progress bar on standard error.

    Returns
    -------
    Results
        What ``results.json`` holds.

    Raises
    ------
    ValueError
        An argument out of range; no size at most max_n in one of the dimensions.
    """
    settings = CoverageSettings(positive_int("replicates", replicates), seed)
    work = list(_work(_check(settings, dimensions), positive_int("max_n", max_n)))
    command = study_command(out, "coverage", dimensions=dimensions, max_n=max_n, replicates=replicates, seed=seed)
    results = Results("Error bars of vq.quad: how often they hold, and how wide they are", command)
    pool.begin({"study": "coverage", "version": __version__} | asdict(settings))
    steps = len(work) * _units(settings)
    with progress_bar(steps, show=show_progress) as advance, atomic_directory(out) as folder:
        rows = [cell.row() for cell in measure(work, settings, pool, advance)]
        for d in dict.fromkeys(d for d, _, _ in work):
            of_dimension = [row for row in rows if row["d"] == d]
            drawing = draw_coverage(d, of_dimension, settings.replicates)
            results.sections.append(Section(f"d = {d}", figures=[drawing.save(folder, f"coverage-{d}d")]))
        write_rows(folder / "coverage.csv", rows)
        write_rows(folder / "coverage-kinds.csv", kind_rows(rows))
        results.sections[0].tables = [
            Table("coverage-kinds.csv", "Coverage of 95 % intervals by kind of integrand; half-width over rms error."),
            Table("coverage.csv", "The same for each integrand, and how often quad warned."),
        ]
        results.write(folder)
    return results


def measure(
    work: Sequence[tuple[int, int, int]],
    settings: CoverageSettings,
    pool: Pool = ONE_PROCESS,
    advance: Advance = lambda description, steps: None,
) -> Iterator[CoverageCell]:
    """Cells of (d, n, number of the integrand)."""
    values = pool.values((_series(*one, settings) for one in work), advance)
    for d, n, number in work:
        blocks = np.concatenate([next(values) for _ in range(_units(settings))], axis=1)
        case = cases(d)[number]
        measured = blocks[:, : settings.replicates].reshape(4, -1)
        yield CoverageCell(case, d, n, measured[0], measured[1], measured[2], measured[3])


def kind_rows(rows: Sequence[dict[str, Any]]) -> list[dict[str, object]]:
    """By dimension, size, kind, and whether the error bar was calibrated on it: means, the worst, and its name."""
    keys = dict.fromkeys((row["d"], row["n"], row["kind"], row["calibrated"]) for row in rows)
    found: list[dict[str, object]] = []
    for d, n, kind, calibrated in sorted(keys):
        some = [row for row in rows if (row["d"], row["n"], row["kind"], row["calibrated"]) == (d, n, kind, calibrated)]
        least = min(some, key=lambda row: row["coverage"])
        found.append({
            "d": d, "n": n, "kind": kind, "calibrated": calibrated, "integrands": len(some),
            "coverage": float(np.mean([row["coverage"] for row in some])),
            "least": least["coverage"], "of": least["integrand"],
            "widest": max(row["width_over_rms"] for row in some),
        })  # fmt: skip
    return found


def summary(results: Results, out: str | os.PathLike[str]) -> dict[str, Any]:
    """What ``voroquad study --suite coverage --json`` prints: the folder and the coverage by kind."""
    return {"folder": os.fspath(out), "coverage": read_rows(Path(out) / "coverage-kinds.csv")}


def _check(settings: CoverageSettings, dimensions: Sequence[int]) -> list[int]:
    """The dimensions, each once."""
    if settings.replicates < _REPLICATES_OF_A_UNIT:
        raise ValueError(f"replicates must be at least {_REPLICATES_OF_A_UNIT}, got {settings.replicates}")
    if settings.seed < 0:
        raise ValueError(f"seed must be at least 0, got {settings.seed}")
    for d in dimensions:
        if positive_int("dimensions", d) not in LEAST:
            raise ValueError(f"dimensions must be from 1 to {max(LEAST)}, got {d}")
    if not dimensions:
        raise ValueError("dimensions must name at least one; 1,2,3 for example")
    return list(dict.fromkeys(dimensions))


def _work(dimensions: Sequence[int], max_n: int) -> Iterator[tuple[int, int, int]]:
    """Dimension, evaluations and number of each integrand."""
    for d in dimensions:
        if max_n < LEAST[d]:
            raise ValueError(f"max_n must be at least {LEAST[d]} for d = {d}, got {max_n}")
        n = LEAST[d]
        while n <= max_n:
            yield from ((d, n, number) for number in range(len(cases(d))))
            n *= 4


def _units(settings: CoverageSettings) -> int:
    return -(-settings.replicates // _REPLICATES_OF_A_UNIT)


def _series(d: int, n: int, number: int, settings: CoverageSettings) -> Series:
    """The replicates of a cell, in blocks."""
    shape = (4, _REPLICATES_OF_A_UNIT, cases(d)[number].integral.size)
    return Series(f"coverage-{d}d-{n}-{number}", _units(settings), shape, _block, (d, n, number, settings))


def _block(d: int, n: int, number: int, settings: CoverageSettings, k: int) -> Array:
    """Whether intervals held, half their widths, errors, and whether quad warned: (4, replicates, components)."""
    case = cases(d)[number]
    first = k * _REPLICATES_OF_A_UNIT
    found = [_replicate(case, n, [settings.seed, d, n, number, first + j]) for j in range(_REPLICATES_OF_A_UNIT)]
    return np.stack(found, axis=1)


def _replicate(case: Case, n: int, seed: list[int]) -> Array:
    """Of one call, (4, components)."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IntegrationWarning)
        result = quad(case, case.lower, case.upper, n_points=n, rng=np.random.default_rng(seed))
    low, high = (np.ravel(end) for end in result.confidence_interval(LEVEL))
    truth = np.ravel(case.integral)
    warned = any(warning.kind not in ADVICE for warning in result.warnings)
    held = (low <= truth) & (truth <= high)
    error = np.ravel(result.integral) - truth
    return np.stack([held.astype(np.float64), (high - low) / 2, error, np.full(len(truth), float(warned))])


def _share(warned: Array) -> float | str:
    return float(warned.mean()) if len(warned) else ""
