"""``voroquad demo``: the whole way at a small size, to one page to look at."""

from __future__ import annotations

import os
from pathlib import Path

from .report.page import write_report
from .study.run import run_study

TITLE = "voroquad: random samples into good quadrature"
REPLICATES = 250
MAX_N = 1024
SCENE = "depth-of-field"
SIZE = (192, 128)
SPP = (16, 64, 256)


def run_demo(out: str | os.PathLike[str], *, seed: int = 0, show_progress: bool = True) -> Path:
    """Run the study and a depth-of-field comparison at a small size, and write ``index.html`` to look at.

    Parameters
    ----------
    out : path
        Folder for the page and for the results behind it: ``study`` and ``depth-of-field``.
    seed : int
        Seed of all random numbers.
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
    run_study(study, replicates=REPLICATES, max_n=MAX_N, seed=seed, show_progress=show_progress)
    compare(SCENE, comparison, domain="lens", spp=SPP, size=SIZE, seed=seed, show_progress=show_progress)
    return write_report([comparison, study], out / "index.html", title=TITLE)
