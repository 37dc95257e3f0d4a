"""The browser's serial port for mpremote, on CPython for WebAssembly: in place of pyserial's, and of time.sleep(),
which would stop the whole page. While this waits the page has the control.
"""

import sys
import time
import types

from pyodide.ffi import run_sync  # waits for what JavaScript promises

ROOT = "/packages"  # where page/python.mjs unpacks install_archive.archive()
_POLL_S = 0.002
_GONE = "nothing comes any more"


class Port:
    """pyserial's Serial, as much of it as mpremote uses. line: the SerialLine of cable.mjs."""

    dtr = rts = True

    def __init__(self, line, timeout):
        self._line = line
        self._timeout = timeout
        self._heard = bytearray()

    def isOpen(self):
        return True

    def inWaiting(self):
        if not self._heard:
            self._listen()
        return len(self._heard)

    def read(self, size=1):
        """`size` bytes, or fewer at the time-out."""
        until_s = time.monotonic() + self._timeout
        while len(self._heard) < size and time.monotonic() < until_s:
            self._listen()
            if len(self._heard) < size:
                _sleep(self._line, _POLL_S)
        data = bytes(self._heard[:size])
        del self._heard[:size]
        return data

    def _listen(self):
        self._heard += self._line.take().to_py()
        if self._line.lost and not self._heard:
            raise OSError(5, _GONE)

    def write(self, data):
        if not run_sync(self._line.send(bytes(data))):
            raise OSError(5, _GONE)
        return len(data)

    def close(self):
        run_sync(self._line.close())


def take_place_of_pyserial(line):
    """From now on what mpremote opens is this line, whatever the port's name: with modules for mpremote to import, of
    which one is asked for a console's properties, and with sleep() in those that wait for a board."""
    names = "serial", "serial.tools", "serial.tools.list_ports"
    serial, tools, list_ports = (types.ModuleType(name) for name in names)
    serial.__version__ = "3.5"
    serial.SerialException = OSError
    serial.serial_for_url = lambda _name, timeout, **_options: Port(line, timeout)
    serial.tools, tools.list_ports = tools, list_ports
    console = types.ModuleType("mpremote.console")
    console.VT_ENABLED = False
    for module in (serial, tools, list_ports, console):
        sys.modules[module.__name__] = module
    for path in (f"{ROOT}/firmware", ROOT):
        if path not in sys.path:
            sys.path.append(path)
    from mpremote import transport_serial

    from ..deploy import board_console, connection

    transport_serial.serial = serial  # which an earlier line may have taken
    clock = types.SimpleNamespace(monotonic=time.monotonic, time=time.time, sleep=lambda s: _sleep(line, s))
    for module in (transport_serial, connection, board_console):
        module.time = clock


def _sleep(line, seconds):
    run_sync(line.sleep(1000 * seconds))
