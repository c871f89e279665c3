"""vq.quad and its peers on families of integrands, at equal numbers of evaluations."""

from __future__ import annotations

import itertools
import json
import os
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from .._support.arrays import Array
from .._support.checks import one_of, positive_int
from .._support.files import atomic_directory, atomic_path
from .._support.progress import progress_bar
from .._support.units import ONE_PROCESS, Advance, Pool, Series
from .._support.version import __version__
from ..results.manifest import Results, Section, Table
from .command import study_command
from .drawing import read_rows, write_rows
from .figures_genz import draw_ratios
from .genz import FAMILIES, instances
from .moments import Moments, add_packed
from .peers import OURS, PEERS, Integrator

#: File in the results folder that keeps the measurements of an unfinished run.
UNFINISHED = "genz-unfinished.json"
#: Replicates of a unit of work
_REPLICATES_OF_A_UNIT = 5
_TIMES = 3  # the fastest call counts
_ROUNDING = 2.0**-50  # relative to the mean of |f|: smaller errors count as rounding


@dataclass(frozen=True)
class ErrorCell:
    """The errors of a rule with n evaluations in d dimensions.

    Mean squared errors and their standard errors have an entry per integrand, family by family.
    """

    rule: str
    d: int
    n: int
    evaluations: int
    mse: list[float]
    mse_error: list[float]


@dataclass(frozen=True)
class GenzSettings:
    """What must be equal for cells to be comparable."""

    replicates: int
    instances: int
    seed: int


#: A rule, the number of dimensions and the number of evaluations
Work = tuple[Integrator, int, int]


def run_genz(
    out: str | os.PathLike[str],
    *,
    dimensions: Sequence[int] = (1, 2, 3, 4, 6),
    max_n: int = 2048,
    peers: Sequence[str] | None = None,
    replicates: int = 50,
    instances: int = 5,
    seed: int = 0,
    pool: Pool = ONE_PROCESS,
    show_progress: bool = True,
    rules: Sequence[Integrator] = PEERS,
) -> Results:
    """Compare :func:`voroquad.quad` with other rules and leave tables, figures and ``results.json`` in a folder.

    Parameters
    ----------
    out : path
        Folder; its entries change only when everything is measured. Until then it holds ``genz-unfinished.json``;
        after an interruption, the same call resumes from this file.
    dimensions : sequence of int
        Each from 1 to 8.
    max_n : int
        Largest number of evaluations: the sizes are 128, 512, 2048 … up to it.
    peers : sequence of str, optional
        Names of the rules to compare with; by default all whose packages are installed.
    replicates : int
        Estimates of each integrand by each rule, at least 2.
    instances : int
        Random members of each family, at least 2.
    seed : int
        Seed ≥ 0 of all random numbers.
    pool : Pool
        What computes the units of work, blocks of replicates; wall times are always those of this process.
    show_progress : bool
        A progress bar on standard error.
    rules : sequence of Integrator
        What `peers` chooses from.

    Returns
    -------
    Results
        What ``results.json`` holds.

    Raises
    ------
    ValueError
        An argument out of range; an unfinished run with other settings in the folder.
    ModuleNotFoundError
        A peer that was asked for is not installed.
    """
    settings = GenzSettings(positive_int("replicates", replicates), positive_int("instances", instances), seed)
    sizes = sizes_up_to(positive_int("max_n", max_n))
    dimensions = _check(settings, dimensions)
    rules = (OURS, *_choose(peers, rules))
    work = [(rule, d, n) for d in dimensions for n in sizes for rule in rules if rule.exists(d, n)]
    store = _Store(Path(out) / UNFINISHED, settings)
    results = Results(
        "vq.quad and its peers, at equal numbers of evaluations",
        study_command(out, "genz", dimensions=dimensions, max_n=sizes[-1], peers=peers, **asdict(settings)),
    )
    pool.begin({"study": "genz", "version": __version__} | asdict(settings))
    steps = sum(_units(rule, settings) for rule, _, _ in work)
    with progress_bar(steps, show=show_progress) as advance, atomic_directory(out) as folder:
        try:
            cells = list(_cells(store, work, settings, pool, advance))
        except KeyboardInterrupt:
            print(
                f"voroquad: {store.path} keeps what is measured; the same command goes on from there", file=sys.stderr
            )
            raise
        results.sections = [_section(folder, d, cells, settings) for d in dimensions]
        write_rows(folder / "genz-mse.csv", _mse_rows(cells, settings))
        write_rows(folder / "genz-ratios.csv", ratio_rows(cells, settings))
        write_rows(folder / "genz-times.csv", time_rows(rules, dimensions, sizes))
        results.sections[0].tables = [
            Table("genz-ratios.csv", "MSE of each peer over that of vq.quad, geometric mean over a family's members."),
            Table("genz-times.csv", "Wall time of one call on an oscillatory integrand, the fastest of three."),
        ]
        results.write(folder)
    store.path.unlink(missing_ok=True)
    return results


def sizes_up_to(max_n: int) -> list[int]:
    """Numbers of evaluations: 128, 512, 2048 …, each four times the one before."""
    if max_n < 128:
        raise ValueError(f"max_n must be at least 128, got {max_n}")
    return [2**k for k in range(7, max_n.bit_length(), 2)]


def measure(
    work: Sequence[Work],
    settings: GenzSettings,
    pool: Pool = ONE_PROCESS,
    advance: Advance = lambda description, steps: None,
) -> Iterator[ErrorCell]:
    """Mean squared errors on members of all families, of rules in d dimensions with n evaluations."""
    totals = pool.sums((_series(*one, settings) for one in work), _join, advance)
    for (rule, d, n), total in zip(work, totals, strict=True):
        moments = Moments.unpacked(total[..., :-1])
        error = moments.standard_error[1] if moments.count > 1 else np.zeros_like(moments.mean[1])
        yield ErrorCell(rule.name, d, n, int(total[0, 0, -1]), moments.mean[1].tolist(), error.tolist())


def ratio_rows(cells: Sequence[ErrorCell], settings: GenzSettings) -> list[dict[str, object]]:
    """MSE of each peer over that of vq.quad: geometric means over a family's members and, "all", over the families.

    `log_error` is the standard error of the mean logarithm, from its spread over the members. Errors
    below rounding count as rounding, where all rules are equal.
    """
    ours = {(c.d, c.n): c for c in cells if c.rule == OURS.name}
    rows: list[dict[str, object]] = []
    for cell in cells:
        own = ours[cell.d, cell.n]
        if cell is own:
            continue
        logs = (_log_mse(cell, settings) - _log_mse(own, settings)).reshape(len(FAMILIES), settings.instances)
        spread = logs.std(axis=1, ddof=1) / np.sqrt(settings.instances)
        of_all = np.sqrt(np.square(spread).sum()) / len(spread)
        for family, log, error in [
            *zip(FAMILIES, logs.mean(axis=1), spread, strict=True),
            ("all", logs.mean(), of_all),
        ]:
            rows.append({
                "d": cell.d, "n": cell.n, "peer": cell.rule, "family": family,
                "mse_ratio": f"{np.exp(log):.3g}", "log_error": f"{error:.2f}",
                "evaluations": own.evaluations, "peer_evaluations": cell.evaluations,
            })  # fmt: skip
    return rows


def time_rows(rules: Sequence[Integrator], dimensions: Sequence[int], sizes: Sequence[int]) -> list[dict[str, object]]:
    """Wall time in milliseconds of one call of each rule, on the first integrand: the least of three."""
    rows: list[dict[str, object]] = []
    for d, n, rule in itertools.product(dimensions, sizes, rules):
        if not rule.exists(d, n):
            continue
        f = next(instances(d, 1, rng=d))
        times = []
        for k in range(_TIMES):
            start = time.perf_counter()
            rule.estimate([f], n, np.random.default_rng(k))
            times.append(time.perf_counter() - start)
        rows.append({"d": d, "n": n, "rule": rule.name, "milliseconds": f"{1e3 * min(times):.3f}"})
    return rows


def summary(results: Results, out: str | os.PathLike[str]) -> dict[str, Any]:
    """What ``voroquad study --suite genz --json`` prints: the folder, the ratios and the wall times."""
    folder = Path(out)
    return {
        "folder": os.fspath(out),
        "ratios": read_rows(folder / "genz-ratios.csv"),
        "times": read_rows(folder / "genz-times.csv"),
    }


# ---------------------------------------------------------------------- arguments


def _check(settings: GenzSettings, dimensions: Sequence[int]) -> list[int]:
    """The dimensions, each once."""
    for name, value in (("replicates", settings.replicates), ("instances", settings.instances)):
        if value < 2:
            raise ValueError(f"{name} must be at least 2 (one has no standard error), got 1")
    if settings.seed < 0:
        raise ValueError(f"seed must be at least 0, got {settings.seed}")
    for d in dimensions:
        if not 1 <= positive_int("dimensions", d) <= 8:
            raise ValueError(f"dimensions must be from 1 to 8, got {d}")
    if not dimensions:
        raise ValueError("dimensions must name at least one; 1,2,3 for example")
    return list(dict.fromkeys(dimensions))


def _choose(names: Sequence[str] | None, rules: Sequence[Integrator]) -> list[Integrator]:
    """The rules of these names; without names, those that are installed."""
    if names is None:
        return [rule for rule in rules if find_spec(rule.module)]
    known = {rule.name: rule for rule in rules}
    chosen = [known[one_of("peer", name, known)] for name in dict.fromkeys(names)]
    for rule in chosen:
        if not find_spec(rule.module):
            raise ModuleNotFoundError(f"peer {rule.name!r} needs {rule.module!r}", name=rule.module)
    return chosen


# ---------------------------------------------------------------------- measuring


def _replicates(rule: Integrator, settings: GenzSettings) -> int:
    return settings.replicates if rule.random else 1


def _units(rule: Integrator, settings: GenzSettings) -> int:
    return -(-_replicates(rule, settings) // _REPLICATES_OF_A_UNIT)


def _series(rule: Integrator, d: int, n: int, settings: GenzSettings) -> Series:
    """The replicates of a cell, in blocks."""
    shape = (3, 2, len(FAMILIES) * settings.instances + 1)
    return Series(f"{rule.name}-{d}d-{n}", _units(rule, settings), shape, _block, (rule, d, n, settings))


def _block(rule: Integrator, d: int, n: int, settings: GenzSettings, k: int) -> Array:
    """Moments of the errors in block k, by integrand; last, the most evaluations that a replicate took."""
    functions = list(instances(d, settings.instances, rng=[settings.seed, d]))
    start = k * _REPLICATES_OF_A_UNIT
    numbers = range(start, min(start + _REPLICATES_OF_A_UNIT, _replicates(rule, settings)))
    made = [rule.estimate(functions, n, np.random.default_rng([settings.seed, d, n, number])) for number in numbers]
    errors = np.stack([estimates for estimates, _ in made], -1) - np.array([[f.integral] for f in functions])
    evaluations = np.full((3, 2, 1), max(used for _, used in made), dtype=float)
    return np.concatenate([Moments.of(errors).packed(), evaluations], -1)


def _join(a: Array, b: Array) -> Array:
    return np.concatenate([add_packed(a[..., :-1], b[..., :-1]), np.maximum(a, b)[..., -1:]], -1)


def _cells(
    store: _Store, work: Sequence[Work], settings: GenzSettings, pool: Pool, advance: Advance
) -> Iterator[ErrorCell]:
    """The cells. Those that an earlier run measured are read from the store."""
    missing = [one for one in work if store.get(*one) is None]
    measured = measure(missing, settings, pool, advance)
    for rule, d, n in work:
        if (cell := store.get(rule, d, n)) is None:
            cell = store.put(next(measured))
        else:
            advance(f"{rule.name}-{d}d-{n}", _units(rule, settings))
        yield cell


def _log_mse(cell: ErrorCell, settings: GenzSettings) -> Array:
    rounding = [
        np.finfo(float).eps * f.integral for f in instances(cell.d, settings.instances, [settings.seed, cell.d])
    ]
    return np.log(np.maximum(cell.mse, np.square(rounding)))


class _Store:
    """Measured cells, in one file that is replaced as a whole.

    The store of :mod:`voroquad.cluster.store` needs Zarr, which runs without Dask do not have.
    """

    def __init__(self, path: Path, settings: GenzSettings):
        self.path = path
        self._settings = settings
        self._cells: dict[tuple[str, int, int], ErrorCell] = {}
        if path.is_file():
            for cell in self._read():
                self._cells[cell.rule, cell.d, cell.n] = cell

    def get(self, rule: Integrator, d: int, n: int) -> ErrorCell | None:
        """The cell, if it is measured."""
        return self._cells.get((rule.name, d, n))

    def put(self, cell: ErrorCell) -> ErrorCell:
        """Keep a cell."""
        self._cells[cell.rule, cell.d, cell.n] = cell
        content = {"settings": asdict(self._settings), "cells": [asdict(c) for c in self._cells.values()]}
        with atomic_path(self.path) as temporary:
            temporary.write_text(json.dumps(content), encoding="utf-8")
        return cell

    def _read(self) -> list[ErrorCell]:
        try:
            content = json.loads(self.path.read_text(encoding="utf-8"))
            settings, cells = GenzSettings(**content["settings"]), [ErrorCell(**cell) for cell in content["cells"]]
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(f"{self.path} is damaged ({error}); delete it to start anew") from None
        if settings != self._settings:
            raise ValueError(
                f"{self.path} is an unfinished run with other settings ({settings}); finish that one, delete the "
                "file or name another folder"
            )
        return cells


# ---------------------------------------------------------------------- results


def _section(folder: Path, d: int, cells: Sequence[ErrorCell], settings: GenzSettings) -> Section:
    drawing = draw_ratios(d, [row for row in ratio_rows(cells, settings) if row["d"] == d], settings.instances)
    return Section(f"d = {d}", figures=[drawing.save(folder, f"genz-{d}d")])


def _mse_rows(cells: Sequence[ErrorCell], settings: GenzSettings) -> list[dict[str, object]]:
    members = [(family, k) for family in FAMILIES for k in range(settings.instances)]
    return [
        {
            "d": cell.d, "n": cell.n, "rule": cell.rule, "family": family, "instance": k,
            "mse": mse, "mse_error": error, "evaluations": cell.evaluations,
        }
        for cell in cells
        for (family, k), mse, error in zip(members, cell.mse, cell.mse_error, strict=True)
    ]  # fmt: skip
