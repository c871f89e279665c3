"""``voroquad demo``: the whole way at a small size, to one page to look at."""

from __future__ import annotations

import os
from pathlib import Path

from .report.page import write_report
from .study.run import run_study

REPLICATES = 250
MAX_N = 1024


def run_demo(out: str | os.PathLike[str], *, seed: int = 0, show_progress: bool = True) -> Path:
    """Run the study at a small size and write ``index.html`` in the folder `out`.

    Parameters
    ----------
    out : path
        Folder for the page and for the results behind it.
    seed : int
        Seed of all random numbers.
    show_progress : bool
        A progress bar on standard error.

    Returns
    -------
    Path
        The page.
    """
    out = Path(out)
    run_study(out / "study", replicates=REPLICATES, max_n=MAX_N, seed=seed, show_progress=show_progress)
    return write_report([out / "study"], out / "index.html", title="voroquad: random samples into good quadrature")
