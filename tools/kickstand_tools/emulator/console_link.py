"""What code on an emulated board gives to the host over the console: for a chip whose registers cannot be added to, as
host_link.py does. GUEST is the code for the board's end.
"""

from collections.abc import Callable
from typing import Any

from .device import Device

_BEGIN, _END = b"\x01", b"\x02"

GUEST = """
from binascii import hexlify
class Sink:
    def write(self, data):
        print("\\x01", end="")
        for i in range(0, len(data), 64):
            print(hexlify(data[i : i + 64]).decode(), end="")
        print("\\x02", end="")
"""


class ConsoleLink:
    """sink: called with what Sink.write() on the board is given. The rest of what it prints is not touched."""

    def __init__(self, device: Device, sink: Callable[[bytes], Any]) -> None:
        self._sink = sink
        self._text = bytearray()
        device.heard = self._hear

    def _hear(self, data: bytes) -> None:
        self._text += data
        while _END in self._text:
            written, _, rest = bytes(self._text).partition(_END)
            self._text = bytearray(rest)
            self._sink(bytes.fromhex(written.rpartition(_BEGIN)[2].decode()))


def plain(output: str) -> str:
    """What was printed besides."""
    return output.rpartition(_END.decode())[2]
