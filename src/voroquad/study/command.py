"""The command line that makes a study again."""

from __future__ import annotations

import os
import shlex
from collections.abc import Sequence


def study_command(
    out: str | os.PathLike[str], suite: str | None = None, **options: int | Sequence[object] | None
) -> str:
    """``voroquad study`` with these options; sequences are joined by commas, and what is None is left out."""
    words = ["voroquad", "study"] + (["--suite", suite] if suite else []) + ["-o", os.fspath(out)]
    for name, value in options.items():
        if value is not None:
            text = str(value) if isinstance(value, int) else ",".join(map(str, value))
            words += [f"--{name.replace('_', '-')}", text]
    return shlex.join(words)
