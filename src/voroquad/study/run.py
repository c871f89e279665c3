"""The study: all figures with their numbers, from a real run, in one folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

import numpy as np

from .._support.checks import one_of, positive_int
from .._support.files import atomic_directory
from .._support.progress import progress_bar
from .._support.units import ONE_PROCESS, Advance, Pool
from .._support.version import __version__
from ..results.manifest import Figure, Results, Section, Table
from .command import study_command
from .convergence import METHODS_1D, METHODS_2D, Measurement, measure, powers_of_two, replicates_at, units
from .drawing import Drawing, read_rows, write_rows
from .figures_bias import draw_bias_function, draw_three
from .figures_bias_plane import draw_bias_plane
from .figures_bins import draw_bins
from .figures_cells import draw_cells
from .figures_convergence import draw_convergence, slope_rows
from .functions import INTEGRANDS, INTEGRANDS_1D, INTEGRANDS_2D

_TALK: dict[str, tuple[str, Callable[[np.random.Generator], Drawing]]] = {
    "bins": ("One-dimensional integration with 20 samples", draw_bins),
    "three-samples": ("Three samples: positions and weights", draw_three),
    "bias-function": ("The bias function g", draw_bias_function),
    "bias-plane": ("The bias function in two dimensions", draw_bias_plane),
    "cells": ("Voronoi cells in two dimensions", draw_cells),
}
_DIMENSIONS = ((METHODS_1D, INTEGRANDS_1D), (METHODS_2D, INTEGRANDS_2D))


def run_study(
    out: str | os.PathLike[str],
    *,
    replicates: int = 1000,
    max_n: int = 4096,
    seed: int = 0,
    figures: Collection[str] | None = None,
    pool: Pool = ONE_PROCESS,
    show_progress: bool = True,
) -> Results:
    """Run the talk's numerical study and leave its figures, tables and ``results.json`` in a folder.

    Parameters
    ----------
    out : path
        Folder; it appears, or its entries change, only when everything is done.
    replicates : int
        Independent sample sets behind every mean squared error at N > 512; twice as many at
        smaller N.
    max_n : int
        Largest number of samples: the sizes are the powers of two from 8 to max_n ≥ 32.
    seed : int
        Seed ≥ 0 of all random numbers.
    figures : collection of str, optional
        Names of the figures to make, such as ``"bins"`` and ``"mse-smooth-2d"``; by default all. Each is the same
        alone.
    pool : Pool
        What computes the units of work, such as :class:`voroquad.cluster.OnDask`. The results do not depend on it.
    show_progress : bool
        A progress bar on standard error.

    Returns
    -------
    Results
        What ``results.json`` holds.

    Raises
    ------
    ValueError
        replicates < 2, max_n < 32, a negative seed, the name of a figure that does not exist.
    """
    sizes = powers_of_two(positive_int("max_n", max_n))
    if positive_int("replicates", replicates) < 2:
        raise ValueError("replicates must be at least 2 (one has no standard error), got 1")
    if seed < 0:
        raise ValueError(f"seed must be at least 0, got {seed}")
    wanted = _figures() if figures is None else [one_of("figure", name, _figures()) for name in figures]
    talk = {stem: part for stem, part in _TALK.items() if stem in wanted}
    chosen = [(methods, [f for f in integrands if f"mse-{f.name}" in wanted]) for methods, integrands in _DIMENSIONS]
    dimensions = [(methods, integrands) for methods, integrands in chosen if integrands]
    command = study_command(out, replicates=replicates, max_n=max_n, seed=seed)
    pool.begin(
        {"study": "talk", "replicates": replicates, "seed": seed, "figures": sorted(wanted), "version": __version__}
    )
    results = Results("Voronoi-weighted Monte Carlo integration: the numerical study", command)

    designs = sum(len({m.design for m in methods}) for methods, _ in dimensions)
    steps = len(wanted) + designs * sum(units(n, replicates_at(n, replicates)) for n in sizes)
    with progress_bar(steps, show=show_progress) as advance, atomic_directory(out) as folder:
        for stem, (title, draw) in talk.items():
            drawing = draw(np.random.default_rng([seed, list(_TALK).index(stem)]))
            results.sections.append(Section(title, figures=[drawing.save(folder, stem)]))
            advance(title, 1)
        for methods, integrands in dimensions:
            measurements = measure(
                methods, integrands, sizes, replicates=replicates, seed=seed, pool=pool, advance=advance
            )
            results.sections.append(_convergence_section(folder, measurements, advance))
        results.write(folder)
    return results


def _figures() -> list[str]:
    """Names of all figures."""
    return [*_TALK, *(f"mse-{f.name}" for _, integrands in _DIMENSIONS for f in integrands)]


def _convergence_section(folder: Path, measurements: list[Measurement], advance: Advance) -> Section:
    names = list(dict.fromkeys(m.integrand for m in measurements))
    d = INTEGRANDS[names[0]].d
    figures: list[Figure] = []
    for name in names:
        f = INTEGRANDS[name]
        drawing = draw_convergence(f, [m for m in measurements if m.integrand == name])
        figures.append(drawing.save(folder, f"mse-{name}"))
        advance(f"figure: {f.title}", 1)
    slopes = f"slopes-{d}d.csv"
    write_rows(folder / slopes, slope_rows(measurements))
    return Section(
        f"Mean squared error against N, d = {d}",
        text="Every line is one way to integrate: a sampling design and its weights. All integrands, and all weights "
        "of one design, share their sample sets. Bars and CSV files have standard errors; a mean error of one or two "
        "of its own is no sign of bias.",
        figures=figures,
        tables=[Table(slopes, "Slopes of log MSE against log N, with standard errors, and the MSE at the largest N.")],
    )


def summary(results: Results, out: str | os.PathLike[str]) -> dict[str, Any]:
    """What ``voroquad study --json`` prints: the folder, its files and the fitted slopes."""
    folder = Path(out)
    slopes = [row for s in results.sections for table in s.tables for row in read_rows(folder / table.csv)]
    return {"folder": os.fspath(out), "slopes": slopes}
