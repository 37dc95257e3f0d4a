"""MicroPython's raw prompt for a FakeBoard, byte by byte, at the other end of a SerialLine."""

import base64

_PROMPT = b"raw REPL; CTRL-B to exit\r\n>"
_CTRL_A, _CTRL_C, _CTRL_D = b"\x01\x03\x04"
_RAW_PASTE = b"\x05A\x01"


class RawPrompt:
    """Replaces emulator.pico.Pico for a SerialLine.

    The app does not really run. At each start the app sends the next blocks and waits for Ctrl-C.

    board: the FakeBoard on which the code runs.
    streams: lists of blocks that the app sends.
    vehicle: setting VEHICLE in the board's config.py.
    deaf: True for a board that never answers.
    """

    def __init__(self, board, *streams, vehicle="motorcycle", deaf=False):
        self.board, self._deaf = board, deaf
        self._streams = [streamed(*blocks) for blocks in streams]
        self._vehicle = b"vehicle %s\r\n" % vehicle.encode()
        self._streaming = False
        self._typed = b""
        self.heard = lambda data: None
        self.console = self.chip = self

    def run(self, seconds):
        """Do nothing, because this board needs no time to answer."""

    def stop(self):
        """Do nothing, because no program runs."""

    def send(self, data):
        """Receive the bytes that the page types."""
        for byte in b"" if self._deaf else data:
            if byte == _CTRL_C:
                self._typed = b""
                if self._streaming:
                    self._streaming = False
                    self.heard(b"\x04\x04>")
            elif byte == _CTRL_A and self._typed + b"\x01" == _RAW_PASTE:
                self._typed = b""
                self.heard(b"R\x00")  # MicroPython's answer if it knows raw paste mode but does not support it
            elif byte == _CTRL_A:
                self._typed = b""
                self.heard(_PROMPT)
            elif byte == _CTRL_D:
                code, self._typed = self._typed, b""
                self._do(code.decode())
            else:
                self._typed = (self._typed + bytes([byte])).lstrip(b"\r")

    def _do(self, code):
        if not code:
            vars(self.board.modules["sys"]).pop("modules", None)  # what the firmware had imported
            self.heard(b"OK\r\nMPY: soft reboot\r\n" + _PROMPT)
        elif "machine.reset()" in code:
            self.board.resets += 1
            self.heard(b"OK")
        elif "RideStream" in code and self._streams:
            self._streaming = True
            vehicle = self._vehicle if "chosen.VEHICLE" in code else b""
            self.heard(b"OK" + vehicle + self._streams.pop(0))
        else:
            out, error = self.board.exec_raw(code)
            self.heard(b"OK" + out + b"\x04" + error + b"\x04>")


def streamed(*blocks):
    """Return the output of a board that streams these blocks."""
    pieces = ([block[begin : begin + 256] for begin in range(0, len(block), 256)] for block in blocks)
    return b"".join(b"".join(base64.b64encode(part) + b"\r\n" for part in parts) + b".\r\n" for parts in pieces)
