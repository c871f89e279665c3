"""``voroquad demo``: a small study and comparison, and one page that shows their results."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from pathlib import Path

from .report.page import live_figure, write_report
from .study.run import run_study

TITLE = "voroquad: random samples into accurate quadrature"
SCENE = "depth-of-field"


def run_demo(
    out: str | os.PathLike[str],
    *,
    seed: int = 0,
    replicates: int = 250,
    max_n: int = 1024,
    figures: Collection[str] | None = None,
    size: tuple[int, int] = (192, 128),
    spp: Sequence[int] = (16, 64, 256),
    show_progress: bool = True,
) -> Path:
    """Run the study and a depth-of-field comparison at a small size, and write ``index.html`` to look at.

    The page begins with the live figure, if the package was built with it.

    Parameters
    ----------
    out : path
        Folder for the page and for the results behind it: ``study`` and ``depth-of-field``.
    seed : int
        Seed of all random numbers.
    replicates, max_n, figures
        Of the study, see :func:`voroquad.study.run.run_study`.
    size, spp
        Width and height of the images and their samples per pixel, see :func:`voroquad.mitsuba.compare.compare`.
    show_progress : bool
        Progress bars on standard error.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    ImportError
        No Mitsuba; the message tells how to get it.
    """
    from .mitsuba.compare import compare  # here, so that a missing Mitsuba is told before the study runs

    out = Path(out)
    study, comparison = out / "study", out / SCENE
    run_study(study, replicates=replicates, max_n=max_n, figures=figures, seed=seed, show_progress=show_progress)
    compare(SCENE, comparison, domain="lens", spp=spp, size=size, seed=seed, show_progress=show_progress)
    return write_report([comparison, study], out / "index.html", title=TITLE, live=live_figure())
