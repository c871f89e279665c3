"""Where an installed package has the headers of the C++ core and the files by which CMake finds them."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path


def get_include() -> str:
    """Directory of the C++ headers, for the compiler option ``-I``.

    Returns
    -------
    str
        An absolute path.

    Examples
    --------
    >>> import pathlib, voroquad as vq
    >>> (pathlib.Path(vq.get_include()) / "voroquad" / "cells.hpp").exists()
    True
    """
    return str(_installed("include"))


def get_cmake_dir() -> str:
    """Directory of the CMake package, for ``find_package(voroquad)`` with ``-Dvoroquad_DIR=``.

    Returns
    -------
    str
        An absolute path.

    Examples
    --------
    >>> import pathlib, voroquad as vq
    >>> (pathlib.Path(vq.get_cmake_dir()) / "voroquadConfig.cmake").exists()
    True
    """
    return str(_installed("cmake"))


def _installed(name: str) -> Path:
    """A directory that CMake installed beside the compiled core, in an editable installation too."""
    core = find_spec("voroquad._core_levels")
    assert core is not None
    assert core.origin is not None
    return Path(core.origin).resolve().parent / name
