"""The directory of files that are made once and reused."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import IO

import platformdirs


def cache_directory() -> Path:
    """The directory that VOROQUAD_CACHE_DIR names, else the user's cache directory of the platform."""
    chosen = os.environ.get("VOROQUAD_CACHE_DIR")
    return Path(chosen) if chosen else platformdirs.user_cache_path("voroquad", appauthor=False)


def is_own(file: IO[bytes]) -> bool:
    """Whether an open file belongs to this user and nobody else may write it.

    A cache directory can be shared or writable for everyone, as in /tmp. Files of others are not trusted. The
    open file is asked, since another may take its place under its name at any time.
    """
    if not hasattr(os, "geteuid"):  # Windows, where the cache directory is the user's own
        return True
    status = os.fstat(file.fileno())
    return status.st_uid == os.geteuid() and not status.st_mode & stat.S_IWOTH
