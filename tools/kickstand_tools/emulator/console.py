"""The emulated board's console: over its USB, and as a socket for mpremote and `kickstand flash --port socket://...`."""

import contextlib
import socket
from collections.abc import Callable

from rp2040py.peripherals.usb import RPUSBController
from rp2040py.usb.cdc import USBCDC

from ..errors import InputError, cause


class QuietConsole(USBCDC):
    """The board's USB console. received: called with what the board prints.

    rp2040py's USB host answers every buffer that is ready with an empty packet: 34,000 a second, which take the Pico
    two thirds of its time. This one sends nothing while it has no data, as a real host.
    """

    def __init__(self, usb: RPUSBController, received: Callable[[bytes], None]) -> None:
        super().__init__(usb)
        self._others = usb.on_endpoint_read
        self._armed: list[int] = []  # sizes of the buffers that are ready for data
        self._waiting = bytearray()
        usb.on_endpoint_read = self._on_armed
        self.on_serial_data = lambda data: received(bytes(data))

    def send(self, data: bytes) -> None:
        """Send data to the board as fast as it takes them."""
        self._waiting += data
        self._give()

    def _on_armed(self, endpoint: int, size: int) -> None:
        if endpoint == self._out_endpoint:
            self._armed.append(size)
            self._give()
        elif self._others:
            self._others(endpoint, size)

    def _give(self) -> None:
        while self._armed and self._waiting:
            size = self._armed.pop(0)
            packet = bytes(self._waiting[:size])
            del self._waiting[:size]
            self.usb.endpoint_read_done(self._out_endpoint, packet)

    def _on_controller_reset(self) -> None:
        super()._on_controller_reset()
        self._armed = []
        self._waiting = bytearray()


class ConsoleServer:
    """Serves one client at a time, as a serial port does. Call poll() often. Port 0 takes a free one, see `port`.

    send: takes what the client sends.
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
        self._hang_up()
        self._server.close()

    def poll(self) -> None:
        """Accept a client, or pass on what it has sent."""
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
            self._hang_up()

    def say(self, data: bytes) -> None:
        """Send what the board prints to the client; it is lost if there is none."""
        if self._client:
            try:
                self._client.setblocking(True)
                self._client.sendall(data)
                self._client.setblocking(False)
            except OSError:
                self._hang_up()

    def _hang_up(self) -> None:
        if self._client:
            self._client.close()
            self._client = None
