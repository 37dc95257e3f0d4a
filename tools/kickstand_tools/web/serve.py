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
MOST, PATIENCE_S = 64, 10.0  # maximum number of connections; longest wait for a browser's data
# Time in s for which a new connection waits if there are already MOST connections. Then the oldest connection is ended.
# If some connections have sent no request, the oldest of these is ended at once.
FULL_S = 1.0
PORT = 8377  # always the same, because the browser keeps files by address
# Defined here, because the Windows registry may have other types. With a wrong type a browser does not run modules.
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
    """Serves the site. With more than MOST connections it ends the oldest without a request, or else the oldest."""

    request_queue_size = 128
    daemon_threads = True
    allow_reuse_address = os.name != "nt"  # on Windows the server would share the port with another program

    def __init__(self, *arguments: Any) -> None:
        self._free = BoundedSemaphore(MOST)
        self._open: dict[Any, None] = {}  # the oldest first
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
        """End the oldest connection that has sent no request, and take its place. Return False without one."""
        with contextlib.suppress(OSError, StopIteration, RuntimeError):
            silent = (connection for connection in list(self._open) if connection not in self.has_asked)
            next(silent).shutdown(socket.SHUT_RDWR)
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
    """Return a server for {path: content}. Its port is server_address[1], a free one if `port` is in use."""

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"
        timeout = PATIENCE_S

        def do_GET(self) -> None:
            self._answer(True)

        def do_HEAD(self) -> None:
            self._answer(False)

        def _answer(self, with_body: bool) -> None:
            """Send a file or an error. with_body: False for HEAD."""
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
            if with_body and data:
                self.wfile.write(data)

        def log_message(self, format: str, *args: object) -> None:
            pass  # print no requests

    try:
        return Server((HOST, port), Handler)
    except OSError as error:
        if error.errno not in (errno.EADDRINUSE, errno.EACCES) or not port:
            raise
        return Server((HOST, 0), Handler)
