"""Offers the emulated Pico's console as the port that mpremote and the tools open, in the test's own process.

Emulated time passes only while a program waits at the port, and every time-out counts emulated time. On a busy machine
a test only takes longer. A board that hangs ends the test.
"""

import types

from kickstand_tools.deploy import connection
from mpremote import transport_serial

NAME = "/dev/emulated"


class EmulatedPort:
    """Replaces pyserial's port. device: an emulator.pico.Pico. meanwhile(): a function called during each wait."""

    def __init__(self, device, meanwhile=lambda: None):
        self._device, self._meanwhile = device, meanwhile
        self._heard = bytearray()
        self._awaited = 0  # number of bytes that end the wait
        self.timeout_s = 0.0
        device.heard = self._hear

    def isOpen(self):
        return self._device.powered

    def inWaiting(self):
        self._check()
        return len(self._heard)

    def read(self, size=1):
        """Read this number of bytes, or fewer at the time-out."""
        self._let_pass(self.timeout_s, size)
        data = bytes(self._heard[:size])
        del self._heard[:size]
        return data

    def write(self, data):
        self._check()
        self._device.send(bytes(data))
        return len(data)

    def close(self):
        pass

    def sleep(self, seconds):
        """Replaces time.sleep(). Output of the board ends the wait early."""
        self._let_pass(seconds, len(self._heard) + 1)

    def _let_pass(self, seconds, until_bytes):
        end_s = self._device.time_s + seconds
        self._awaited = until_bytes
        while len(self._heard) < until_bytes and (left_s := end_s - self._device.time_s) > 1e-9:
            self._check()
            self._device.run(min(left_s, 0.02))
            self._meanwhile()
        self._awaited = 0

    def _hear(self, data):
        self._heard += data
        if self._awaited and len(self._heard) >= self._awaited:
            self._device.stop()

    def _check(self):
        if not self._device.powered:
            raise OSError(5, "Input/output error")


def plug_in(monkeypatch, device, meanwhile=lambda: None):
    """Connect a Pico to the port NAME. mpremote and the tools at this port then use emulated time."""
    port = EmulatedPort(device, meanwhile)

    def open_port(_name, timeout, **_options):
        port.timeout_s = timeout
        return port

    clock = types.SimpleNamespace(monotonic=lambda: device.time_s, time=lambda: device.time_s, sleep=port.sleep)
    monkeypatch.setattr(transport_serial.serial, "serial_for_url", open_port)
    for module in (transport_serial, connection):
        monkeypatch.setattr(module, "time", clock)
    return port
