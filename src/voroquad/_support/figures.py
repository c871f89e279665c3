"""Axes of Matplotlib to draw on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .extras import install_hint

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def axes_for(ax: Axes | None, d: int = 2) -> Axes:
    """The axes that were given, or those of a new figure, for points in d dimensions.

    Raises
    ------
    ImportError
        Matplotlib is not installed.
    ValueError
        The axes are in space and d is not 3, or the other way round.
    """
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise ImportError(f"plot needs Matplotlib; {install_hint('study')}") from error
    if ax is None:
        return plt.figure().add_subplot(projection="3d" if d == 3 else None)
    if (d == 3) != (ax.name == "3d"):
        raise ValueError(f"points in d = {d} need an ax with{'' if d == 3 else 'out'} projection='3d'")
    return ax
