"""The emulated Pico's console over USB."""

from collections.abc import Callable

from rp2040py.peripherals.usb import RPUSBController
from rp2040py.usb.cdc import USBCDC


class QuietConsole(USBCDC):
    """The board's USB console, for a host that sends nothing while it has no data.

    A real host sends nothing either. rp2040py's USB host answers every ready buffer with an empty packet. With
    rp2040py's host, the Pico would spend two thirds of its time on 34,000 empty packets per second.

    received: Function that is called with the board's output.
    """

    def __init__(self, usb: RPUSBController, received: Callable[[bytes], None]) -> None:
        super().__init__(usb)
        self._others = usb.on_endpoint_read
        self._armed: list[int] = []  # sizes of the buffers that are ready for data
        self._waiting = bytearray()
        usb.on_endpoint_read = self._on_armed
        self.on_serial_data = lambda data: received(bytes(data))

    def send(self, data: bytes) -> None:
        """Send data to the board as fast as the board accepts data."""
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
