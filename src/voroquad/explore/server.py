"""The explorer's server."""

from __future__ import annotations

import logging
import os

from .._support.extras import install_hint

try:
    from bokeh.document import Document
    from jinja2 import Environment, PackageLoader, Template

    from .explorer import Explorer
    from .local_server import LocalServer
except ImportError as error:
    raise ImportError(f"the explorer needs Bokeh; {install_hint('explore')}", name="bokeh") from error


class ExplorerServer(LocalServer):
    """A server of the explorer; ``serve`` runs one until it is interrupted.

    Parameters
    ----------
    port : int
        0: any that is free.
    """

    def __init__(self, port: int = 0):
        super().__init__(_fill, port)


def serve() -> None:
    """Serve the explorer on a free port of this machine until Ctrl-C."""
    logging.getLogger("bokeh").setLevel(logging.ERROR)  # closed pages are not logged
    os.environ.setdefault("VOROQUAD_NUM_THREADS", "1")  # sets are small, and the browser needs a processor too
    server = ExplorerServer()
    print(f"{server.url}  (Ctrl-C ends it)", flush=True)
    try:
        server.run()
    except KeyboardInterrupt:
        print()


def _fill(document: Document) -> None:
    document.title = "voroquad explore"
    document.template = _template()
    Explorer(document)


def _template() -> Template:
    return Environment(loader=PackageLoader("voroquad.explore", "page")).get_template("explore.html")
