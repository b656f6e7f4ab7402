"""meshcat's viewer served to a browser on this machine, by a thread of this process.

meshcat's own launcher starts a second process that outlives a killed parent and listens on every
network interface. A thread ends with its process, and this one listens on the loopback only.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import socket
import threading
import warnings
from types import TracebackType
from typing import Any

import numpy as np
import tornado.httpserver
import tornado.web
import umsgpack
import zmq

from hexapod_pin.errors import ViewerError
from hexapod_pin.view.meshcat_commands import Command

with warnings.catch_warnings():
    warnings.filterwarnings("ignore", "zmq.eventloop.ioloop", DeprecationWarning)
    from meshcat.servers import zmqserver

LOOPBACK = "127.0.0.1"
SERVER_TIMEOUT_S = 20.0  # longest wait for the server's thread [s]

TYPED_ARRAY = {"uint16": 0x14, "uint32": 0x16, "float32": 0x17}
"""Codes of arrays in msgpack-lite, which the viewer unpacks with."""

_numbers = itertools.count()


class _Socket(zmqserver.WebSocketHandler):  # type: ignore[misc]  # meshcat has no types
    """meshcat's connection to a browser, without its messages on stderr."""

    def open(self) -> None:
        self.bridge.websocket_pool.add(self)
        self.bridge.send_scene(self)

    def on_close(self) -> None:
        self.bridge.websocket_pool.discard(self)

    def write_message(self, message: Any, binary: bool = False) -> Any:
        """Send a message; a browser that is closed meanwhile is no failure to report."""
        sent = super().write_message(message, binary)
        sent.add_done_callback(lambda done: done.cancelled() or done.exception())
        return sent


class _Application(tornado.web.Application):
    """A web application that answers on sockets that are already bound."""

    def __init__(self, sockets: list[Any], handlers: list[Any]) -> None:
        super().__init__(handlers, log_function=lambda _: None)
        self._sockets, self.server = sockets, tornado.httpserver.HTTPServer(self)

    def listen(self, *_: Any, **__: Any) -> tornado.httpserver.HTTPServer:
        """Answer on the sockets, whatever port is requested."""
        self.server.add_sockets(self._sockets)
        return self.server


class _Bridge(zmqserver.ZMQWebSocketBridge):  # type: ignore[misc]
    """meshcat's server between commands and browsers, on given sockets."""

    def __init__(self, commands: str, sockets: list[Any]) -> None:
        self._sockets = sockets
        super().__init__(zmq_url=commands, host=LOOPBACK, port=sockets[0].getsockname()[1])

    def make_app(self) -> _Application:
        pages = {"path": zmqserver.VIEWER_ROOT, "default_filename": zmqserver.VIEWER_HTML}
        return _Application(
            self._sockets,
            [
                (r"/static/(.*)", zmqserver.StaticFileHandlerNoCache, pages),
                (r"/", _Socket, {"bridge": self}),
            ],
        )

    def close(self) -> None:
        """Let go of browsers and sockets; in the server's thread."""
        for browser in list(self.websocket_pool):
            browser.close()
        self.app.server.stop()
        self.zmq_stream.close()


def packed(command: Command) -> bytes:
    """Return a command as meshcat's viewer unpacks it; arrays of numbers as typed arrays."""
    handlers = {
        np.ndarray: lambda array: umsgpack.Ext(TYPED_ARRAY[array.dtype.name], array.tobytes())
    }
    return bytes(umsgpack.packb(command, ext_handlers=handlers))


class LiveViewer:
    """A running viewer; a context manager, after which nothing listens any more.

    Attributes:
        url: where a browser finds it.
        notes: sentences on meshes that are not drawn.
    """

    def __init__(self, *, port: int = 0) -> None:
        """Prepare a viewer on a port of the loopback interface; 0 takes any free one."""
        self.url = ""
        self.notes: tuple[str, ...] = ()
        self._port = port
        self._commands = f"inproc://hexapod_pin-viewer-{next(_numbers)}"
        self._ready, self._failure = threading.Event(), ""
        self._thread = threading.Thread(target=self._serve, name="viewer", daemon=True)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._client: zmq.Socket[bytes] | None = None

    def __enter__(self) -> LiveViewer:
        """Start to serve.

        Raises:
            ViewerError: the port is taken, or the server does not start.
        """
        try:
            self._thread.start()
        except RuntimeError as error:
            raise ViewerError(f"the viewer did not start: {error}.") from error
        if not self._ready.wait(SERVER_TIMEOUT_S) or self._failure:
            raise ViewerError(f"the viewer did not start: {self._failure or 'no answer'}.")
        client = zmqserver.ZMQWebSocketBridge.context.socket(zmq.REQ)
        client.setsockopt(zmq.LINGER, 0)
        client.setsockopt(zmq.RCVTIMEO, int(1e3 * SERVER_TIMEOUT_S))
        client.connect(self._commands)
        self._client = client
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Stop serving and close every socket."""
        if self._client is not None:
            self._client.close()
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(SERVER_TIMEOUT_S)

    def send(self, command: Command) -> None:
        """Pass a command to every browser, now or when it connects.

        Raises:
            ViewerError: the server does not answer.
        """
        if self._client is None:
            raise ViewerError("the viewer is not running: use it in a `with` block.")
        frames = [command["type"].encode(), command["path"].encode(), packed(command)]
        try:
            self._client.send_multipart(frames)
            self._client.recv()
        except zmq.ZMQError as error:
            raise ViewerError(f"the viewer does not answer ({error}).") from error

    def _serve(self) -> None:
        """Serve until the loop is stopped; the body of the thread."""
        loop = asyncio.new_event_loop()
        asyncio.set_event_loop(loop)
        with contextlib.closing(loop):
            try:
                server = socket.create_server((LOOPBACK, self._port))
                server.setblocking(False)
                bridge = _Bridge(self._commands, [server])
            except (OSError, zmq.ZMQError) as error:
                self._failure = f"port {self._port} of {LOOPBACK}: {error}"
                self._ready.set()
                return
            self.url, self._loop = bridge.web_url, loop
            loop.call_soon(self._ready.set)
            loop.run_forever()
            bridge.close()
            loop.run_until_complete(asyncio.sleep(0.05))  # lets closing handshakes go out
