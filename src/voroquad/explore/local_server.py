"""A server of one page: on this machine only, for its own page only."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .._support.extras import install_hint

try:
    from bokeh.application import Application
    from bokeh.application.handlers import FunctionHandler
    from bokeh.document import Document
    from bokeh.protocol import Protocol
    from bokeh.resources import Resources
    from bokeh.server.connection import ServerConnection
    from bokeh.server.server import BaseServer
    from bokeh.server.tornado import BokehTornado
    from bokeh.server.views.ws import WSHandler
    from tornado.httpserver import HTTPServer
    from tornado.httputil import HTTPHeaders, HTTPMessageDelegate, HTTPServerRequest
    from tornado.ioloop import IOLoop
    from tornado.netutil import bind_sockets
    from tornado.web import ErrorHandler, OutputTransform
except ImportError as error:
    raise ImportError(f"the explorer needs Bokeh; {install_hint('explore')}", name="bokeh") from error

LOOPBACK = "127.0.0.1"

#: The page loads everything from this server, sends nothing elsewhere and cannot be shown inside a frame
_POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data:; frame-ancestors 'none'; form-action 'none'; base-uri 'none'"
)


class LocalServer:
    """A server of a page.

    Parameters
    ----------
    fill : callable
        Fills the document of each browser that opens the page.
    port : int
        0: any that is free.
    """

    def __init__(self, fill: Callable[[Document], None], port: int = 0):
        self.sockets = bind_sockets(port, address=LOOPBACK)
        self.port: int = self.sockets[0].getsockname()[1]
        application = Application(FunctionHandler(fill))
        self._loop = IOLoop.current()
        tornado = _OwnPageOnly({"/": application}, hosts={f"{name}:{self.port}" for name in (LOOPBACK, "localhost")})
        http = HTTPServer(tornado)
        http.add_sockets(self.sockets)
        self._server = BaseServer(self._loop, tornado, http)

    @property
    def url(self) -> str:
        """The address of the page."""
        return f"http://{LOOPBACK}:{self.port}/"

    def run(self) -> None:
        """Answer until interrupted or stopped."""
        self._server.start()
        try:
            self._loop.start()
        finally:
            self._server.stop()

    def stop(self) -> None:
        """End :meth:`run`, from any thread."""
        self.call(self._loop.stop)

    def call(self, function: Callable[[], None]) -> None:
        """Have a function called by the server, from any thread."""
        self._loop.add_callback(function)


class _OwnPageOnly(BokehTornado):
    """Refuses every request that does not come from the page that this server served.

    A page of another site can make a browser on this machine send requests here. Its Origin shows this, and
    Host shows another name that resolves to this machine. Bokeh checks the Origin of web sockets only, and an
    environment variable could disable that.
    """

    def __init__(self, applications: dict[str, Application], hosts: set[str]):
        self._hosts = hosts
        super().__init__(applications, extra_websocket_origins=sorted(hosts))
        self.add_transform(_Headers)

    def find_handler(self, request: HTTPServerRequest, **kwargs: Any) -> HTTPMessageDelegate:
        """The handler of a request, or one that answers 403."""
        delegate: HTTPMessageDelegate = (
            super().find_handler(request, **kwargs)
            if self._own(request)
            else self.get_handler_delegate(request, ErrorHandler, {"status_code": 403})
        )
        return delegate

    def new_connection(self, protocol: Protocol, socket: WSHandler, *arguments: Any) -> ServerConnection:
        """A connection that sends messages at once; otherwise each waits for the acknowledgement of the one before."""
        socket.set_nodelay(True)
        return super().new_connection(protocol, socket, *arguments)

    def resources(self, absolute_url: str | bool | None = None) -> Resources:
        """Scripts come from this server, whatever BOKEH_RESOURCES is."""
        return Resources(mode="server", root_url="/", path_versioner=None)

    def _own(self, request: HTTPServerRequest) -> bool:
        origin = request.headers.get("Origin")
        site = request.headers.get("Sec-Fetch-Site", "none")
        opened_by_hand = request.headers.get("Sec-Fetch-Mode") == "navigate" and request.method == "GET"
        return (
            request.host in self._hosts
            and (origin is None or origin in {f"http://{host}" for host in self._hosts})
            and (site in ("none", "same-origin") or opened_by_hand)
        )


class _Headers(OutputTransform):
    """Adds the page's policy to every answer."""

    def transform_first_chunk(
        self, status_code: int, headers: HTTPHeaders, chunk: bytes, finishing: bool
    ) -> tuple[int, HTTPHeaders, bytes]:
        headers["Content-Security-Policy"] = _POLICY
        headers["X-Content-Type-Options"] = "nosniff"
        headers["Referrer-Policy"] = "no-referrer"
        headers["Cross-Origin-Resource-Policy"] = "same-origin"
        return status_code, headers, chunk
