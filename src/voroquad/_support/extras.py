"""Optional dependencies: how to install them."""

from __future__ import annotations


def install_hint(extra: str) -> str:
    """How to install an extra of the package, which is on no package index.

    Examples
    --------
    >>> from voroquad._support.extras import install_hint
    >>> install_hint("study")
    "install it from a checkout of voroquad: pip install '.[study]'"
    """
    return f"install it from a checkout of voroquad: pip install '.[{extra}]'"
