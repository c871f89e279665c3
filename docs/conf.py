"""Sphinx settings of the documentation; `make docs` builds it."""

from __future__ import annotations

from pathlib import Path

import voroquad

# The live figure, where there was a compiler to make it (make wasm); pages that show it ask for the tag "live"
live_figure = Path(voroquad.__file__).parent / "report" / "live.html"
if live_figure.exists():
    tags.add("live")  # noqa: F821, a name that Sphinx gives

project = "voroquad"
copyright = "the voroquad authors, MIT licence"
version = release = voroquad.__version__

extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx-mathjax-offline",  # formulas without network
]
# The former, first, is that of the pages of the API, docs/generated
source_suffix = {".rst": "restructuredtext", ".md": "myst-nb"}

templates_path = ["templates"]
exclude_patterns = ["paper"]  # docs/paper/build.sh makes a PDF of it

nb_execution_mode = "cache"  # of those whose code has changed
nb_execution_raise_on_error = True
nb_execution_timeout = 600
nb_merge_streams = True

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "smartquotes"]
myst_heading_anchors = 3
myst_links_external_new_tab = False

autosummary_generate = True
autodoc_typehints = "none"  # numpydoc's Parameters say it with shapes
numpydoc_show_class_members = False
numpydoc_xref_param_type = False
add_function_parentheses = False

html_theme = "furo"
html_title = "voroquad"
html_static_path = ["static", *([str(live_figure)] if live_figure.exists() else [])]
html_favicon = "static/favicon.svg"
html_css_files = ["site.css"]
html_js_files = [("accessible.js", {"defer": "defer"})]
html_show_sphinx = False
html_copy_source = False
html_theme_options = {
    "sidebar_hide_name": False,
    "light_css_variables": {"color-brand-primary": "#005a9c", "color-brand-content": "#005a9c"},
    "dark_css_variables": {"color-brand-primary": "#7cb7f0", "color-brand-content": "#7cb7f0"},
}
copybutton_exclude = ".linenos, .gp, .go"
