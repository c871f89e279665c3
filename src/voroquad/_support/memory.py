"""Memory of this machine."""

from __future__ import annotations

import math
import os


def physical_memory() -> float:
    """Bytes of memory of this machine; infinity where the system does not tell.

    Examples
    --------
    >>> from voroquad._support.memory import physical_memory
    >>> physical_memory() > 2**20
    True
    """
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, OSError, ValueError):  # Windows has no sysconf, others not these names
        return math.inf
