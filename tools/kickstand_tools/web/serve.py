"""Serves the site to the browser of this computer."""

import contextlib
import errno
import os
import socket
import sys
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import PurePosixPath
from threading import BoundedSemaphore
from typing import Any
from urllib.parse import unquote, urlsplit

HOST = "127.0.0.1"
MOST, PATIENCE_S = 64, 10.0  # most connections at a time; longest wait for a browser's data
# If MOST connections are open, a silent connection is ended at once. A new connection waits this long for a free place.
# Then the oldest connection is ended.
FULL_S = 1.0
PORT = 8377  # the port is always the same, because the browser stores files per address
# The media types are defined here. The registry of Windows may have wrong types for modules, and then a browser does
# not run them.
TYPES = {
    ".css": "text/css; charset=utf-8",
    ".gz": "application/gzip",
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".mjs": "text/javascript; charset=utf-8",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".txt": "text/plain; charset=utf-8",
    ".wasm": "application/wasm",
    ".webp": "image/webp",
    ".webmanifest": "application/manifest+json",
    ".zip": "application/zip",
}


class Server(ThreadingHTTPServer):
    """A server that ignores errors from a browser that disconnects.

    A new connection beyond MOST may end the oldest connection, because that connection may be stuck.
    """

    request_queue_size = 128
    daemon_threads = True
    allow_reuse_address = os.name != "nt"  # on Windows it would share the port with another program

    def __init__(self, *arguments: Any) -> None:
        self._free = BoundedSemaphore(MOST)
        self._open: dict[Any, None] = {}  # the open connections, the oldest first
        self.has_asked: set[Any] = set()
        super().__init__(*arguments)

    def process_request(self, request: Any, client_address: Any) -> None:
        if not self._free.acquire(blocking=False) and not (
            self._end_silent_connection() or self._free.acquire(timeout=FULL_S)
        ):
            # another thread may end the connection meanwhile
            with contextlib.suppress(OSError, StopIteration, RuntimeError):
                next(iter(self._open)).shutdown(socket.SHUT_RDWR)
            self._free.acquire()
        self._open[request] = None
        super().process_request(request, client_address)

    def _end_silent_connection(self) -> bool:
        """End the oldest connection that has sent no request, and take its place.

        Returns False if every connection has sent a request, or if the place does not become free within FULL_S.
        """
        with contextlib.suppress(OSError, StopIteration, RuntimeError):
            next(one for one in list(self._open) if one not in self.has_asked).shutdown(socket.SHUT_RDWR)
            return self._free.acquire(timeout=FULL_S)
        return False

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._open.pop(request, None)
            self.has_asked.discard(request)
            self._free.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        if not isinstance(sys.exc_info()[1], (ConnectionError, TimeoutError)):
            super().handle_error(request, client_address)


def server(files: dict[str, bytes], port: int = PORT) -> Server:
    """Create a server on `port`, or on a free port if `port` is in use.

    files: {path: content}.
    Returns the server. Its port is server_address[1].
    """

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"
        timeout = PATIENCE_S

        def do_GET(self) -> None:
            self._answer(True)

        def do_HEAD(self) -> None:
            self._answer(False)

        def _answer(self, whole: bool) -> None:
            self.server.has_asked.add(self.connection)  # pyright: ignore[reportAttributeAccessIssue]
            try:
                name = unquote(urlsplit(self.path).path).lstrip("/") or "index.html"
            except ValueError:  # an address such as http://[::1/
                self.send_error(400)
                return
            data = files.get(name)
            self.send_response(200 if data is not None else 404)
            self.send_header("Content-Type", TYPES.get(PurePosixPath(name).suffix, "application/octet-stream"))
            self.send_header("Content-Length", str(len(data or b"")))
            self.send_header("Cache-Control", "no-cache")
            self.send_header("X-Content-Type-Options", "nosniff")
            self.end_headers()
            if whole and data:
                self.wfile.write(data)

        def log_message(self, format: str, *args: object) -> None:
            """Do not print requests."""

    try:
        return Server((HOST, port), Handler)
    except OSError as error:
        if error.errno not in (errno.EADDRINUSE, errno.EACCES) or not port:
            raise
        return Server((HOST, 0), Handler)
