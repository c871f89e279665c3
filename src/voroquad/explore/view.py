"""A page that shows an image while it is rendered: ``voroquad render --view``."""

from __future__ import annotations

import asyncio
import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from .._support.extras import install_hint

try:
    from bokeh.document import Document
    from bokeh.models import Div
    from jinja2 import Environment, PackageLoader, PrefixLoader, Template

    from ..report.images import Pixels, pack, viewer_plots
    from .local_server import LocalServer
except ImportError as error:
    raise ImportError(f"--view needs Bokeh; {install_hint('study')}", name="bokeh") from error

if TYPE_CHECKING:
    from ..mitsuba.render import FilmSoFar


class FilmView:
    """Shows the rounds of a render to every browser that opens the page.

    Parameters
    ----------
    title : str
        What is rendered.

    Notes
    -----
    `show` is called by the thread that renders, all else by the server's.
    """

    def __init__(self, title: str):
        self.title = title
        self._state: dict[str, Any] | None = None  # what the page's script reads
        self._size = (1, 1)
        self._documents: list[Document] = []

    def fill(self, document: Document) -> None:
        """Fill the document of a browser."""
        document.title = f"{self.title}: voroquad render"
        document.template = _template()
        document.template_variables["title"] = self.title
        self._documents.append(document)
        document.on_session_destroyed(lambda _: self._documents.remove(document))
        document.template_variables["aspect"] = self._size[0] / self._size[1] if self._state else None
        document.add_root(Div(tags=[self._state], name="film"))
        if self._state is not None:
            document.add_root(viewer_plots(*self._size, 1.0)["image"])

    def show(self, film: FilmSoFar) -> None:
        """Show what a render has after a round."""
        height, width = film.image.shape[:2]
        numbers = {
            "rounds": film.rounds, "end": film.end, "spp": film.spp,
            "error": film.error if math.isfinite(film.error) else None, "seconds": film.seconds, "left": film.left,
            "width": width, "height": height,
        }  # fmt: skip
        self._state = {"pixels": pack(_colours(film))} | numbers
        self._size = width, height
        for document in list(self._documents):
            document.add_next_tick_callback(partial(_update, document, self._state))


def _update(document: Document, state: dict[str, Any]) -> None:
    """Bring a document to the state of the render."""
    document.get_model_by_name("film").tags = [state]


def _colours(film: FilmSoFar) -> Pixels:
    """The colours (height, width, 3) of a film; grey is repeated."""
    image = np.asarray(film.image, np.float32)
    return image[..., :3] if "R" in film.channels else np.repeat(image[..., :1], 3, axis=-1)


@contextmanager
def serving(view: FilmView) -> Iterator[str]:
    """Serve a view on a free port of this machine until the block ends; the address of the page."""
    started = threading.Event()
    servers: list[LocalServer] = []

    def run() -> None:
        asyncio.set_event_loop(asyncio.new_event_loop())
        servers.append(LocalServer(view.fill))
        started.set()
        servers[0].run()

    thread = threading.Thread(target=run, daemon=True, name="voroquad view")
    thread.start()
    started.wait()
    try:
        yield servers[0].url
    finally:
        servers[0].stop()
        thread.join()


def _template() -> Template:
    loader = PrefixLoader(
        {"page": PackageLoader("voroquad.explore", "page"), "report": PackageLoader("voroquad.report")}
    )
    return Environment(loader=loader).get_template("page/view.html")
