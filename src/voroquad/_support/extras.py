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


#: The extra of the package that brings a module.
EXTRA_OF = {
    **dict.fromkeys(("matplotlib", "mpl_toolkits", "jinja2", "markupsafe", "bokeh", "OpenEXR", "pydantic"), "study"),
    **dict.fromkeys(("mitsuba", "drjit", "flip_evaluator"), "render"),
    **dict.fromkeys(("vegas", "qmcpy"), "bench"),
    "shapely": "geo",
    "mitsuba_oidn": "denoise",
    **dict.fromkeys(("distributed", "dask", "zarr", "fsspec"), "cluster"),
}
