"""Connects to a board at the browser's serial port, on CPython for WebAssembly.

The page keeps running while this module waits for the board.
"""

import time

from pyodide.ffi import run_sync  # waits for a JavaScript promise

from ..deploy.connection import ANSWER_S, ConnectedBoard

_POLL_S = 0.002
_GONE = "nothing comes any more"


class Port:
    """The part of pyserial's Serial that mpremote uses. line: the SerialLine of cable.mjs."""

    dtr = rts = True

    def __init__(self, line):
        self._line = line
        self._received = bytearray()

    def inWaiting(self):
        if not self._received:
            self._listen()
        return len(self._received)

    def read(self, size=1):
        """Read `size` bytes. After ANSWER_S, return the bytes received so far."""
        until_s = time.monotonic() + ANSWER_S
        while len(self._received) < size and time.monotonic() < until_s:
            self._listen()
            if len(self._received) < size:
                self.sleep(_POLL_S)
        data = bytes(self._received[:size])
        del self._received[:size]
        return data

    def _listen(self):
        self._received += self._line.take().to_py()
        if self._line.lost and not self._received:
            raise OSError(5, _GONE)

    def write(self, data):
        if not run_sync(self._line.send(bytes(data))):
            raise OSError(5, _GONE)
        return len(data)

    def close(self):
        run_sync(self._line.close())

    def sleep(self, seconds):
        run_sync(self._line.sleep(1000 * seconds))


class BrowserBoard(ConnectedBoard):
    """The board at an open serial port. line: its SerialLine. name: name of the port, for messages."""

    def __init__(self, line, name):
        self.serial, self.device_name = Port(line), name
        self.in_raw_repl, self.use_raw_paste, self.mounted, self.is_pty = False, True, False, False

    def wait(self, seconds):
        self.serial.sleep(seconds)  # time.sleep() would stop the whole page
