"""Offers an emulated board's console as a socket, for mpremote and `kickstand flash --port socket://...`."""

import contextlib
import socket
from collections.abc import Callable

from kickstand_tools.common.errors import InputError, cause


class ConsoleServer:
    """Serves one client at a time, as a serial port does. Call poll() often.

    Args:
        send: Function that is called with the client's data.
        port: Number of the TCP port. 0 chooses a free port.

    The attribute `port` holds the actual number. Raises InputError if the port cannot be opened.
    """

    def __init__(self, send: Callable[[bytes], None], port: int) -> None:
        self._send = send
        self._client: socket.socket | None = None
        try:
            self._server = socket.create_server(("127.0.0.1", port))
        except (OSError, OverflowError) as error:
            raise InputError(f"port {port} cannot be opened: {cause(error)}; choose another") from error
        self._server.setblocking(False)
        self.port: int = self._server.getsockname()[1]

    def close(self) -> None:
        """Disconnect the client and stop listening."""
        self._disconnect()
        self._server.close()

    def poll(self) -> None:
        """Accept a client, or pass the data of the connected client to send()."""
        if self._client is None:
            with contextlib.suppress(BlockingIOError):
                self._client = self._server.accept()[0]
                self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._client.setblocking(False)
            return
        try:
            data = self._client.recv(4096)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if data:
            self._send(data)
        else:
            self._disconnect()

    def say(self, data: bytes) -> None:
        """Send the board's output to the client. Without a client the output is lost."""
        if self._client:
            try:
                self._client.setblocking(True)
                self._client.sendall(data)
                self._client.setblocking(False)
            except OSError:
                self._disconnect()

    def _disconnect(self) -> None:
        if self._client:
            self._client.close()
            self._client = None
